"""The samples of a channel that were read, where a recorder holds each reading or draws lines from one to the next."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tvident._clocks.grid import Numbers

_LOOKED_AT, _STILL = 1 << 12, 1 / 3
"""Samples at the beginning, of which at least this part repeats the one before where a channel is held."""

_LEAST, _MOST = 2, 50
"""Samples that hold a reading."""

_FEWEST, _OFTEN, _IN_BEAT = 50, 0.5, 0.99
"""Changes that tell a beat, the part of the readings that must change something, and the part of the changes that must come in the beat."""

_JITTER = 0.4
"""By which part of the usual step, or a sample, readings may come early or late."""

_USUAL = 0.45
"""By which part of the usual step steps differ that are no gaps."""

_OFF = 0.1
"""Samples by which readings may be seen elsewhere than those of an even clock are, which is known no better."""

_STEPS, _SMALL = 3.0, 0.05
"""A channel that was rounded changes by one step at a time where it changes seldom; one that is held by at least so many, mostly.

The smallest of so large a part of the changes are taken for a step: where an angle wraps, or was written with few digits, steps differ.
"""

_REPEATED = 4
"""Readings in a row that may change nothing: where there are more, a channel rests or is stuck, and nothing is known."""

_CLIPPED, _FEWEST_CLIPPED = 1.5, 3
"""Holds that an angle stays at its largest or smallest value where it is clipped, and how often it must."""

_SAME = 1e-6
"""Samples by which a reading may seem to come after the sample that shows it, by rounding."""

_STRAIGHT = 16 * np.finfo(float).eps
"""Samples lie on a straight line if they bend by no more than this part of the largest value."""


class Read(NamedTuple):
    """What was read of a record: samples that show it, the places in the record where it was read, and whether its value is known."""

    samples: npt.NDArray[np.int64]
    places: Numbers
    known: npt.NDArray[np.bool_]

    @property
    def hold(self) -> float:
        """Usual samples from reading to reading, which gaps are not."""
        between = np.diff(self.places)
        usual = float(np.median(between))
        return float(between[np.abs(between - usual) < _USUAL * usual].mean())

    @property
    def is_even(self) -> bool:
        """Whether readings come every so many samples, a whole number."""
        return self.hold == round(self.hold) and float(np.ptp(np.diff(self.places))) == 0


# What is infinite is missing.
@np.errstate(all="ignore")
def readings_of(row: npt.NDArray[np.number]) -> Read | None:
    """Return the samples of a record that are readings, and the places in it where they were read; None where it holds none.

    A reading is seen at the first sample after it: half a sample after it on average, unless all come in one beat with the samples. Where
    they are seen when those of an even clock are, they are the clock's.
    """
    beginning = row[:_LOOKED_AT]
    if np.count_nonzero(beginning[1:] == beginning[:-1]) < _STILL * (beginning.size - 1):
        return None
    steps = np.diff(row)
    changes = np.flatnonzero(np.isfinite(steps) & (steps != 0)) + 1
    if not changes.size:
        return None
    sizes = np.abs(steps[changes - 1].astype(np.float64))
    if np.median(sizes) < _STEPS * np.quantile(sizes, _SMALL):
        return None
    beat = _beat(changes, row.size)
    if beat is None:
        return None
    samples, known = _with_those_between(changes, beat)
    places = samples - (0.0 if beat.is_exact else 0.5)
    own = _clock(changes, beat.numbers)
    if own is not None:
        places = own[0] + own[1] * np.arange(samples.size)
        samples = np.ceil(places - _SAME).astype(np.int64)
    begin = samples[0] - round(beat.hold)
    if begin >= 0 and places[0] >= beat.hold - _SAME:
        # What is held at first was read as well.
        samples = np.concatenate([[begin], samples])
        places = np.concatenate([[places[0] - beat.hold], places])
        known = np.concatenate([[True], known])
    # What changes between two readings, as where one is stale or late, is none.
    apart = np.concatenate([[True], np.diff(places) >= beat.hold / 2])
    found = Read(samples[apart], places[apart], known[apart])
    return found._replace(known=found.known & ~_is_clipped(row, beat.hold)[found.samples])


def _is_clipped(row: npt.NDArray[np.number], hold: float) -> npt.NDArray[np.bool_]:
    """Return where a record that is held stays at its largest or smallest value."""
    clipped = np.zeros(row.size, bool)
    for extreme in (np.nanmin(row), np.nanmax(row)):
        at = row == extreme
        edges = np.flatnonzero(np.diff(np.concatenate([[False], at, [False]])))
        stays = np.diff(edges)[::2] > _CLIPPED * hold
        if np.count_nonzero(stays) >= _FEWEST_CLIPPED:
            clipped |= at
    return clipped


@np.errstate(all="ignore")
def knots_of(row: npt.NDArray[np.number]) -> Read | None:
    """Return the samples of a record between which it is straight, as readings; None where these keep no beat of whole samples."""
    if row.dtype.kind != "f":
        return None
    rounding = _STRAIGHT * _largest(row)
    beginning = row[:_LOOKED_AT]
    if np.count_nonzero(_is_straight(beginning, rounding)) < _STILL * beginning.size:
        return None
    bends = np.diff(row, 2)
    knots = np.flatnonzero(np.isfinite(bends) & (np.abs(bends) > rounding)) + 1
    beat = _beat(knots, row.size)
    if beat is None or not beat.is_exact:
        return None
    samples, known = _with_those_between(knots, beat)
    return Read(samples, samples.astype(np.float64), known)


def _largest(row: npt.NDArray[np.number]) -> float:
    """Return the largest magnitude of what is finite; zero where nothing is."""
    largest = max(abs(float(np.fmax.reduce(row))), abs(float(np.fmin.reduce(row)))) if row.size else math.nan
    # A copy of a long record is made only where it holds what is infinite.
    return largest if math.isfinite(largest) else float(np.abs(row[np.isfinite(row)]).max(initial=0.0))


def _is_straight(row: npt.NDArray[np.number], rounding: float) -> npt.NDArray[np.bool_]:
    """Return where samples move and do not bend."""
    return np.asarray((np.abs(np.diff(row)[1:]) > rounding) & (np.abs(np.diff(row, 2)) <= rounding))


class _Beat(NamedTuple):
    """Samples from reading to reading, how many readings there are from each change to the next, and whether these and all come in beat."""

    hold: float
    counts: npt.NDArray[np.int64]
    in_beat: npt.NDArray[np.bool_]
    is_exact: bool

    @property
    def numbers(self) -> npt.NDArray[np.int64]:
        """The number of the reading at each change."""
        return np.concatenate([[0], np.cumsum(self.counts)])


def _beat(changes: npt.NDArray[np.int64], samples: int) -> _Beat | None:
    """Return the beat that changes keep; None where they keep none."""
    if changes.size < _FEWEST:
        return None
    runs = np.diff(changes)
    usual = float(np.median(runs))
    if not _LEAST <= usual <= _MOST:
        return None
    hold = float(runs[np.abs(runs - usual) <= 1].mean())
    counts = np.maximum(np.rint(runs / hold).astype(np.int64), 1)
    in_beat = np.abs(runs - hold * counts) < max(1.0, _JITTER * hold)
    if in_beat.mean() < _IN_BEAT or changes.size < _OFTEN * samples / hold:
        return None
    is_exact = bool(np.mean(runs == round(hold) * counts) >= _IN_BEAT)
    return _Beat(float(round(hold)) if is_exact else hold, counts, in_beat, is_exact)


def _with_those_between(
    changes: npt.NDArray[np.int64], beat: _Beat
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """Return readings with those that changed nothing, and whether their values are known: a few in beat are."""
    numbers = beat.numbers
    every = np.arange(numbers[-1] + 1)
    last = np.searchsorted(numbers, every, side="right") - 1
    after = every - numbers[last]
    is_known = np.concatenate([beat.in_beat & (beat.counts <= _REPEATED), [True]])
    samples = changes[last] + np.rint(beat.hold * after).astype(np.int64)
    return samples, (after == 0) | is_known[last]


def _clock(changes: npt.NDArray[np.int64], numbers: npt.NDArray[np.int64]) -> tuple[float, float] | None:
    """Return the place of the first reading and samples from one to the next, if an even clock explains where changes are seen."""
    hold = float(changes[-1] - changes[0]) / float(numbers[-1])
    whole = round(hold)
    # Over the whole record a clock that is off by less than a sample is even.
    if np.array_equal(changes - changes[0], whole * numbers):
        return float(changes[0]), float(whole)
    fitted = np.polynomial.Polynomial.fit(numbers, changes, 1)
    hold = float(fitted.deriv()(0.0))
    begins = changes - hold * numbers
    earliest, latest = float(begins.max()) - 1, float(begins.min())
    return ((earliest + latest) / 2, hold) if earliest <= latest + _OFF else None
