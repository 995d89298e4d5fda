"""The motion of masses whose equations are not linear: terms of the angle, dry friction that sticks, and mechanisms."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._merged.response import lost

Array: TypeAlias = npt.NDArray[np.float64]
Flags: TypeAlias = npt.NDArray[np.bool_]

_CHECKED = 16
"""Every so many intervals one is integrated with half the step, too."""

_SETTLED = 1e-5
"""What halves of all steps may change in all, of the largest angle."""

_FINEST = 32
"""Steps between two samples at most."""

_EVENTS = 8
"""Turns of each mass between two samples that are looked for."""

_SECANTS = 3
"""Steps by which the time of a turn is found."""

_STILL = 1e-3
"""A mass stands still whose velocity is at most this part of what it would change in the rest of the interval."""


class MotionEquations(Protocol):
    """Equations of motion at some states, shape (masses, states)."""

    def at(self, sample: int, q: Array, v: Array) -> tuple[Array, Array]:
        """Return the matrix of inertia, shape (states, masses, masses), and the forces that are no torque and no dry friction."""


@dataclass(frozen=True)
class Moving:
    """Masses that move: states side by side, each by itself, from sample to sample.

    Classic Runge-Kutta steps of fourth order with dry friction as it is: a mass slides until it turns, then sticks while the others can
    hold it. Torques are linear between two samples, factors are the mean of theirs there.

    Parameters
    ----------
    equations : MotionEquations
    friction : ndarray, shape (masses, n - 1)
        Of every mass between two samples; zero where there is none.
    period : float
    held : ndarray, shape (masses, n - 1), optional
        Forces that are constant between two samples, beside the torques.
    steps : int
        Between two samples.
    """

    equations: MotionEquations
    friction: Array
    period: float
    held: Array | None = None
    steps: int = 1

    def respond(self, forces: Array, state: Array) -> tuple[Array, Array]:
        """Return positions and velocities at every sample, shape (n, masses, states).

        Parameters
        ----------
        forces : ndarray, shape (masses, n)
        state : ndarray, shape (2, masses, states)
            Positions and velocities at the first sample.

        Raises
        ------
        ValueError
            If the response leaves the range of numbers, or depends on the step however small it is.
        """
        finer = self
        while finer.steps <= _FINEST:
            found, wrong = finer._tried(forces, state)
            if not np.isfinite(found).all():
                lost()
            if wrong <= _SETTLED * np.abs(found[:, 0]).max(initial=0.0):
                return found[:, 0], found[:, 1]
            finer = replace(finer, steps=2 * finer.steps)
        raise ValueError(
            f"a response must settle as steps become smaller; with {_FINEST} steps between two samples it still changes by {wrong:.3g}; "
            "smooth the function where it jumps, take the term 'coulomb' for dry friction, or simulate fewer samples"
        )

    @np.errstate(all="ignore")
    def _tried(self, forces: Array, state: Array) -> tuple[Array, float]:
        """Return the motion with these steps, and about how wrong it is."""
        samples, wrong = forces.shape[1], 0.0
        found = np.empty((samples, *state.shape))
        found[0] = state
        modes = np.sign(state[1])
        if samples > 1:
            modes = self._released(0, forces, state, modes, np.zeros(state.shape[2]))
        for sample in range(samples - 1):
            before = state, modes
            state, modes = self._interval(sample, forces, *before, self.steps)
            found[sample + 1] = state
            if sample % _CHECKED == 0:
                finer, _ = self._interval(sample, forces, *before, 2 * self.steps)
                wrong += _CHECKED * float(np.abs(finer[0] - state[0]).max(initial=0.0))
                if not np.isfinite(wrong):
                    found[sample + 1 :] = np.nan
                    break
        return found, wrong

    def _interval(self, sample: int, forces: Array, state: Array, modes: Array, steps: int) -> tuple[Array, Array]:
        """Move states from one sample to the next."""
        rubs = self.friction[:, sample] > 0
        for step in range(steps):
            begin = np.full(state.shape[2], step / steps)
            left = np.full(state.shape[2], 1 / steps)
            for _ in range(_EVENTS * int(rubs.sum())):
                moved = self._step(sample, forces, state, modes, (begin, left))
                turned = rubs[:, np.newaxis] & (modes * moved[1] < 0)
                if not turned.any():
                    state = moved
                    break
                part = self._first_turn(sample, forces, state, modes, (begin, left), moved)
                state = self._step(sample, forces, state, modes, (begin, part))
                begin, left = begin + part, left - part
                # Who turned stands still, and sticks until what pulls is larger than the friction.
                still = turned & (modes * moved[1] < 0) & (np.abs(state[1]) <= _STILL * np.abs(moved[1] - state[1]))
                state = np.stack([state[0], np.where(still, 0.0, state[1])])
                modes = np.where(still, 0.0, modes)
                modes = self._released(sample, forces, state, modes, begin)
            else:
                state = self._step(sample, forces, state, modes, (begin, left))
            if rubs.any():
                modes = self._released(sample, forces, state, modes, np.full(state.shape[2], (step + 1) / steps))
        return state, modes

    def _first_turn(
        self, sample: int, forces: Array, state: Array, modes: Array, span: tuple[Array, Array], moved: Array
    ) -> Array:
        """Return after which part of an interval the first mass of every state turns; all of what is left where none does."""
        rubs = self.friction[:, sample, np.newaxis] > 0
        begin, part = span
        for _ in range(_SECANTS):
            ahead = modes * moved[1]
            over = rubs & (ahead < 0)
            there = modes * state[1]
            share = np.where(over & (there > 0), there / np.where(over, there - ahead, 1.0), np.where(over, 0.0, 1.0))
            least = share.min(axis=0)
            if (least >= 1).all():
                break
            part = part * least
            moved = self._step(sample, forces, state, modes, (begin, part))
        return np.asarray(part)

    def _released(self, sample: int, forces: Array, state: Array, modes: Array, at: Array) -> Array:
        """Return in which direction masses slide: those that stand still do where what pulls at them is larger than the friction."""
        rubs = self.friction[:, sample, np.newaxis] > 0
        stuck = rubs & (modes == 0)
        if not stuck.any():
            return modes
        inertia, rest = self.equations.at(sample, *state)
        pull = self._torque(sample, forces, at) - rest - self.friction[:, sample, np.newaxis] * modes
        held = pull - np.einsum("sij,js->is", inertia, _accelerations(inertia, pull, stuck))
        goes = stuck & (np.abs(held) > self.friction[:, sample, np.newaxis])
        return np.where(goes, np.sign(held), modes)

    def _torque(self, sample: int, forces: Array, at: Array) -> Array:
        begin, end = forces[:, sample, np.newaxis], forces[:, sample + 1, np.newaxis]
        found = begin + (end - begin) * at
        return np.asarray(found if self.held is None else found + self.held[:, sample, np.newaxis])

    def _step(self, sample: int, forces: Array, state: Array, modes: Array, span: tuple[Array, Array]) -> Array:
        """Move every state by a part of the interval; who slides and who sticks stays."""
        begin, part = span
        step = part * self.period
        friction = self.friction[:, sample, np.newaxis]
        stuck = (friction > 0) & (modes == 0)

        def slope(now: Array, share: float) -> Array:
            inertia, rest = self.equations.at(sample, now[0], now[1])
            pull = self._torque(sample, forces, begin + share * part) - rest - friction * modes
            return np.stack([now[1], _accelerations(inertia, pull, stuck)])

        one = slope(state, 0.0)
        two = slope(state + step / 2 * one, 0.5)
        three = slope(state + step / 2 * two, 0.5)
        return np.asarray(state + step / 6 * (one + 2 * two + 2 * three + slope(state + step * three, 1.0)))


def _accelerations(inertia: Array, pull: Array, stuck: Flags) -> Array:
    """Return accelerations, shape (masses, states); what sticks has none."""
    if not stuck.any():
        return np.asarray(np.linalg.solve(inertia, pull.T[:, :, np.newaxis])[:, :, 0].T)
    free = ~stuck.T
    moving = np.where(free[:, :, np.newaxis] & free[:, np.newaxis, :], inertia, np.eye(len(pull)))
    return np.asarray(np.linalg.solve(moving, np.where(free, pull.T, 0.0)[:, :, np.newaxis])[:, :, 0].T)
