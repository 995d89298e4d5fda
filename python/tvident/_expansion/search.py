"""Finds how many functions an expansion needs, and their factors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.basis import Basis, Coordinate
from tvident._expansion.families import Family
from tvident._expansion.fit import Curves, Fitted, Linearised
from tvident._expansion.rivals import Rival, scatter
from tvident._expansion.rows import Record, Unknown

Array: TypeAlias = npt.NDArray[np.float64]

_FIRST_SIZE = 4
"""Other expansions have about so many functions while sizes of the first are tried."""

_BEYOND, _BEYOND_BY = 2, 8
"""Sizes are tried up to so many times the best one, and so many more."""

SLACK = 4.0
"""The smallest size is taken whose criterion is at most so much above the lowest: the lowest of some twenty is lower than that of the
best by about as much by chance."""

_NEGLIGIBLE = 1e-3
"""Sizes of a smaller weight say nothing of how much a curve depends on its size."""

_ROUNDS = 2
"""Of choosing sizes and linearising around what was found."""

_STEPS = 8
_SETTLED = 1e-7
"""The last steps end once the misfit changes by less than this part of itself."""

_SAMPLES = 1 << 14
"""Samples at which functions are in memory at a time."""

DERIVATIVES = {"inertia": 2, "momentum": 1, "damping": 1}
"""How many derivatives of a coefficient its rows need."""


@dataclass(frozen=True)
class Part:
    """An unknown of the equation before it has a size.

    Parameters
    ----------
    name, role : str
    coordinates : sequence of Coordinate
        None for a constant.
    families : sequence of Family
    sizes : sequence of int or None
        None where the record chooses.
    largest : int
    samples : ndarray, shape (n,), optional
        Of a term.
    """

    name: str
    role: str
    coordinates: Sequence[Coordinate] = ()
    families: Sequence[Family] = ()
    sizes: Sequence[int | None] = ()
    largest: int = 1
    samples: Array | None = None

    def of(self, sizes: Sequence[int]) -> Unknown:
        """Return it with sizes."""
        basis = Basis(self.coordinates, self.families, sizes) if self.coordinates else None
        return Unknown(self.name, self.role, basis, self.samples)


@dataclass(frozen=True)
class Tried:
    """What a size gave.

    Attributes
    ----------
    sizes : mapping of str to tuple of int
        Of every expansion.
    criterion : float
    residual : float
        The sum of squares of whitened residuals over the number of independent equations: 1 where noise explains them.
    parameters : int
    """

    sizes: Mapping[str, tuple[int, ...]]
    criterion: float
    residual: float
    parameters: int


@dataclass
class Search:
    """The search for sizes and factors in one record.

    Parameters
    ----------
    record : Record
    parts : sequence of Part
    noise : (float, float)
        Variances of angle and torque.
    known : Curves
        Coefficients that are known.
    """

    record: Record
    parts: Sequence[Part]
    noise: tuple[float, float]
    known: Curves
    tried: dict[tuple[int, ...], Tried] = field(default_factory=dict)
    rivals: dict[str, list[Rival]] = field(default_factory=dict)
    _solutions: dict[tuple[int, ...], tuple[list[Unknown], Fitted]] = field(default_factory=dict)

    def run(self, curves: Curves, terms: Array) -> tuple[list[Unknown], Fitted, Linearised]:
        """Return the unknowns with their sizes, their factors, and the rows around them.

        Parameters
        ----------
        curves : Curves
            Coefficients, about, the known ones among them.
        terms : ndarray, shape (n,)
            Torque of the further terms, about.
        """
        places = [(part, place) for part, one in enumerate(self.parts) for place in range(len(one.sizes))]
        free = [(part, place) for part, place in places if self.parts[part].sizes[place] is None]
        sizes = [
            [one or self._near(self.parts[part], place) for place, one in enumerate(self.parts[part].sizes)]
            for part in range(len(self.parts))
        ]
        around = Linearised(self.record, curves, terms, self.noise, self.known)
        fitted = self._solved(around, sizes)
        before: list[list[int]] = []
        for _ in range(_ROUNDS):
            self.tried.clear()
            self._solutions.clear()
            sizes, fitted = self._chosen(around, sizes, fitted, free)
            around = self._around(sizes, fitted)
            if not free or sizes == before:
                break
            before = [list(one) for one in sizes]
        self.rivals = self._rivals(sizes)
        for _ in range(_STEPS):
            last, fitted = fitted, self._solved(around, sizes)
            if not abs(fitted.misfit - last.misfit) > _SETTLED * last.misfit:
                break
            around = self._around(sizes, fitted)
        return self._unknowns(sizes), fitted, around

    def _chosen(
        self, around: Linearised, sizes: list[list[int]], fitted: Fitted, free: Sequence[tuple[int, int]]
    ) -> tuple[list[list[int]], Fitted]:
        """Return the sizes of the lowest criterion: one after the other, as long as that lowers it."""
        fitted = self._solved(around, sizes)
        for _ in range(1 if len(free) <= 1 else _ROUNDS):
            start = [list(one) for one in sizes]
            for part, place in free:
                sizes, fitted = self._one_size(around, sizes, fitted, (part, place))
            if sizes == start:
                break
        return sizes, fitted

    def _one_size(
        self, around: Linearised, sizes: list[list[int]], fitted: Fitted, free: tuple[int, int]
    ) -> tuple[list[list[int]], Fitted]:
        """Return the sizes with one of them chosen, beside the others."""
        part, place = free
        found: list[tuple[list[list[int]], Fitted]] = []
        best, last = np.inf, 0
        for size in self._sizes(part, place):
            if size > _BEYOND * last + _BEYOND_BY and np.isfinite(best):
                break
            trial = [list(one) for one in sizes]
            trial[part][place] = size
            if math.prod(trial[part]) > self.parts[part].largest:
                break
            found.append((trial, self._solved(around, trial)))
            if found[-1][1].criterion < best:
                best, last = found[-1][1].criterion, size
        if not np.isfinite(best):
            return sizes, fitted
        return next(one for one in found if one[1].criterion <= best + SLACK)

    def _sizes(self, part: int, place: int) -> Iterator[int]:
        one = self.parts[part]
        for size in one.families[place].sizes():
            if size > one.largest:
                return
            yield size

    @staticmethod
    def _near(part: Part, place: int) -> int:
        """Return a size to begin with."""
        found = 1
        for size in part.families[place].sizes():
            if found != 1 and size > min(_FIRST_SIZE, part.largest):
                break
            found = size
            if size >= _FIRST_SIZE:
                break
        return found

    def _unknowns(self, sizes: Sequence[Sequence[int]]) -> list[Unknown]:
        return [part.of(tuple(one)) for part, one in zip(self.parts, sizes, strict=True)]

    def _solved(self, around: Linearised, sizes: Sequence[Sequence[int]]) -> Fitted:
        unknowns = self._unknowns(sizes)
        fitted = around.solve(unknowns)
        expanded = {one.name: tuple(size) for one, size in zip(self.parts, sizes, strict=True) if size}
        count = sum(one.size for one in unknowns)
        residual = fitted.misfit / fitted.observations if fitted.observations else float("nan")
        self._solutions[_key(sizes)] = unknowns, fitted
        self.tried[_key(sizes)] = Tried(expanded, fitted.criterion, residual, count)
        return fitted

    def _rivals(self, sizes: Sequence[Sequence[int]]) -> dict[str, list[Rival]]:
        """Return the curves of all sizes that explain the record nearly as well, the one that was taken first, by name."""
        taken = self._solutions[_key(sizes)]
        least = min(fitted.criterion for _, fitted in self._solutions.values())
        if not np.isfinite(least):
            return {}
        weights = {key: math.exp((least - fitted.criterion) / 2) for key, (_, fitted) in self._solutions.items()}
        whole = sum(weights.values())
        others = [
            (weights[key] / whole, *solution)
            for key, solution in self._solutions.items()
            if key != _key(sizes) and weights[key] > _NEGLIGIBLE * whole
        ]
        found: dict[str, list[Rival]] = {}
        for weight, unknowns, fitted in [(1.0, *taken), *others]:
            first = 0
            for one in unknowns:
                place = slice(first, first + one.size)
                first += one.size
                if one.basis is not None:
                    rival = Rival(weight, one.basis, fitted.values[place], fitted.covariance[place, place])
                    found.setdefault(one.name, []).append(rival)
        return found

    def _around(self, sizes: Sequence[Sequence[int]], fitted: Fitted) -> Linearised:
        curves, terms = curves_of(self._unknowns(sizes), fitted.values, self.record.angle.size)
        return Linearised(self.record, [*curves, *self.known], terms, self.noise, self.known)


def _key(sizes: Sequence[Sequence[int]]) -> tuple[int, ...]:
    return tuple(size for one in sizes for size in one)


def curves_of(unknowns: Sequence[Unknown], values: Array, samples: int) -> tuple[Curves, Array]:
    """Return coefficients with their derivatives, and the torque of further terms, at every sample."""
    curves: Curves = []
    terms, first = np.zeros(samples), 0
    for one in unknowns:
        own = values[first : first + one.size]
        first += one.size
        along = [
            np.full(samples, own[0] if rate == 0 else 0.0) if one.basis is None else along_record(one.basis, own, rate)
            for rate in range(DERIVATIVES.get(one.role, 0) + 1)
        ]
        if one.role == "term":
            if one.samples is not None:
                terms += along[0] * one.samples
        else:
            curves.append((one.role, along))
    return curves, terms


def along_record(basis: Basis, factors: Array, rate: int = 0) -> Array:
    """Return a curve, or its derivative by time, at every sample of a record."""
    samples = basis.coordinates[0].places.size
    found = np.empty(samples)
    for first in range(0, samples, _SAMPLES):
        some = slice(first, min(samples, first + _SAMPLES))
        found[some] = basis.along(some, rate) @ factors
    return found


def errors_along(basis: Basis, covariance: Array, rivals: Sequence[Rival] = ()) -> Array:
    """Return the standard errors of a curve at every sample of a record, with what the choice of its size adds."""
    samples = basis.coordinates[0].places.size
    found = np.empty(samples)
    for first in range(0, samples, _SAMPLES):
        some = slice(first, min(samples, first + _SAMPLES))
        functions = basis.along(some, 0)
        variance = np.einsum("ij,jk,ik->i", functions, covariance, functions)
        found[some] = np.sqrt(np.maximum(variance, 0) + scatter(rivals, _functions_at(some)))
    return found


def _functions_at(samples: slice) -> Callable[[Basis], Array]:
    return lambda basis: basis.along(samples, 0)
