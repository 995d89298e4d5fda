"""The response of identified masses to forces: linear equations whose matrices may change with time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

_TERMS = 14
"""Of the exponential's series, whose argument has a norm of at most a half: the rest is below 1e-16."""

_SINGULAR = 1e12
"""Condition number from which a matrix of inertia counts as singular."""

_PIECE = 1 << 12
"""Steps whose exponentials are in memory at a time."""


@dataclass(frozen=True)
class LinearMasses:
    """Linear equations of motion of several masses.

    Parameters
    ----------
    inertia, damping, stiffness : ndarray, shape (masses, masses, n)
    period : float
        Seconds from one sample to the next.
    """

    inertia: Array
    damping: Array
    stiffness: Array
    period: float

    @property
    def masses(self) -> int:
        """Number of masses."""
        return len(self.inertia)

    def lasting(self, samples: int) -> LinearMasses:
        """Return equations that stay as they are at the first sample for so many samples."""
        inertia, damping, stiffness = (
            np.repeat(one[:, :, :1], samples, axis=2) for one in (self.inertia, self.damping, self.stiffness)
        )
        return LinearMasses(inertia, damping, stiffness, self.period)

    @np.errstate(all="ignore")
    def respond(
        self, forces: Array, initial: Array | None, angles: Array | None, *, held: Array | None = None
    ) -> tuple[Array, Array]:
        """Return the angles with which masses respond to forces, shape (masses, n), and the state at the first sample.

        Between two samples matrices are the mean of theirs there and forces are linear, for which the response is exact.

        Parameters
        ----------
        forces : ndarray, shape (masses, n)
        held : ndarray, shape (masses, n - 1), optional
            Forces that are constant between two samples, beside these.
        initial : ndarray, shape (2, masses), optional
            Angles and velocities at the first sample.
        angles : ndarray, shape (masses, n), optional
            What was recorded: the state at the first sample is the one that fits best.

        Raises
        ------
        ValueError
            If a mass has no inertia, or the response leaves the range of numbers.
        """
        check_inertia(np.moveaxis(self.inertia, 2, 0))
        count, samples = 2 * self.masses, forces.shape[1]
        # The response of the rest to the forces, and those to each of the states at the beginning.
        state = np.concatenate([np.zeros((count, 1)), np.eye(count)], axis=1)
        if initial is not None:
            state = np.ravel(initial).astype(np.float64)[:, np.newaxis]
        found = np.empty((samples, self.masses, state.shape[1]))
        found[0] = state[: self.masses]
        for first in range(0, samples - 1, _PIECE):
            steps = slice(first, min(samples - 1, first + _PIECE))
            moved, pushed = self._steps(forces, steps, held)
            for place, (move, push) in enumerate(zip(moved, pushed, strict=True), first + 1):
                state = move @ state
                state[:, 0] += push
                found[place] = state[: self.masses]
        if not np.isfinite(found).all():
            lost()
        if initial is not None or angles is None:
            return np.asarray(found[:, :, 0].T), np.zeros((2, self.masses)) if initial is None else initial
        there = np.isfinite(angles.T)
        begun = np.linalg.lstsq(found[there][:, 1:], (angles.T - found[:, :, 0])[there], rcond=None)[0]
        return np.asarray((found[:, :, 0] + found[:, :, 1:] @ begun).T), np.asarray(begun.reshape(2, self.masses))

    def _steps(self, forces: Array, steps: slice, held: Array | None) -> tuple[Array, Array]:
        """Return by which matrix each step moves the state, and what forces add."""
        masses, here = self.masses, np.arange(steps.start, steps.stop)
        middle = [
            (one[:, :, here] + one[:, :, here + 1]).transpose(2, 0, 1) / 2
            for one in (self.inertia, self.damping, self.stiffness)
        ]
        solved = np.linalg.solve(
            middle[0], np.concatenate([middle[2], middle[1], np.broadcast_to(np.eye(masses), middle[0].shape)], axis=2)
        )
        # States, forces and their growth: the exponential of this matrix moves all of them by a step.
        size = 4 * masses
        rates = np.zeros((here.size, size, size))
        rates[:, :masses, masses : 2 * masses] = np.eye(masses)
        rates[:, masses : 2 * masses, : 2 * masses] = -solved[:, :, : 2 * masses]
        rates[:, masses : 2 * masses, 2 * masses : 3 * masses] = solved[:, :, 2 * masses :]
        rates[:, 2 * masses : 3 * masses, 3 * masses :] = np.eye(masses) / self.period
        moved = _exponential(rates * self.period)[:, : 2 * masses]
        now, growth = forces[:, here], forces[:, here + 1] - forces[:, here]
        if held is not None:
            now = now + held[:, here]
        pushed = moved[:, :, 2 * masses :] @ np.concatenate([now, growth]).T[:, :, np.newaxis]
        return moved[:, :, : 2 * masses], pushed[:, :, 0]


def check_inertia(inertia: Array) -> None:
    """Refuse matrices of inertia, shape (n, masses, masses), by which something has no acceleration."""
    if not (np.linalg.cond(inertia) < _SINGULAR).all():
        raise ValueError(
            "every mass must have an inertia to be simulated; got a matrix of inertia that is singular at some time; give one, "
            "however small"
        )


def lost() -> NoReturn:
    """Say that a response left the range of numbers."""
    raise ValueError(
        "a response must stay within the range of numbers; the identified masses are unstable, or too fast for their samples; "
        "simulate a shorter stretch, or look at the elements"
    )


def _exponential(matrices: Array) -> Array:
    """Return the exponentials of matrices, by a series of small parts of them that are squared again."""
    norm = float(np.abs(matrices).sum(axis=2).max(initial=0.0))
    halvings = max(0, int(np.ceil(np.log2(max(2 * norm, 1e-300))))) if np.isfinite(norm) else 0
    part = matrices / 2**halvings
    unit = np.broadcast_to(np.eye(matrices.shape[1]), matrices.shape)
    total: Array = np.array(unit)
    for term in range(_TERMS, 0, -1):
        total = unit + part @ total / term
    for _ in range(halvings):
        total = total @ total
    return total
