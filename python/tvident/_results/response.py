"""The response of an identified system to a torque, and how much of a recorded angle it accounts for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._equation import BUILT_IN, COEFFICIENTS, TERM_NAMES, FixedTerm

Array: TypeAlias = npt.NDArray[np.float64]
Numbers: TypeAlias = npt.NDArray[np.number]

_ROUNDS = 40
"""Of linearising terms of the user's own around the response."""

_SETTLED = 1e-7
"""How much the response may still change, of its largest value."""

_MOVED = 1e-6
"""By how much angle and velocity are moved to see what a term does, of their largest values."""


@dataclass(frozen=True)
class Model:
    r"""An equation of motion in which every factor is known.

    Parameters
    ----------
    values : mapping of str to ndarray
        Inertia, damping, stiffness and factors of terms: shape (\*, 1) if they are constant, (\*, n) otherwise.
    own : mapping of str to FixedTerm
        Terms of the user's own.
    period : float
        Seconds from one sample to the next.
    start : float
        Time of the first sample.
    lags : sequence of float
        Samples by which the torque of every record comes late.
    bridged : int
        Samples of the longest gap of a parameter that is bridged.
    stribeck : sequence of float
        The Stribeck velocity of every record, where there is one.
    """

    values: Mapping[str, Array]
    own: Mapping[str, FixedTerm]
    period: float
    start: float
    lags: Sequence[float]
    bridged: int
    stribeck: Sequence[float] = ()

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch; empty for a single record."""
        return self.values["inertia"].shape[:-1]

    def check(self, torque: Numbers) -> None:
        """Refuse a torque that parameters do not belong to, and systems that no torque moves in one way only."""
        samples = max(value.shape[-1] for value in self.values.values())
        changing = [name for name, value in self.values.items() if value.shape[-1] > 1]
        if torque.shape[:-1] != self.batch:
            raise ValueError(
                f"torque must have a record for each that was identified; got shape {torque.shape} for a batch of shape {self.batch}; "
                "give one torque a record"
            )
        if changing and torque.shape[-1] != samples:
            raise ValueError(
                f"torque must have the record's {samples} samples where parameters change with time; got {torque.shape[-1]}; "
                f"give as many, or identify {' and '.join(changing)} as constant"
            )
        if (self.values["inertia"] != 0).any():
            return
        acting = [name for name, value in self.values.items() if (value != 0).any()]
        of_velocity = [
            name for name in acting if name in self.own or (name in BUILT_IN and BUILT_IN[name].needs_velocity)
        ]
        of_angle = [name for name in acting if name in BUILT_IN and BUILT_IN[name].is_of_angle]
        if of_velocity or (of_angle and (self.values["damping"] == 0).all()):
            raise ValueError(
                f"a system without inertia must be linear, or damped with terms of the angle alone, to be simulated; got "
                f"{' and '.join(of_velocity or of_angle)}; give it an inertia, however small"
            )

    def respond(
        self,
        torque: Numbers,
        *,
        angle: Numbers | None = None,
        initial: Array | None = None,
        spans: list[tuple[int, int, int]] | None = None,
    ) -> tuple[Array, Array]:
        """Return angle and velocity; the angle that was recorded, or `initial` tells the state at the beginning.

        Raises
        ------
        ValueError
            If the response leaves the range of numbers.
        """
        if not self.own:
            return self._once(torque, {}, angle=angle, initial=initial, spans=spans)
        return self._around_itself(torque, angle=angle, initial=initial, spans=spans)

    def _once(self, torque: Numbers, instead: Mapping[str, Array], **how: Any) -> tuple[Array, Array]:
        """Simulate a system of built-in terms. Some of its values may be others."""
        values, shape = {**self.values, **instead}, torque.shape

        def factor(name: str) -> Any:
            value = values[name]
            if value.size == 1:
                return float(value.ravel()[0])
            return np.broadcast_to(value, shape)

        initial = how["initial"]
        fades = any(name in BUILT_IN and BUILT_IN[name].inner for name in values)
        found = _core.respond(
            [factor(name) for name in COEFFICIENTS],
            [(name, factor(name)) for name in values if name in TERM_NAMES],
            torque,
            delta=self.period,
            lag=list(self.lags),
            bridged=self.bridged,
            angle=how["angle"],
            initial=None if initial is None else initial.reshape(-1, 2).tolist(),
            spans=how["spans"],
            stribeck=list(self.stribeck) if fades else None,
        )
        lost = [(record, sample) for record, sample in enumerate(found.lost) if sample is not None]
        if lost:
            record, sample = lost[0]
            which = f" of record {record}" if self.batch else ""
            raise ValueError(
                f"a response must stay within the range of numbers; that{which} is lost after {sample * self.period:.4g} s, since the "
                "identified system is unstable, or too fast for its samples; simulate a shorter stretch, or look at the parameters"
            )
        return found.angle.reshape(shape), found.velocity.reshape(shape)

    @np.errstate(all="ignore")
    def _around_itself(self, torque: Numbers, **how: Any) -> tuple[Array, Array]:
        """Simulate a system with terms of the user's own: they are linearised around the last response until it stays (Newton)."""
        shape, t = torque.shape, self.start + np.arange(torque.shape[-1]) * self.period
        recorded = how["angle"]
        place = np.zeros(shape) if recorded is None else np.nan_to_num(without_gaps(recorded))
        speed = np.gradient(place, self.period, axis=-1)
        for _ in range(_ROUNDS):
            left, steps = torque.astype(np.float64), [np.zeros(shape), np.zeros(shape)]
            for name, term in self.own.items():
                moved = [_MOVED * max(1e-300, float(np.nanmax(np.abs(one), initial=0.0))) for one in (place, speed)]
                here = term.values(t, place, speed).astype(np.float64)
                slopes = [
                    (term.values(t, place + moved[0], speed) - here) / moved[0],
                    (term.values(t, place, speed + moved[1]) - here) / moved[1],
                ]
                left = left - self.values[name] * (here - slopes[0] * place - slopes[1] * speed)
                steps = [step + self.values[name] * slope for step, slope in zip(steps, slopes, strict=True)]
            instead = {"stiffness": self.values["stiffness"] + steps[0], "damping": self.values["damping"] + steps[1]}
            angle, velocity = self._once(left, instead, **how)
            change = np.nanmax(np.abs(angle - place), initial=0.0)
            done = change <= _SETTLED * np.nanmax(np.abs(angle), initial=0.0)
            there = np.isfinite(angle)
            place, speed = np.where(there, angle, place), np.where(there, velocity, speed)
            if done:
                return angle, velocity
        names = " and ".join(self.own)
        raise ValueError(
            f"a response must settle while terms are linearised around it; with {names} it changes after {_ROUNDS} rounds by "
            f"{change:.3g} rad; pass angle= to begin near the truth, smooth the term where it jumps, or take a built-in term"
        )


def without_gaps(channel: Numbers) -> Array:
    """Return a channel, linear where it is missing; as it is where nothing is there."""
    filled = np.array(channel, dtype=np.float64)
    for row in filled.reshape(-1, filled.shape[-1]):
        there = np.isfinite(row)
        if there.any() and not there.all():
            row[~there] = np.interp(np.flatnonzero(~there), np.flatnonzero(there), row[there])
    return filled


@np.errstate(all="ignore")
def accounted_for(recorded: Numbers, simulated: Array) -> Array:
    """Return the share of the recorded angle's variance that a response accounts for, in percent, at the samples that have both."""
    there = np.isfinite(recorded) & np.isfinite(simulated)
    count = there.sum(axis=-1, keepdims=True)

    def variance(values: Numbers) -> Array:
        kept = np.where(there, values, 0.0)
        mean = kept.sum(axis=-1, keepdims=True) / count
        return np.asarray(np.where(there, (kept - mean) ** 2, 0.0).sum(axis=-1))

    return np.asarray(100 * (1 - variance(recorded - simulated) / variance(recorded.astype(np.float64))))


def samples_of(rows: int, step: int, asked: int) -> int:
    """Return how many samples have so many results: those that are asked for, if they are as many, or the fewest."""
    return asked if -(-asked // step) == rows else (rows - 1) * step + 1


def every_sample(value: Array, samples: int, step: int) -> Array:
    """Return values of every ``step``-th sample at every one, linear between them."""
    if step == 1:
        return value
    flat = value.reshape(-1, value.shape[-1])
    places = np.arange(samples) / step
    return np.stack([np.interp(places, np.arange(flat.shape[-1]), row) for row in flat]).reshape(
        *value.shape[:-1], samples
    )
