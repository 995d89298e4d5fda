"""Samples of terms as the core takes them: names of built-in terms, arrays of all others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._equation import BUILT_IN, FRICTION, FixedTerm, InnerParameter, Term, Unknown, expected_stribeck

Array: TypeAlias = npt.NDArray[np.float64]

_FASTEST = 0.99
"""The Stribeck velocity is at most the velocity that so many samples stay below."""

_SLOWEST = 0.01
"""And at least this part of it; slower friction fades within what a turn takes."""

_WITHIN_NOISE = 2.0
"""Nor is it below so many standard errors of the velocity."""

_SPECK = 1e-30
"""Values of a term smaller than this part of its largest are none."""

WINDOW_OF_TERMS = 51
"""Samples of the polynomials that terms of one's own get angle and velocity from in weak form."""

_STEP = 1 / 64
"""By how much of its range an inner parameter is moved to see what a term does with it."""


@dataclass(frozen=True)
class Range:
    """Where an inner parameter is searched, of every record.

    Parameters
    ----------
    low, high : ndarray, shape (records,)
    logarithmic : bool
        Whether steps are ratios.
    """

    low: Array
    high: Array
    logarithmic: bool = False

    def at(self, place: Array) -> Array:
        """Return values at places from 0, the low end, to 1."""
        if self.logarithmic:
            return np.asarray(self.low * (self.high / self.low) ** place)
        return np.asarray(self.low + (self.high - self.low) * place)

    def of(self, record: int) -> tuple[float, float]:
        """Return the range of one record."""
        return float(self.low[record]), float(self.high[record])

    def unit(self, value: Array) -> Array:
        """Return by how much a value grows with its place."""
        if self.logarithmic:
            return np.asarray(value * np.log(self.high / self.low))
        return np.asarray(self.high - self.low)

    @property
    def unknown_error(self) -> Array:
        """The standard deviation of a value that may be anything in the range."""
        return np.asarray((self.high - self.low) / np.sqrt(12))

    def place(self, value: Array) -> Array:
        """Return the places of values."""
        if self.logarithmic:
            return np.asarray(np.log(value / self.low) / np.log(self.high / self.low))
        return np.asarray((value - self.low) / (self.high - self.low))


def secant(limits: Range, value: Array) -> tuple[Array, Array]:
    """Return two values around one of an inner parameter, within its range, that show what a term does with it."""
    place = np.clip(limits.place(value), 0, 1)
    return limits.at(np.maximum(place - _STEP, 0)), limits.at(np.minimum(place + _STEP, 1))


@dataclass(frozen=True)
class Columns:
    r"""The terms of an equation, evaluated on records.

    Parameters
    ----------
    terms : sequence of Unknown
    angles : ndarray, shape (\*, n)
    time : ndarray, shape (n,)
    period : float
    plan : callable
        Makes the polynomials that tell angle and velocity to terms of the user's own.
    weak : bool
        In weak form friction knows rest, and the velocity's error.
    workers : int, optional
    """

    terms: Sequence[Unknown]
    angles: npt.NDArray[np.number]
    time: Array
    period: float
    plan: Callable[[], _core.LocalPolynomials]
    weak: bool
    workers: int | None = None
    _kept: dict[str, Array] = field(default_factory=dict, repr=False)

    @cached_property
    def _smoothed(self) -> tuple[Array, Array]:
        """Angle and velocity, of the angle's shape."""
        angle, velocity, _ = self.plan().estimate(self.angles, workers=self.workers).derivatives
        return angle, velocity

    @cached_property
    def _sliding(self) -> tuple[Array, Array]:
        """Velocity and its errors as friction needs them, shape (records, n)."""
        if self.weak:
            velocity, errors = _core.sliding_velocity(self.angles, self.period, workers=self.workers)
            return velocity, errors
        velocity = self._smoothed[1].reshape(-1, self.time.size)
        return velocity, np.zeros_like(velocity)

    @cached_property
    def _direction(self) -> Array:
        """The expected sign of the velocity, as the core has it for dry friction."""
        velocities, errors = self._sliding
        rows = [expected_stribeck(*one, np.inf) for one in zip(velocities, errors, strict=True)]
        return np.stack(rows).reshape(self.angles.shape)

    def range_of(self, one: InnerParameter) -> Range:
        """Return where an inner parameter is to be searched in every record."""
        records = int(np.prod(self.angles.shape[:-1], dtype=int))
        if one.limits is not None:
            low, high = one.limits
            return Range(np.full(records, low), np.full(records, high))
        velocity, errors = self._sliding
        fastest, noise = np.ones(records), np.zeros(records)
        for record in range(records):
            speed = np.abs(velocity[record][np.isfinite(velocity[record])])
            if speed.size and speed.max() > 0:
                fastest[record] = np.quantile(speed, _FASTEST)
                noise[record] = np.nanmedian(errors[record])
        slowest = np.clip(_WITHIN_NOISE * noise, _SLOWEST * fastest, 0.5 * fastest)
        return Range(slowest, fastest, logarithmic=True)

    def samples_of_fading(self, scales: Array) -> Array:
        """Return for how many samples the velocity of a turn is below the Stribeck velocity, at the record's typical acceleration."""
        changes = np.diff(self._sliding[0], axis=-1)
        there = np.isfinite(changes)
        with np.errstate(all="ignore"):
            typical = np.sqrt(np.sum(np.where(there, changes, 0.0) ** 2, axis=-1) / there.sum(axis=-1))
            return np.asarray(2 * scales / typical)

    def samples(self, inner: Mapping[str, Array], *, repeated: bool = False) -> list[npt.NDArray[np.number] | str]:
        """Return every term as the core takes it, with the inner parameters of every record.

        Where the same is `repeated` with others, dry friction takes the velocity that is known already: it costs the core most.
        """
        columns = [self._term(term, inner) for term in self.terms]
        if repeated and self.weak and any(term.inner and term.own is None for term in self.terms):
            columns = [self._direction if isinstance(one, str) and one == FRICTION else one for one in columns]
        return columns

    def all_samples(self, inner: Mapping[str, Array]) -> dict[str, Array]:
        """Return the samples of every term by name, those of built-in terms too, with the inner parameters of every record."""
        found: dict[str, Array] = {}
        for term in self.terms:
            given = self._term(term, inner)
            if not isinstance(given, str):
                found[term.name] = np.asarray(given, np.float64)
            elif given == FRICTION:
                found[given] = self._direction
            else:
                built_in, angles = BUILT_IN[given], np.asarray(self.angles, np.float64)
                velocity = self._sliding[0].reshape(angles.shape) if built_in.needs_velocity else None
                found[given] = built_in.function(np, angles, velocity)
        return found

    def slope(self, one: InnerParameter, ends: tuple[Array, Array], inner: Mapping[str, Array]) -> Array:
        """Return by how much a term changes with an inner parameter between two values of it, shape (records, n)."""
        term = next(term for term in self.terms if one in term.inner)
        low, high = (self._searched(term, {**inner, one.full_name: end}) for end in ends)
        return np.asarray((high - low) / (ends[1] - ends[0])[:, np.newaxis])

    def _term(self, term: Unknown, inner: Mapping[str, Array]) -> npt.NDArray[np.number] | str:
        if term.inner:
            return self._searched(term, inner).reshape(self.angles.shape)
        if term.own is None:
            return term.name
        if term.name not in self._kept:
            angle, velocity = self._smoothed
            self._kept[term.name] = _without_specks(term.own.values(self.time, angle, velocity).astype(np.float64))
        return self._kept[term.name]

    def _searched(self, term: Unknown, inner: Mapping[str, Array]) -> Array:
        """Return a term with inner parameters, shape (records, n)."""
        if term.own is None:
            velocities, errors = self._sliding
            scales = inner[term.inner[0].full_name]
            rows = [expected_stribeck(*one) for one in zip(velocities, errors, scales, strict=True)]
            return _without_specks(np.stack(rows)) if rows else velocities
        found = np.asarray(fixed(term.own, term, inner).values(self.time, *self._smoothed), dtype=np.float64)
        return _without_specks(found.reshape(-1, self.time.size))


def _without_specks(values: Array) -> Array:
    """Return values with zeros for those next to nothing beside the others: their squares have no doubles, and they tell nothing."""
    size = np.abs(values)
    values[size < _SPECK * np.max(size, where=np.isfinite(size), initial=0.0)] = 0.0
    return values


def fixed(own: Term, term: Unknown, inner: Mapping[str, Array]) -> FixedTerm:
    """Return a term of the user's own with its inner parameters."""
    return FixedTerm(own, {one.name: inner[one.full_name] for one in term.inner})
