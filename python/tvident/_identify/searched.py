"""The search for inner parameters of terms: which values explain the torque best, and whether the term is needed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._advice import FoundBySearch
from tvident._equation import InnerParameter
from tvident._identify.columns import Range
from tvident._identify.minimum import lowest
from tvident._results import Estimates

Array: TypeAlias = npt.NDArray[np.float64]
Inner: TypeAlias = Mapping[str, Array]

_ROUNDS = 16
"""Of Newton's method at most, after golden sections: enough to cross the range, where one inner parameter makes up for another."""

_SETTLED = 0.05
"""Of its standard error, by which the last round may still move an inner parameter."""

_LARGEST_MOVE = 1 / 16
"""Of the range, in one round."""

_END = 1e-3
"""So near to an end of its range, as a part of it, a value is the end."""

BY_CHANCE = 0.01
"""A term whose significance noise exceeds as often, anywhere in the range, is not needed."""

_BUDGET = 40
"""Identifications that a search takes, about: only for showing progress."""


class Searchable(Protocol):
    """What is searched: a task whose terms have inner parameters."""

    @property
    def inner(self) -> Sequence[InnerParameter]:
        """Inner parameters, in the order of their terms."""

    @property
    def ranges(self) -> Mapping[str, Range]:
        """Where they are searched."""

    def found(
        self, inner: Inner, *, slopes: bool = ..., factors: Mapping[str, Sequence[Array]] | None = ...
    ) -> Sequence[_core.Identification]:
        """Identify with given inner parameters, as unknowns too where slopes are wanted."""

    def place_of(self, name: str) -> int:
        """Return the place of an unknown among those that were found."""

    def frozen(self, found: Sequence[_core.Identification], inner: Inner) -> Searchable:
        """Return the same task with what was chosen."""

    def without(self, term: str) -> Searchable | None:
        """Return the same task without a term; None where nothing would be left."""

    def criterion(self, found: Sequence[_core.Identification], more: int) -> Array:
        """Return the criterion of every record, with so many parameters more than the core knows of."""


@dataclass(frozen=True)
class Searched:
    """What a search found.

    Parameters
    ----------
    values : mapping of str to ndarray, shape (records,)
        Inner parameters.
    at_end : mapping of str to ndarray of bool, shape (records,)
        Whether they are an end of their range.
    gain : mapping of str to ndarray, shape (records,)
        By how much each term lowers the criterion, its inner parameters paid for.
    chance : mapping of str to ndarray, shape (records,)
        How likely noise makes a term as significant as it is at any value that was tried; NaN where its factor changes.
    needed : mapping of str to ndarray of bool, shape (records,)
        Whether a term is needed.
    tried : int
        Identifications; 0 where an earlier result tells the values.
    """

    values: Mapping[str, Array]
    at_end: Mapping[str, npt.NDArray[np.bool_]] = field(default_factory=dict)
    gain: Mapping[str, Array] = field(default_factory=dict)
    chance: Mapping[str, Array] = field(default_factory=dict)
    needed: Mapping[str, npt.NDArray[np.bool_]] = field(default_factory=dict)
    tried: int = 0

    def of(self, one: InnerParameter, record: int) -> dict[str, Any]:
        """Return what is said of an inner parameter of a record."""
        if not self.tried:
            return {"tried": 0, "needed": bool(self.needed[one.term][record])}
        return {
            "at_end": bool(self.at_end[one.full_name][record]),
            "gain": float(self.gain[one.term][record]),
            "chance": float(self.chance[one.term][record]),
            "needed": bool(self.needed[one.term][record]),
            "tried": self.tried,
        }

    def told(
        self,
        inner: Sequence[InnerParameter],
        ranges: Mapping[str, Range],
        batch: Estimates,
        lasting: Callable[[Array], Array],
    ) -> list[list[FoundBySearch]]:
        """Return what was found of the inner parameters of every record.

        Parameters
        ----------
        inner : sequence of InnerParameter
        ranges : mapping of str to Range
            Where they were searched.
        batch : Estimates
        lasting : callable
            Gives for how many samples the friction of every record fades, by its Stribeck velocity.
        """
        records = int(np.size(batch.record_status))
        factors = {one.term: batch.values[one.term].reshape(records, -1) for one in inner}

        def middle(values: Array) -> float:
            there = values[np.isfinite(values)]
            return float(np.median(there)) if there.size else float("nan")

        return [
            [
                FoundBySearch(
                    one,
                    value=float(self.values[one.full_name][record]),
                    error=float(np.ravel(batch.constants[one.full_name][1])[record]),
                    limits=ranges[one.full_name].of(record),
                    factor=middle(factors[one.term][record]),
                    lasts=float(lasting(self.values[one.full_name])[record]) if one.limits is None else np.inf,
                    **self.of(one, record),
                )
                for one in inner
            ]
            for record in range(records)
        ]


class _Search:
    """One search."""

    def __init__(self, task: Searchable, report: Callable[[int, int], object] | None) -> None:
        self._task, self._report = task, report
        self._tried = 0
        # Factor over standard error of each term, by place of each of its inner parameters.
        self._profiles: dict[str, list[tuple[Array, Array]]] = {}

    def run(self) -> Searched:
        task = self._task
        ranges = task.ranges
        records = next(iter(ranges.values())).low.size
        values: Inner = {name: one.at(np.full(records, 0.5)) for name, one in ranges.items()}
        frozen = task.frozen(self._found(task, values), values)
        # One after another, and again where each was found beside wrong values of the others.
        for _ in range(1 if len(task.inner) == 1 else 2):
            for one in task.inner:
                values = self._one(frozen, one, values)
            found = self._found(task, values)
            frozen = task.frozen(found, values)
        values = self._refined(frozen, values, found)
        gain, chance = self._judged(frozen, values)
        places = {name: ranges[name].place(value) for name, value in values.items()}
        at_end = {name: (place < _END) | (place > 1 - _END) for name, place in places.items()}
        with np.errstate(invalid="ignore"):
            needed = {term: (gain[term] > 0) & ~(chance[term] > BY_CHANCE) for term in gain}
        return Searched(values, at_end, gain, chance, needed, self._tried)

    def _found(
        self,
        task: Searchable,
        values: Inner,
        *,
        slopes: bool = False,
        factors: Mapping[str, Sequence[Array]] | None = None,
    ) -> Sequence[_core.Identification]:
        if self._report is not None:
            self._report(min(self._tried, _BUDGET - 1), _BUDGET)
        self._tried += 1
        return task.found(values, slopes=slopes, factors=factors)

    def _one(self, frozen: Searchable, one: InnerParameter, values: Inner) -> dict[str, Array]:
        """Return values with one inner parameter where the criterion is lowest."""
        limits, at = frozen.ranges[one.full_name], frozen.place_of(one.term)
        profile: list[tuple[Array, Array]] = []

        def criterion(place: Array) -> Array:
            found = self._found(frozen, {**values, one.full_name: limits.at(place)})
            profile.append((place, significance(found, at)))
            return frozen.criterion(found, 0)

        best = lowest(criterion, limits.low.size)
        self._profiles[one.full_name] = profile
        return {**values, one.full_name: limits.at(best.place)}

    def _refined(self, frozen: Searchable, values: Inner, found: Sequence[_core.Identification]) -> Inner:
        """Return values where the terms' slopes explain nothing more, as the estimator weights equations (Gauss and Newton)."""
        ranges, best = frozen.ranges, dict(values)
        least, done = np.full(len(found), np.inf), np.zeros(len(found), bool)
        for _ in range(_ROUNDS):
            factors = {one.term: factor_of(found, frozen.place_of(one.term)) for one in frozen.inner}
            found = self._found(frozen, values, slopes=True, factors=factors)
            if len(found[0].unknowns) <= frozen.place_of(frozen.inner[0].full_name):
                # Moving it does nothing to the torque.
                return best
            moved, left = dict(values), np.zeros(len(found))
            for one in frozen.inner:
                value, limits = values[one.full_name], ranges[one.full_name]
                move, error = (np.nan_to_num(part) for part in move_of(found, frozen.place_of(one.full_name)))
                place = limits.place(value)
                new = np.clip(place + np.clip(move / limits.unit(value), -_LARGEST_MOVE, _LARGEST_MOVE), 0, 1)
                at_end = (new == place) & ((place <= 0) | (place >= 1))
                with np.errstate(all="ignore"):
                    share = np.where((error > 0) & ~at_end, np.abs(move) / error, 0.0)
                left = np.maximum(left, share)
                moved[one.full_name] = limits.at(new)
            best = {name: np.where(~done & (left < least), value, best[name]) for name, value in values.items()}
            least, done = np.minimum(left, least), done | (left <= _SETTLED)
            if done.all():
                break
            # A record that is done stays what it would be alone.
            values = {name: np.where(done, values[name], value) for name, value in moved.items()}
        return best

    def _judged(self, frozen: Searchable, values: Inner) -> tuple[dict[str, Array], dict[str, Array]]:
        """Return what each term gains in the criterion, and how likely chance does the same."""
        found = self._found(frozen, values)
        gain, chance = {}, {}
        for term in dict.fromkeys(one.term for one in frozen.inner):
            own = [one for one in frozen.inner if one.term == term]
            rest = frozen.without(term)
            left = {name: value for name, value in values.items() if name not in {one.full_name for one in own}}
            gain[term] = np.full(len(found), np.inf)
            if rest is not None:
                with_term, without = frozen.criterion(found, len(own)), rest.criterion(self._found(rest, left), 0)
                with np.errstate(invalid="ignore"):
                    gain[term] = without - with_term
            peak = significance(found, frozen.place_of(term))
            variation = np.sum([_variation(self._profiles[one.full_name]) for one in own], axis=0)
            chance[term] = _chance(peak, variation)
        return gain, chance


def search(task: Searchable, report: Callable[[int, int], object] | None) -> Searched:
    """Return the inner parameters that explain the torque best."""
    return _Search(task, report).run()


def factor_of(found: Sequence[_core.Identification], place: int) -> list[Array]:
    """Return the factor of a term in every record, one number or one a sample; its median where it is not determined."""
    factors = []
    for one in found:
        values = one.unknowns[place].values
        there = values[np.isfinite(values)]
        middle = float(np.median(there)) if there.size else 0.0
        factors.append(np.where(np.isfinite(values), values, middle))
    return factors


def move_of(found: Sequence[_core.Identification], place: int) -> tuple[Array, Array]:
    """Return by how much each record's inner parameter is to be moved, with its standard error."""
    each = [one.unknowns[place] for one in found]
    first = [(one.values[0], one.stderr[0] * one.factor) if one.values.size else (np.nan, np.nan) for one in each]
    moves, errors = np.array(first, dtype=np.float64).reshape(-1, 2).T
    return moves, errors


def significance(found: Sequence[_core.Identification], place: int) -> Array:
    """Return the factor of a term over its standard error; NaN where it changes."""
    each = [one.unknowns[place] for one in found]
    numbers = [
        one.values[0] / (one.stderr[0] * one.factor)
        if one.kind == "constant" and one.values.size and one.stderr[0] > 0
        else np.nan
        for one in each
    ]
    return np.array(numbers, dtype=np.float64)


def _variation(profile: Sequence[tuple[Array, Array]]) -> Array:
    """Return how much the significance goes up and down along the range."""
    places, numbers = (np.stack([one[part] for one in profile]) for part in (0, 1))
    order = np.argsort(places, axis=0, kind="stable")
    along = np.take_along_axis(numbers, order, axis=0)
    return np.asarray(np.abs(np.diff(along, axis=0)).sum(axis=0))


def _chance(peak: Array, variation: Array) -> Array:
    """Return a bound for the probability that a normal process of such variation exceeds its peak, on either side (Davies 1987)."""
    size = np.abs(peak)
    alone = np.array([math.erfc(one / math.sqrt(2)) if np.isfinite(one) else np.nan for one in size.tolist()])
    return np.asarray(np.minimum(1.0, alone + variation * np.exp(-(size**2) / 2) / math.sqrt(2 * math.pi)))
