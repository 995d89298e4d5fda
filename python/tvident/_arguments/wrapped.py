"""Wrapped angles: whole periods added again, so that a motion goes on where the recorder began anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._arguments.numbers import LARGEST, positive_number

_Numbers = npt.NDArray[np.float64]

_STEP = 0.4
"""Periods between two samples from which on nothing tells which way the angle went: half a period is either way."""

_SPAN = 1.5
"""Periods that a wrapped angle spans at most: one, and noise that was added later."""

_SAFETY = 1.5
"""By how much a gap may be harder to bridge than any place of its length without one."""

_FEWEST, _MOST = 2, 1 << 16
"""Places at which a rule for gaps is tried: so many times the gap's length at least, and so many at most."""


@dataclass(frozen=True)
class Unwrapped:
    """Angles without jumps.

    Attributes
    ----------
    values : ndarray of float64, the angles' shape
        NaN where samples are missing, and after a step that may have gone either way.
    splits : list of list of int
        Of every record the first samples after gaps that do not say how often the angle went round in them: from there on it may be wrong
        by whole periods.
    either_way : list of int
        Of every record the number of steps that may have gone either way.
    """

    values: _Numbers
    splits: list[list[int]]
    either_way: list[int]

    def longest(self, name: str, *, split: bool) -> tuple[_Numbers, list[tuple[int, str]]]:
        """Return angles of which every sample is known, and what to say of which record.

        Where a gap splits a record its longest part stays.
        """
        values, words = self.values.copy(), []
        records = values.reshape(-1, values.shape[-1])
        for number, (record, splits, steps) in enumerate(zip(records, self.splits, self.either_way, strict=True)):
            if steps:
                line = (
                    f"{_counted(steps, 'step')} of the {name} may have gone either way, more than {_STEP:g} periods: the samples after "
                    "them count as missing; sample faster, or repair them"
                )
                words.append((number, line))
            if splits and split:
                bounds = [0, *splits, record.size]
                longest = int(np.argmax(np.diff(bounds)))
                record[: bounds[longest]], record[bounds[longest + 1] :] = np.nan, np.nan
                line = (
                    f"{_counted(len(splits), 'gap')} of the {name} may hide whole periods, and the equation needs to know: only samples "
                    f"{bounds[longest]} to {bounds[longest + 1] - 1} are used; identify the others on their own"
                )
                words.append((number, line))
        return values, words


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def unwrapped(name: str, array: npt.NDArray[Any], period: float) -> Unwrapped:
    """Return angles, time the last axis, to which whole periods are added so that steps are the shortest that are possible.

    Across a gap the angle goes the shortest way, or on with the mean of the velocities on either side, whichever does better where as many
    samples are there. Where that may be wrong by half a period the gap does not say how often the angle went round.
    """
    period = positive_number("period", period, most=LARGEST)
    values = np.array(array, dtype=np.float64)
    records = values.reshape(-1, values.shape[-1])
    splits, either_way = [], []
    for place, record in enumerate(records):
        with np.errstate(invalid="ignore"):
            record[~(np.abs(record) <= LARGEST)] = np.nan
        if np.isfinite(record).any():
            span = float(np.nanmax(record) - np.nanmin(record))
            if span > _SPAN * period:
                where = f" of record {place}" if len(records) > 1 else ""
                raise ValueError(
                    f"a wrapped {name} must lie within one period; {name}{where} spans {span:.6g} with period={period:.6g}; give the "
                    f"period in the unit of {name}, or leave it out if {name} is not wrapped"
                )
        either_way.append(_remove_long_steps(record, period))
        splits.append(_unwrap(record, period))
    return Unwrapped(values, splits, either_way)


def _remove_long_steps(record: _Numbers, period: float) -> int:
    """Make samples missing that the angle may have reached either way; return how many steps did."""
    steps = np.diff(record) / period
    with np.errstate(invalid="ignore"):
        long = np.abs(steps - np.round(steps)) > _STEP
    record[1:][long] = np.nan
    return int(long.sum())


def _unwrap(record: _Numbers, period: float) -> list[int]:
    """Unwrap a record in place; return the first samples after gaps that do not say how often it went round."""
    there = np.flatnonzero(np.isfinite(record))
    if not there.size:
        return []
    values, gaps = record[there], np.diff(there)
    steps = np.diff(values)
    steps -= period * np.round(steps / period)
    neighbours = np.abs(steps[gaps == 1])
    fastest = float(neighbours.max()) if neighbours.size else np.inf
    joints = np.flatnonzero((gaps > 1) & ~(_SAFETY * fastest * gaps < period / 2))
    # Every step is the shortest; those over gaps are looked at one by one.
    values[1:] = values[0] + np.cumsum(steps)
    record[there] = values
    if not joints.size:
        return []
    parts = _Parts(
        np.interp(np.arange(record.size), there, values), [0, *there[joints + 1]], [*there[joints], record.size - 1]
    )
    splits, level = [], 0.0
    for part in range(1, len(parts.begins)):
        begin, end = parts.begins[part], parts.ends[part]
        step = parts.step_to(part, period)
        if step is None:
            splits.append(begin)
        else:
            level += step
        record[begin : end + 1] += level
    return splits


class _Parts:
    """Parts of a record between gaps.

    Parameters
    ----------
    record : ndarray, shape (n,)
        Unwrapped in every part, by the shortest step from one part to the next.
    begins, ends : sequence of int
        First and last sample of every part.
    """

    def __init__(self, record: _Numbers, begins: Sequence[int], ends: Sequence[int]) -> None:
        self.begins, self.ends = [int(one) for one in begins], [int(one) for one in ends]
        self._record = record
        self._part = np.full(record.size, -1)
        for part, (begin, end) in enumerate(zip(self.begins, self.ends, strict=True)):
            self._part[begin : end + 1] = part
        self._worst: dict[int, tuple[float, float]] = {}

    def step_to(self, part: int, period: float) -> float | None:
        """Return what is to be added to a part beside what is added to the one before, or None if that cannot be known."""
        end, begin = self.ends[part - 1], self.begins[part]
        gap = begin - end
        if gap not in self._worst:
            self._worst[gap] = self._tried(gap)
        shortest, carried = self._worst[gap]
        way = np.zeros(1) if shortest <= carried else self._carried(np.array([end]), gap)
        if not (min(shortest, carried) * _SAFETY < period / 2 and np.isfinite(way[0])):
            return None
        turns = np.round((self._record[begin] - self._record[end] - way[0]) / period)
        return float(-period * turns)

    def _tried(self, gap: int) -> tuple[float, float]:
        """Return by how much the shortest way and the one that goes on are wrong at worst over so many samples that are there."""
        reach = max(2, gap // 2)
        places = np.arange(reach, self._record.size - gap - reach)
        places = places[self._part[places - reach] == self._part[places + gap + reach]]
        places = places[self._part[places] >= 0]
        if places.size < _FEWEST * gap:
            return np.inf, np.inf
        places = places[:: 1 + places.size // _MOST]
        way = self._record[places + gap] - self._record[places]
        return float(np.abs(way).max()), float(np.abs(way - self._carried(places, gap)).max())

    def _carried(self, ends: npt.NDArray[np.intp], gap: int) -> _Numbers:
        """Return how far the angle goes in gaps with the mean of the velocities on either side; NaN where a part is too short for one."""
        reach = max(2, gap // 2)
        before, after = np.maximum(ends - reach, 0), np.minimum(ends + gap + reach, self._record.size - 1)
        there = (self._part[before] == self._part[ends]) & (self._part[after] == self._part[ends + gap])
        rate = self._record[ends] - self._record[before] + self._record[after] - self._record[ends + gap]
        return np.where(there, rate * gap / (2 * reach), np.nan)
