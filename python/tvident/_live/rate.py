"""What stamps say of a live recording: its rate, its buffers, how late they come, and whether a rate is another one."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

Row = tuple[float, float, float]
"""Time, angle, torque."""

HALF = 0.5
"""Periods: a stamp that is later belongs to the next sample."""

MOVES = 0.25
"""Periods from stamp to stamp, at least, where they say how samples follow each other: those of one buffer are alike."""

_UNEVEN = 2e-3
"""Of a step from stamp to stamp, by how much it is no whole number of periods where another buffer begins."""

BUFFERS_THAT_SAY = 16
"""Buffers that say how late buffers come."""

LONGEST_BUFFER = 0.5
"""Seconds that a buffer lasts, at most."""

_LOOK, _LONGEST_LOOK = 64, 2.0
"""Samples of a first look, at least, and its seconds, at most."""

_NO_CHANCE, _LATE = 14.0, 6.0
"""Mean latenesses that buffers in a row are late in all, at least, where that is no chance: one in a million; and that one may be."""

SCATTER = 0.3
"""Periods by which stamps scatter, at most, where lost samples can be told from another rate."""

_FEW = 8
"""Stamps that say nothing of a rate yet."""

_SURE = 5.0
"""Standard errors by which a rate is another one, at least."""

_ROUNDS, _MOST = 3, 0.75
"""How often samples that came late are left out, and part of all that stays, at least."""

_CLEARLY = 10.0
"""By how much another rate explains stamps better than lost samples, as twice the logarithm of the odds: 150 to 1."""

_DIGIT = 0.01
"""Periods: stamps that scatter less have too few digits to say so."""


@dataclass
class Rate:
    """The line through times over sample numbers: its sums, kept so that nothing large is subtracted."""

    count: int = 0
    number: float = 0.0
    time: float = 0.0
    squares: float = 0.0
    products: float = 0.0
    times: float = 0.0
    first: float = math.nan
    last: float = math.nan

    def see(self, number: float, time: float) -> None:
        """Add a sample."""
        self.count += 1
        self.first, self.last = (number if self.count == 1 else self.first), number
        by, late = number - self.number, time - self.time
        self.number += by / self.count
        self.time += late / self.count
        self.squares += by * (number - self.number)
        self.products += by * (time - self.time)
        self.times += late * (time - self.time)

    def joined(self, other: Rate) -> Rate:
        """Return the line through the samples of both, of which the other's came later."""
        if not self.count or not other.count:
            return replace(self if self.count else other)
        count = self.count + other.count
        by, late = other.number - self.number, other.time - self.time
        share = other.count / count
        weight = self.count * share
        return Rate(
            count,
            self.number + share * by,
            self.time + share * late,
            self.squares + other.squares + weight * by * by,
            self.products + other.products + weight * by * late,
            self.times + other.times + weight * late * late,
            self.first,
            other.last,
        )

    @property
    def period(self) -> float:
        """Seconds from sample to sample; NaN before there are two."""
        return self.products / self.squares if self.squares else math.nan

    @property
    def error(self) -> float:
        """Standard error of the period, if stamps scatter independently."""
        if self.count < 3:  # noqa: PLR2004 - a line goes through two
            return math.nan
        return self.scatter / math.sqrt(self.squares)

    @property
    def scatter(self) -> float:
        """Seconds by which times are off the line, as a standard deviation; there must be three."""
        left = max(self.times - self.products**2 / self.squares, 0.0)
        return math.sqrt(left / (self.count - 2))


@dataclass
class Buffers:
    """Samples that come together.

    Drivers and the Lab Streaming Layer give them one stamp, or even stamps that are all as late as the one that the buffer got.

    Parameters
    ----------
    longest : int
        Samples of a buffer, at most.
    """

    longest: int
    _run: int = 0
    _is_alike: bool = False
    begins: bool = True
    """Whether the latest sample is the first of its buffer."""
    _lengths: deque[int] = field(default_factory=lambda: deque([1, 1, 1], maxlen=3))

    def begun_again(self) -> Buffers:
        """Return those of the same stream from its first sample on."""
        return Buffers(self.longest, _lengths=deque(self._lengths, maxlen=3))

    def see(self, step: float) -> bool:
        """Take a step from stamp to stamp, in periods, and return whether the later stamp tells anything that the earlier did not."""
        self.begins = not math.isfinite(step)
        if self.begins:
            return True
        was_alike, self._is_alike = self._is_alike, -MOVES < step < MOVES
        if self._is_alike:
            self._run += 1
            return False
        if was_alike or step < HALF or abs(step - round(step)) > _UNEVEN * max(1.0, step):
            self._lengths.append(self._run if self._run <= self.longest else 1)
            self._run, self.begins = 0, True
        self._run += 1
        return True

    @property
    def length(self) -> int:
        """Samples of the latest buffers; 1 where stamps do not show any."""
        return self.latest if self._run <= min(self.longest, 2 * self.latest) else 1

    @property
    def latest(self) -> int:
        """Samples of the latest buffers that have ended."""
        return max(self._lengths)


class Came(NamedTuple):
    """A sample, whether its stamp tells anything that the one before it did not, and whether it is the first of its buffer."""

    row: Row
    tells: bool = True
    begins: bool = True


@dataclass
class Lateness:
    """How late the latest buffers came, in periods.

    Buffers come late and never early, so what is due when is said by those that came first: the second of 16, since one stamp may be
    wrong. Of a mean, by which lateness of a period or more would hide a sample that was lost, one buffer in three is half a period off.
    """

    _latest: deque[float] = field(default_factory=lambda: deque(maxlen=BUFFERS_THAT_SAY))

    def see(self, late: float) -> float:
        """Take how late a buffer came, and return by how much later the next ones are due than was thought."""
        self._latest.append(late)
        first = sorted(self._latest)[:2][-1]
        move = first if len(self._latest) == BUFFERS_THAT_SAY or first < 0 else 0.0
        move = max(-HALF, min(HALF, move))
        self._latest = deque((one - move for one in self._latest), maxlen=BUFFERS_THAT_SAY)
        return move

    def note(self, late: float) -> None:
        """Take how late a sample came that is no buffer."""
        self._latest.append(late)

    @property
    def usual(self) -> float:
        """How late one comes at most: one in 400 is later than six times the mean."""
        return max(*self._latest, _LATE * self._mean) if self._latest else 0.0

    @property
    def _mean(self) -> float:
        return sum(self._latest) / max(1, len(self._latest))

    def is_no_chance(self, earliest: float, buffers: float) -> bool:
        """Return whether so many buffers are not so late all of them by chance: most lateness has an exponential tail."""
        return buffers * earliest >= _NO_CHANCE * self._mean


def shown_period(numbers: Sequence[int], stamps: Sequence[float], nominal: float) -> float:
    """Return the period that stamps show where another rate explains them better than samples that were lost; else the nominal one.

    What is lost is whole periods, here and there; another rate is the same part of a period at every sample. The line through the stamps
    is compared with steps of whole periods at the nominal rate, by Schwarz's criterion.
    """
    if len(numbers) < _FEW:
        return nominal
    by = np.asarray(numbers, dtype=np.float64) - numbers[0]
    late = (np.asarray(stamps) - stamps[0]) / nominal - by
    # Some come late, when the sender was held up: what is far above the line through all is left out.
    for _ in range(_ROUNDS):
        left = late - np.polyval(np.polyfit(by, late, 1), by)
        is_usual = left < np.median(left) + HALF
        if np.count_nonzero(is_usual) < max(_FEW, _MOST * len(numbers)):
            return nominal
        by, late = by[is_usual], late[is_usual]
    lost, losses = np.zeros(len(by)), 0
    for place, off in enumerate((late[1:] - late[0]).tolist(), start=1):
        missing = max(0.0, math.floor(off - lost[place - 1] + HALF))
        lost[place], losses = lost[place - 1] + missing, losses + bool(missing)
    return another_period(by, late, (lost, losses), nominal)


def another_period(by: Floats, late: Floats, explained: tuple[Floats, int], nominal: float) -> float:
    """Return the period of samples that are so late, in periods, if a line explains that better than losses do; else the nominal one.

    Parameters
    ----------
    by, late : ndarray
        Numbers of samples from the first on, and by how many periods each is late.
    explained : tuple
        What losses explain of that, and how many there are.
    nominal : float
        The period.
    """
    lost, losses = explained
    count = len(by)
    from_middle = by - by.mean()
    squares = float(from_middle @ from_middle)
    slope = float(from_middle @ late) / squares
    of_line = float(np.var(late - slope * by))
    error = math.sqrt(of_line * count / (count - 2) / squares)
    odds = [
        count * math.log(left + _DIGIT**2) + free * math.log(count)
        for left, free in ((of_line, 2), (float(np.var(late - lost)), 1 + losses))
    ]
    # Less than a period in all is followed as it comes.
    adds_up = abs(slope) * float(by[-1] - by[0]) > 1 and abs(slope) > _SURE * error
    # Where some are lost, most steps from one to the next are those of the nominal rate.
    usual = float(np.median(np.diff(late) / np.diff(by)))
    adds_up &= abs(usual - slope) < HALF * abs(slope)
    is_likelier = odds[0] + _CLEARLY < odds[1]
    return nominal * (1 + slope) if adds_up and is_likelier and of_line < SCATTER**2 else nominal


class RateLook:
    """Keeps the first samples until they say at which rate they come: judged by a rate that is 1 % off, buffers lose samples.

    Parameters
    ----------
    period : float
        Nominal seconds from sample to sample.
    """

    def __init__(self, period: float) -> None:
        self.rows: list[Row] = []
        self._period = period
        self._longest = max(1, int(LONGEST_BUFFER / period))
        self._most = int(_LONGEST_LOOK / period)
        self.buffers = Buffers(self._longest)
        self._begun: list[int] = []
        self._are_some_alike = False

    def has_seen(self, row: Row) -> bool:
        """Take a sample, and return whether no more are needed."""
        step = (row[0] - self.rows[-1][0]) / self._period if self.rows else math.nan
        self._are_some_alike |= bool(self.rows) and row == self.rows[-1]
        self.buffers.see(step)
        if self.buffers.begins:
            self._begun.append(len(self.rows))
        self.rows.append(row)
        is_even = len(self._begun) == 1 and len(self.rows) > self._longest + _LOOK
        has_enough = len(self._begun) >= BUFFERS_THAT_SAY and len(self.rows) >= _LOOK
        return not math.isfinite(row[0]) or is_even or has_enough or len(self.rows) >= self._most

    @property
    def period(self) -> float:
        """The period that stamps show; the nominal one where samples may have come twice."""
        if self._are_some_alike:
            return self._period
        places = self._begun if len(self._begun) > 1 else range(len(self.rows))
        some = [place for place in places if math.isfinite(self.rows[place][0])]
        return shown_period(some, [self.rows[place][0] for place in some], self._period)
