"""Whether the rate of a live recording changes while it goes on: samples are looked at again and again."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass, field, replace

import numpy as np

from tvident._live.rate import BUFFERS_THAT_SAY, HALF, SCATTER, Rate, another_period

_LOOK = 512
"""Samples of a look, at least: a rate that is 0.2 % off adds up to a period."""

_AGAIN = 3
"""How often samples are taken for lost in two looks, at least, where it may be another rate."""

_MORE, _DIGIT = 2.0, 0.01
"""By how much the variance of stamps may be more than it was where another rate explains them, and periods that a digit may have."""

_STRETCH = 2.0
"""Seconds of a stretch whose rate is compared with that of the samples before it."""

_FEW = 32
"""Stamps of a stretch, at least."""

_NOTABLE = 1e-3
"""Relative change of the rate that is told, at least: inertia goes with its square."""

_SURE = 5.0
"""Standard errors by which rates differ, at least."""

Point = tuple[int, float]
"""The number of a sample, and its stamp."""


@dataclass(frozen=True)
class RateChange:
    """A rate that changed: the stamp of the change, and the periods before and after it."""

    stamp: float
    before: float
    after: float

    def __str__(self) -> str:
        return f"from {1 / self.before:.4g} to {1 / self.after:.5g} Hz"


@dataclass
class Looks:
    """Asks the latest samples whether what was lost before them is another rate.

    A rate that is off by more than the clock follows looks like samples that were lost, or repeated, again and again.
    """

    _latest: list[Point] = field(default_factory=list)
    _before: list[Point] = field(default_factory=list)
    """Numbers of samples as they came: of the look that goes on, and of the one before."""
    _taken_for: list[tuple[int, int]] = field(default_factory=list)
    """Before which samples others were taken for lost in these looks; for repeated where they are less than none."""

    def took_for_lost(self, number: int, by: int) -> None:
        """Note that so many samples were taken for lost before a sample."""
        self._taken_for.append((number, by))

    def see(self, number: int, stamp: float, known: float, scatter: float) -> float:
        """Take a sample that begins a buffer or is none, and return the period that the latest show: the known one, mostly.

        Stamps scatter by so many seconds.
        """
        if self._is_over:
            # Whatever it showed: what became of that is not known here.
            self._before, self._latest = self._latest, []
            self._taken_for = [one for one in self._taken_for if one[0] >= self._before[0][0]]
        self._latest.append((number, stamp))
        return self._shown(known, scatter) if self._is_over and len(self._taken_for) >= _AGAIN else known

    @property
    def _is_over(self) -> bool:
        """Whether the look that goes on has all its samples."""
        return len(self._latest) >= BUFFERS_THAT_SAY and self._latest[-1][0] - self._latest[0][0] >= _LOOK

    def _shown(self, known: float, scatter: float) -> float:
        """Return the period that explains the latest samples better than what was taken for lost; else the known one."""
        numbers, stamps = (np.array(column) for column in zip(*self._latest, strict=True))
        by = numbers - numbers[0]
        late = (stamps - stamps[0]) / known - by
        places, lost = (np.array(column) for column in zip(*self._taken_for, strict=True))
        before = np.concatenate([[0], np.cumsum(lost)])[np.searchsorted(places, numbers, side="right")]
        period = another_period(by, late, (before - before[0], int(np.count_nonzero(places > numbers[0]))), known)
        # A line through samples of which some are lost leaves more than stamps scatter.
        left = np.var(late - np.polyval(np.polyfit(by, late, 1), by))
        if left > _MORE * (scatter / known) ** 2 + _DIGIT**2:
            return known
        # A rate that is lower is taken for losses, and one that is higher for repetitions.
        return period if (period > known) == (lost.sum() > 0) else known

    def since(self, period: float) -> tuple[float, int, int]:
        """Return from when on the latest samples have this period, and how many were taken for lost and for repeated since then."""
        # From the last stamp, so that nothing large is subtracted; a single stamp may be late.
        end = self._latest[-1][1]
        due = statistics.median((at - end) / period - number for number, at in self._latest)
        begin, was_off = self._latest[0][0], False
        for number, at in reversed(self._before):
            is_off = abs((at - end) / period - number - due) > HALF
            if is_off and was_off:
                break
            begin, was_off = begin if is_off else number, is_off
        by = [by for one, by in self._taken_for if one >= begin]
        return end + (begin + due) * period, sum(max(one, 0) for one in by), sum(max(-one, 0) for one in by)


@dataclass
class _Stretch:
    """The rate of some samples, and the stamp of the first."""

    begin: float = math.nan
    rate: Rate = field(default_factory=Rate)


@dataclass
class Stretches:
    """Compares the rate of two stretches with that of all samples before: a change that the clock follows shows nowhere else.

    Sums of a stretch grow with each sample, and are put together: no sample takes longer than another.
    """

    base: Rate = field(default_factory=Rate)
    """Of the samples before the latest stretches."""
    _latest: _Stretch = field(default_factory=_Stretch)
    _before: _Stretch = field(default_factory=_Stretch)

    def see(self, number: int, stamp: float) -> tuple[RateChange, Rate] | None:
        """Take a sample at its place, and return a change that shows now, with the rate since then."""
        if not self._latest.rate.count:
            self._latest.begin = stamp
        self._latest.rate.see(number, stamp)
        if stamp - self._latest.begin < _STRETCH or self._latest.rate.count < _FEW:
            return None
        latest, before = self._latest.rate, self._before.rate
        if _differ(self.base, latest) and _differ(self.base, before) and not _differ(before, latest):
            after = before.joined(latest)
            change = RateChange(self._before.begin, self.base.period, after.period)
            self.base, self._before, self._latest = after, _Stretch(), _Stretch()
            # The base must not see what the clock's own rate will.
            return change, replace(after)
        self.base = self.base.joined(before)
        self._before, self._latest = self._latest, _Stretch()
        return None


def _differ(one: Rate, other: Rate) -> bool:
    """Return whether rates that are known differ by more than chance, and by what counts."""
    if min(one.count, other.count) < _FEW or max(one.scatter, other.scatter) > SCATTER * one.period:
        return False
    error = math.hypot(one.error, other.error)
    return abs(one.period - other.period) > max(_NOTABLE * one.period, _SURE * error)
