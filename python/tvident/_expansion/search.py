"""Finds how many functions an expansion needs, and their factors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.basis import AT_A_TIME, Basis, Coordinate
from tvident._expansion.families import Family
from tvident._expansion.fit import Fitted, Linearised, ScoredSize
from tvident._expansion.rivals import Rival, Rivals, weights_of
from tvident._expansion.rows import Curves, ExpandedRecord, ExpandedUnknown, Places, curve_length, placed
from tvident._expansion.steps import variance_of_steps
from tvident._expansion.unseen import Bend, Unseen
from tvident._expansion.whitened_rows import Noise

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

_ROUNDS_OF_CORRELATED, _CORRELATED = 5, 1.2
"""The same where what is left is correlated by so much: functions that follow it hide some of it at first."""

_STEPS = 8
_SETTLED = 1e-7
"""The last steps end once the misfit changes by less than this part of itself."""

DERIVATIVES = {"inertia": 2, "momentum": 1, "damping": 1}
"""How many derivatives of a coefficient its rows need."""


@dataclass(frozen=True)
class RecordPart:
    """An unknown of the equation before it has a size.

    Parameters
    ----------
    name : str
    entries : Places
        Where it appears.
    coordinates : sequence of Coordinate
        None for a constant.
    families : sequence of Family
    sizes : sequence of int or None
        None where the record chooses.
    largest : int
    is_of_time : bool
    """

    name: str
    entries: Places
    coordinates: Sequence[Coordinate] = ()
    families: Sequence[Family] = ()
    sizes: Sequence[int | None] = ()
    largest: int = 1
    is_of_time: bool = False

    def of(self, sizes: Sequence[int]) -> ExpandedUnknown:
        """Return it with sizes."""
        basis = Basis(self.coordinates, self.families, sizes) if self.coordinates else None
        return ExpandedUnknown(self.name, self.entries, basis)


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
    weight : float
        How much it counts among all.
    """

    sizes: Mapping[str, tuple[int, ...]]
    criterion: float
    residual: float
    parameters: int
    weight: float = 0.0


@dataclass
class SizeSearch:
    """The search for sizes and factors in one record, or in several that share them.

    Parameters
    ----------
    records : sequence of ExpandedRecord
    parts : sequence of RecordPart
    noise : Noise
        Variances of every angle and of every torque.
    known : Curves
        Coefficients that are known.

    Attributes
    ----------
    tried : dict of tuple of int to Tried
        By the sizes of all unknowns.
    rivals : dict of str to Rivals
        By the name of an expansion.
    as_one : float
        How many equations count as one.
    """

    records: Sequence[ExpandedRecord]
    parts: Sequence[RecordPart]
    noise: Noise
    known: Curves
    tried: dict[tuple[int, ...], Tried] = field(default_factory=dict)
    rivals: dict[str, Rivals] = field(default_factory=dict)
    as_one: float = 1.0
    _scores: dict[tuple[int, ...], tuple[list[ExpandedUnknown], ScoredSize]] = field(default_factory=dict)
    _bends: dict[str, Bend] = field(default_factory=dict)

    def run(self, curves: Curves) -> tuple[list[ExpandedUnknown], Fitted, Linearised]:
        """Return the unknowns with their sizes, their factors, and the rows around them.

        Parameters
        ----------
        curves : Curves
            All coefficients, about, the known ones among them.
        """
        places = [(part, place) for part, one in enumerate(self.parts) for place in range(len(one.sizes))]
        free = [(part, place) for part, place in places if self.parts[part].sizes[place] is None]
        sizes = [
            [one or self._near(self.parts[part], place) for place, one in enumerate(self.parts[part].sizes)]
            for part in range(len(self.parts))
        ]
        around = Linearised(self.records, curves, self.noise, self.known)
        fitted = self._solved(around, sizes)
        before: list[list[int]] = []
        for turn in range(_ROUNDS_OF_CORRELATED):
            self.tried.clear()
            self._scores.clear()
            sizes = self._chosen(around, sizes, free)
            compared, fitted = around, self._solved(around, sizes)
            self._look_at(sizes, fitted)
            around = self._around(sizes, fitted)
            if not free or sizes == before or (turn + 1 >= _ROUNDS and self.as_one < _CORRELATED):
                break
            before = [list(one) for one in sizes]
            self.as_one = max(self.as_one, compared.correlation(self._unknowns(sizes), fitted)[0])
        self.rivals = self._rivals(compared, sizes)
        for _ in range(_STEPS):
            last, fitted = fitted, self._solved(around, sizes)
            if not abs(fitted.misfit - last.misfit) > _SETTLED * last.misfit:
                break
            around = self._around(sizes, fitted)
        return self._unknowns(sizes), fitted, around

    def _chosen(self, around: Linearised, sizes: list[list[int]], free: Sequence[tuple[int, int]]) -> list[list[int]]:
        """Return the sizes of the lowest criterion: one after the other, as long as that lowers it."""
        self._score(around, sizes)
        for _ in range(1 if len(free) <= 1 else _ROUNDS):
            start = [list(one) for one in sizes]
            for part, place in free:
                sizes = self._one_size(around, sizes, (part, place))
            if sizes == start:
                break
        return sizes

    def _one_size(self, around: Linearised, sizes: list[list[int]], free: tuple[int, int]) -> list[list[int]]:
        """Return the sizes with one of them chosen, beside the others."""
        part, place = free
        found: list[tuple[list[list[int]], float]] = []
        best, last = np.inf, 0
        for size in self._sizes(part, place):
            if size > _BEYOND * last + _BEYOND_BY and np.isfinite(best):
                break
            trial = [list(one) for one in sizes]
            trial[part][place] = size
            if math.prod(trial[part]) > self.parts[part].largest:
                break
            found.append((trial, self._score(around, trial).criterion))
            if found[-1][1] < best:
                best, last = found[-1][1], size
        if not np.isfinite(best):
            return sizes
        return next(one for one, criterion in found if criterion <= best + SLACK)

    def _sizes(self, part: int, place: int) -> Iterator[int]:
        one = self.parts[part]
        for size in one.families[place].sizes():
            if size > one.largest:
                return
            yield size

    @staticmethod
    def _near(part: RecordPart, place: int) -> int:
        """Return a size to begin with."""
        found = 1
        for size in part.families[place].sizes():
            if found != 1 and size > min(_FIRST_SIZE, part.largest):
                break
            found = size
            if size >= _FIRST_SIZE:
                break
        return found

    def _unknowns(self, sizes: Sequence[Sequence[int]]) -> list[ExpandedUnknown]:
        return [part.of(tuple(one)) for part, one in zip(self.parts, sizes, strict=True)]

    def _solved(self, around: Linearised, sizes: Sequence[Sequence[int]]) -> Fitted:
        unknowns = self._unknowns(sizes)
        fitted = around.solve(unknowns, self._unseen_of(unknowns))
        self._keep(sizes, unknowns, replace(fitted.scored, as_one=self.as_one))
        return fitted

    def _score(self, around: Linearised, sizes: Sequence[Sequence[int]]) -> ScoredSize:
        unknowns = self._unknowns(sizes)
        found = replace(around.score(unknowns, self._unseen_of(unknowns)), as_one=self.as_one)
        self._keep(sizes, unknowns, found)
        return found

    def _keep(self, sizes: Sequence[Sequence[int]], unknowns: list[ExpandedUnknown], scored: ScoredSize) -> None:
        """Keep what sizes gave."""
        expanded = {one.name: tuple(size) for one, size in zip(self.parts, sizes, strict=True) if size}
        residual = scored.misfit / scored.observations if scored.observations else float("nan")
        key = _key(sizes)
        weight = self.tried[key].weight if key in self.tried else 0.0
        self._scores[key] = unknowns, scored
        self.tried[key] = Tried(expanded, scored.criterion, residual, scored.size, weight)

    def _rivals(self, around: Linearised, sizes: Sequence[Sequence[int]]) -> dict[str, Rivals]:
        """Return the curves of all sizes that explain the record nearly as well, the one that was taken first, by name."""
        weights = weights_of({key: scored for key, (_, scored) in self._scores.items()})
        count = [key for key, weight in weights.items() if weight > _NEGLIGIBLE]
        whole = sum(weights[key] for key in count)
        self.tried = {
            key: replace(one, weight=weights[key] / whole if key in count else 0.0) for key, one in self.tried.items()
        }
        if not count:
            return {}
        taken, found = _key(sizes), dict[str, list[Rival]]()
        for key in [taken, *(key for key in count if key != taken)]:
            unknowns = self._scores[key][0]
            fitted = around.solve(unknowns, self._unseen_of(unknowns))
            for one, place in placed(unknowns):
                if one.basis is not None:
                    rival = Rival(self.tried[key].weight, one.basis, fitted.values[place], fitted.root[place])
                    found.setdefault(one.name, []).append(rival)
        of_time = {part.name for part in self.parts if part.is_of_time and None in part.sizes}
        return {name: Rivals(curves, is_averaged=name in of_time) for name, curves in found.items()}

    @cached_property
    def _unseen(self) -> Unseen:
        return Unseen(self.records)

    def _look_at(self, sizes: Sequence[Sequence[int]], fitted: Fitted) -> None:
        """Note how curves of time bend where they are seen."""
        for part, (one, place) in zip(self.parts, placed(self._unknowns(sizes)), strict=True):
            if part.is_of_time and one.basis is not None and one.basis.families[0].block is None:
                bend = self._unseen.bend(along_record(one.basis, fitted.values[place]))
                if bend is not None:
                    self._bends[part.name] = bend

    def _unseen_of(self, unknowns: Sequence[ExpandedUnknown]) -> Array | None:
        """Return equations of what is not seen of curves of time, the right-hand side last; None where nothing is known of them."""
        if not self._bends or not self._unseen.places.size:
            return None
        found, size = [], sum(one.size for one in unknowns)
        for one, place in placed(unknowns):
            if one.name in self._bends and one.basis is not None:
                rows = np.zeros((self._unseen.places.size, size + 1))
                rows[:, place] = self._unseen.rows(one.basis, self._bends[one.name])
                found.append(rows)
        return np.concatenate(found)

    def _around(self, sizes: Sequence[Sequence[int]], fitted: Fitted) -> Linearised:
        curves = curves_of(self._unknowns(sizes), fitted.values, curve_length(self.records))
        return Linearised(self.records, [*curves, *self.known], self.noise, self.known)


def _key(sizes: Sequence[Sequence[int]]) -> tuple[int, ...]:
    return tuple(size for one in sizes for size in one)


def curves_of(unknowns: Sequence[ExpandedUnknown], values: Array, samples: int) -> list[tuple[Places, list[Array]]]:
    """Return coefficients with their derivatives at every sample."""
    curves = []
    for one, place in placed(unknowns):
        own = values[place]
        along = [
            np.full(samples, own[0] if rate == 0 else 0.0) if one.basis is None else along_record(one.basis, own, rate)
            for rate in range(rates_of(one.entries) + 1)
        ]
        curves.append((one.entries, along))
    return curves


def rates_of(entries: Places) -> int:
    """Return how many derivatives of a coefficient its rows need."""
    return max((DERIVATIVES.get(role, 0) for _, role, _, _ in entries), default=0)


def along_record(basis: Basis, factors: Array, rate: int = 0) -> Array:
    """Return a curve, or its derivative by time, at every sample of a record."""
    samples = basis.coordinates[0].places.size
    found = np.empty(samples)
    for first in range(0, samples, AT_A_TIME):
        some = slice(first, min(samples, first + AT_A_TIME))
        found[some] = basis.along(some, rate) @ factors
    return found


def curve_along(basis: Basis, factors: Array, root: Array, rivals: Rivals) -> tuple[Array, Array]:
    """Return a curve at every sample, and its standard errors: from a root of its factors' covariance, and what other sizes add."""
    samples = basis.coordinates[0].places.size
    values, errors = np.empty(samples), np.empty(samples)
    for first in range(0, samples, AT_A_TIME):
        some = slice(first, min(samples, first + AT_A_TIME))
        functions = basis.along(some, 0)
        moved, added = rivals.beside(_functions_at(some))
        added = added + variance_of_steps(basis, factors, root, [one.places[some] for one in basis.coordinates])
        values[some] = functions @ factors + moved
        errors[some] = np.sqrt(((functions @ root) ** 2).sum(axis=1) + added)
    return values, errors


def _functions_at(samples: slice) -> Callable[[Basis], Array]:
    return lambda basis: basis.along(samples, 0)
