"""What a fit of expansions takes: rows, unknowns, noise, and where to begin, from a record and what windows found in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._derivatives import rates_of_channel
from tvident._equation import COEFFICIENTS, parameter
from tvident._expansion import (
    DERIVATIVES,
    Curves,
    ExpandedRecord,
    Expansion,
    Noise,
    RecordPart,
    of_one,
    part_of,
    rates_of,
    spread_of,
    with_least_noise,
)
from tvident._identify.data import Data
from tvident._identify.settings import Request
from tvident._identify.task import Task
from tvident._results import Identification

Array = npt.NDArray[np.float64]


def role_of(name: str, expansion: Expansion | None) -> str:
    """Return what an unknown multiplies."""
    if name == "inertia" and expansion is not None and expansion.inertia_times == "momentum":
        return "momentum"
    return name if name in COEFFICIENTS else "term"


@dataclass(frozen=True)
class ExpandedInputs:
    """A record and what windows found in it, as the fit of expansions takes them.

    Parameters
    ----------
    data : Data
    request : Request
    expansions : mapping of str to Expansion
    task : Task
        Of the windows.
    pilot : Identification
        What they found.
    """

    data: Data
    request: Request
    expansions: Mapping[str, Expansion]
    task: Task
    pilot: Identification

    @cached_property
    def angle(self) -> Array:
        """The angle, from where the spring is relaxed."""
        return np.asarray(self.data.angles, np.float64) - self.zero

    @cached_property
    def zero(self) -> float:
        """The angle at which windows found the spring relaxed."""
        zero = self.pilot.settings.get("angle_zero") or 0.0
        return float(zero[0] if isinstance(zero, list) else zero)

    @cached_property
    def record(self) -> ExpandedRecord:
        """The record as rows are made of it; the last of its terms is that of another zero of the angle."""
        data, settings = self.data, self.pilot.settings
        torque = np.asarray(data.torques, np.float64)
        usable = np.isfinite(self.angle) & np.isfinite(torque)
        for one in self.expansions.values():
            for channel in one.channels:
                usable &= np.isfinite(channel)
        terms = list(self.terms.values())
        for samples in terms:
            usable &= np.isfinite(samples)
        if self.zero:
            terms.append(-np.nan_to_num(self.pilot.stiffness))
        late = settings.get("lag_samples") or [settings["lag"] / data.period]
        return ExpandedRecord(
            angles=np.where(usable, self.angle, 0.0)[np.newaxis],
            torques=np.where(usable, torque, 0.0)[np.newaxis],
            usable=usable[np.newaxis],
            centres=np.ones(usable.shape, bool) if data.mask is None else data.mask,
            period=data.period,
            half=int(settings["window_length"]) // 2,
            exponent=int(settings["exponent"]),
            lag=float(late[0]),
            terms=[np.where(usable, samples, 0.0) for samples in terms],
            spread=spread_of(data.weights_of_core(strong=False)),
        )

    @cached_property
    def terms(self) -> dict[str, Array]:
        """Samples of every further term."""
        inner = {name: np.ravel(np.asarray(one, float)) for name, one in self.pilot.settings["inner"].items()}
        return self.task.columns.all_samples(inner)

    @cached_property
    def parts(self) -> list[RecordPart]:
        """The unknowns, still without sizes."""
        rates = partial(rates_of_channel, self.data.period)
        found, numbers = [], {name: number for number, name in enumerate(self.terms)}
        for name in (*COEFFICIENTS, *self.terms):
            expansion = self.expansions.get(name)
            entries = of_one(role_of(name, expansion), numbers.get(name, 0))
            if expansion is None:
                if name in self.terms or name not in self.known_values:
                    found.append(RecordPart(name, entries))
                continue
            found.append(part_of(name, entries, expansion, (self.data.time, 1.0), rates))
        if self.zero:
            found.append(RecordPart("angle_zero", of_one("term", len(self.terms))))
        return found

    @cached_property
    def known_values(self) -> dict[str, Array]:
        """Coefficients that are known, at every sample."""
        data = self.data
        given = {
            name: parameter(name, one, data.time.shape)
            for name, one in self.request.parameters.items()
            if not isinstance(one, str | Expansion)
        }
        return {name: np.broadcast_to(np.asarray(one, np.float64), data.time.shape) for name, one in given.items()}

    @property
    def known(self) -> Curves:
        """The same with their rates, as rows take them."""
        found = []
        for name, value in self.known_values.items():
            along = [np.asarray(value)]
            for _ in range(DERIVATIVES.get(name, 0)):
                along.append(np.gradient(along[-1], self.data.period) if np.ptp(value) else np.zeros(value.shape))
            if np.any(value):
                found.append((of_one(name), along))
        return found

    @property
    def start(self) -> Curves:
        """The coefficients as windows have them; without their slopes, which are noise."""
        found = []
        for name in COEFFICIENTS:
            if name in self.known_values:
                continue
            value: Array = getattr(self.pilot, name)
            there = np.isfinite(value)
            middle = float(np.median(value[there])) if there.any() else 0.0
            level = np.where(there, value, middle) if name == "stiffness" else np.full(value.shape, middle)
            entries = of_one(role_of(name, self.expansions.get(name)))
            found.append((entries, [level, *[np.zeros(value.shape)] * rates_of(entries)]))
        terms = [(of_one("term", number), [self.pilot.terms[name]]) for number, name in enumerate(self.terms)]
        found += [(entries, [np.nan_to_num(values)]) for entries, (values,) in terms]
        return [*found, *self.known]

    @cached_property
    def noise(self) -> Noise:
        """Variances of the noise of angle and torque."""
        (angle,) = _core.noise(self.data.angles, self.request.quantisation)
        shown = self.pilot.settings.get("shown_noise")
        # A channel tells the noise of all samples, parameters are found with that of one of mean weight.
        mean = 1.0 if self.data.weights is None else self.data.weights.spread[0]
        torque = float(shown[0]) if shown else _core.noise(self.data.torques)[0].sigma ** 2 / mean
        return with_least_noise(([angle.sigma**2 / mean], [torque]), [self.record], self.start)
