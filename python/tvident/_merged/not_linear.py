"""Equations of masses that are not linear: their forces at single states, and the state in which a recording began."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._merged.mechanism import Mechanism
from tvident._merged.motion import Moving
from tvident._merged.response import check_inertia
from tvident._results import without_gaps

Array: TypeAlias = npt.NDArray[np.float64]

TermFunction: TypeAlias = Callable[[Array, Array, Array], Array]
"""A function of time, angle and velocity."""

_BEGINNING = 2048
"""Samples that tell the state at the first of them where equations are not linear."""

_HALVINGS, _SHORTEST = 3, 64
"""How often these samples are halved to begin with, and the fewest that are enough."""

_ROUNDS = 6
"""Of estimating the state from so many samples (Gauss-Newton)."""

_FIRST = 31
"""Samples of the parabola that the state is guessed from."""

_MOVED = 1e-4
"""Part of the spread of angles and velocities by which a state is moved to see what that does."""

_SETTLED = 1e-5
"""Change of the state, of the spreads, at which it has settled."""

_RANK = 1e-9
"""Part of the largest effect below which a state has none: a mass that sticks has no velocity."""

_SAME = 1e-6
"""Part of a term by which its values may differ between single samples and whole records."""


@dataclass(frozen=True)
class General:
    """Equations of masses at single states: matrices, terms of the motion, and a mechanism.

    Parameters
    ----------
    inertia, damping, stiffness : ndarray, shape (masses, masses, n - 1)
        Between two samples.
    terms : sequence of (ndarray, ndarray, callable)
        How much each mass moves in the term's motion, the factor between two samples, and the function of time and that motion's angle
        and velocity. The term acts on each mass as much as it moves.
    period : float
    mechanism : Mechanism, optional
    factors : mapping of str to ndarray, shape (n - 1,)
        Of the mechanism.
    step : ndarray, shape (masses,)
        By which coordinates are moved to find the slopes of energies.
    """

    inertia: Array
    damping: Array
    stiffness: Array
    terms: Sequence[tuple[Array, Array, TermFunction]]
    period: float
    mechanism: Mechanism | None
    factors: Mapping[str, Array]
    step: Array

    def at(self, sample: int, q: Array, v: Array) -> tuple[Array, Array]:
        """Return the matrix of inertia, shape (states, masses, masses), and the forces that are no torque and no dry friction."""
        inertia = np.broadcast_to(self.inertia[:, :, sample], (q.shape[1], *self.inertia.shape[:2]))
        rest = self.damping[:, :, sample] @ v + self.stiffness[:, :, sample] @ q
        time = np.full(q.shape[1], (sample + 0.5) * self.period)
        for along, factor, term in self.terms:
            rest += np.outer(along, factor[sample] * term(time, along @ q, along @ v))
        if self.mechanism is not None:
            now = {name: float(factor[sample]) for name, factor in self.factors.items()}
            moving, forces = self.mechanism.dynamics(now, q, v, self.step)
            inertia, rest = inertia + moving, rest + forces
        return inertia, rest

    def check(self, motion: tuple[Array, Array]) -> None:
        """Refuse terms that need more than one sample, which single states do not tell.

        Parameters
        ----------
        motion : (ndarray, ndarray), shape (masses, n - 1)
            Angles and velocities.
        """
        time: Array = (np.arange(motion[0].shape[1], dtype=np.float64) + 0.5) * self.period
        for along, _, term in self.terms:
            q, v = (along @ one for one in motion)
            whole = term(time, q, v)
            alone = np.concatenate([term(time[at : at + 1], q[at : at + 1], v[at : at + 1]) for at in _some(time.size)])
            if np.abs(whole[_some(time.size)] - alone).max() > _SAME * np.abs(whole).max():
                raise ValueError(
                    "a term must be a function of one sample to be simulated with several masses; got one that needs others, as a delay "
                    "does; held_back() compares torques"
                )


@dataclass(frozen=True)
class NotLinear:
    """Equations of masses that are not linear.

    Parameters
    ----------
    equations : General
    friction : ndarray, shape (masses, n - 1)
    beside : ndarray, shape (masses, n)
        What acts beside the torques.
    held : ndarray, shape (masses, n - 1), optional
        What is constant between two samples.
    period : float
    """

    equations: General
    friction: Array
    beside: Array
    held: Array | None
    period: float

    def respond(self, forces: Array, initial: Array | None, angles: Array | None) -> tuple[Array, Array]:
        """Return the angles, and the state at the first sample."""
        pushed = forces + self.beside
        state = initial if initial is not None or angles is None else self._begun(pushed, angles)
        assert state is not None  # noqa: S101 - for mypy
        check_inertia(self.equations.at(0, *state[:, :, np.newaxis])[0])
        angle, velocity = (one[:, :, 0].T for one in self._moving(pushed, state[:, :, np.newaxis]))
        if self.equations.terms and angle.shape[1] > 1:
            self.equations.check((angle[:, :-1], velocity[:, :-1]))
        return angle, state

    def _moving(self, forces: Array, states: Array) -> tuple[Array, Array]:
        return Moving(self.equations, self.friction, self.period, self.held).respond(forces, states)

    def _begun(self, forces: Array, angles: Array) -> Array:
        """Return the state at the first sample that explains angles best (Gauss-Newton)."""
        whole = without_gaps(angles[:, :_BEGINNING])
        if not np.isfinite(whole).all():
            raise ValueError("the angle of every mass must be there to tell its state; got none of one; give initial=")
        state, samples = _guessed(whole, self.period), whole.shape[1]
        spread = np.stack([np.std(whole, axis=1), np.std(np.gradient(whole, self.period, axis=1), axis=1)]).ravel()
        spread = np.where(spread > 0, spread, 1.0)
        # What is known well of a short beginning is near enough to begin with in a longer one.
        lengths = [samples >> halvings for halvings in range(_HALVINGS, -1, -1) if samples >> halvings >= _SHORTEST]
        for length in lengths or [samples]:
            state = self._nearer(state, forces[:, :length], angles[:, :length], spread)
        return state

    def _nearer(self, state: Array, forces: Array, angles: Array, spread: Array) -> Array:
        """Return a state that explains angles better."""
        count, there = len(angles), np.isfinite(angles.T)
        moves = np.concatenate([np.zeros((2 * count, 1)), np.diag(_MOVED * spread)], axis=1)
        misfit = np.inf
        best, change = state, np.zeros(2 * count)
        for _ in range(_ROUNDS):
            states = (state.ravel()[:, np.newaxis] + moves).reshape(2, count, -1)
            found, _ = self._moving(forces, states)
            left = (angles.T - found[:, :, 0])[there]
            if not float(left @ left) < misfit:
                # Too far: half as far from the best.
                change = change / 2
            else:
                misfit, best = float(left @ left), state
                slopes = (found[:, :, 1:] - found[:, :, :1])[there] / np.diagonal(moves[:, 1:])
                change = np.linalg.lstsq(slopes * spread, left, rcond=_RANK)[0] * spread
            state = best + change.reshape(2, count)
            if (np.abs(change) <= _SETTLED * spread).all():
                break
        return best


def _guessed(angles: Array, period: float) -> Array:
    """Return angles and velocities at the first sample, from parabolas through the first ones."""
    some = min(angles.shape[1], _FIRST)
    fitted = np.polynomial.polynomial.polyfit(np.arange(some) * period, angles[:, :some].T, min(2, some - 1))
    return np.stack([fitted[0], fitted[1] if some > 1 else np.zeros(len(angles))])


def _some(samples: int) -> npt.NDArray[np.intp]:
    """Return some samples, at which terms are looked at."""
    return np.unique(np.linspace(0, samples - 1, min(samples, 64)).astype(np.intp))
