"""The clock of a live recording: its rate, its drift, and which samples were lost."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

Row = tuple[float, float, float]
"""Time, angle, torque."""

_WAIT = 16
"""Samples that decide whether a stamp was late or early alone, or samples were lost or repeated before it; buffers, where samples come
in buffers whose stamps are late or early together."""

_LONGEST_WAIT, _LONGEST_BUFFER = 2.0, 0.5
"""Seconds that samples wait for buffers that decide, at most, and that a buffer lasts, at most."""

_UNEVEN = 2e-3
"""Of a step from stamp to stamp, by how much it is no whole number of periods where another buffer begins."""

_HALF = 0.5
"""Periods: a stamp that is later belongs to the next sample."""

_MOVES = 0.25
"""Periods from stamp to stamp, at least, where they say how samples follow each other: those of one buffer are alike."""

_COARSE = 1.005
"""Periods from stamp to stamp, at least, where their last digit is longer than a period."""

_FOLLOW = 0.05
"""Part of a stamp's lateness by which the next one is expected later: the clock is followed over some 20 samples, or buffers."""

_SET_BACK = 0.1
"""Seconds by which a stamp is before the last one, at least, where the clock was set."""

_KNOWN, _NO_MISTAKE = 1e-3, 0.1
"""Relative error of a period that is known well, and how far it may be from the nominal one without being a mistake."""

_MOST_LOST = 1_000_000
"""A longer gap is no loss, but another recording."""

_ENOUGH, _MOST_REPEATED, _FASTER = 200, 0.1, 1.1
"""Stamps that say at which rate they come, the part of them that may come twice, and how much faster than nominal they may be then."""

_NOTABLE = 1e-3
"""Of the rate: inertia goes with its square."""


@dataclass
class Rate:
    """The line through times over sample numbers: its sums, kept so that nothing large is subtracted."""

    count: int = 0
    number: float = 0.0
    time: float = 0.0
    squares: float = 0.0
    products: float = 0.0
    times: float = 0.0

    def see(self, number: float, time: float) -> None:
        """Add a sample."""
        self.count += 1
        by, late = number - self.number, time - self.time
        self.number += by / self.count
        self.time += late / self.count
        self.squares += by * (number - self.number)
        self.products += by * (time - self.time)
        self.times += late * (time - self.time)

    @property
    def period(self) -> float:
        """Seconds from sample to sample; NaN before there are two."""
        return self.products / self.squares if self.squares else math.nan

    @property
    def error(self) -> float:
        """Standard error of the period, if stamps scatter independently."""
        if self.count < 3:  # noqa: PLR2004 - a line goes through two
            return math.nan
        left = max(self.times - self.products**2 / self.squares, 0.0)
        return math.sqrt(left / (self.count - 2) / self.squares)


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
    _lengths: deque[int] = field(default_factory=lambda: deque([1, 1, 1], maxlen=3))

    def see(self, step: float) -> bool:
        """Take a step from stamp to stamp, in periods, and return whether the later stamp tells anything that the earlier did not."""
        if not math.isfinite(step):
            return True
        was_alike, self._is_alike = self._is_alike, -_MOVES < step < _MOVES
        if self._is_alike:
            self._run += 1
            return False
        if was_alike or step < _HALF or abs(step - round(step)) > _UNEVEN * max(1.0, step):
            self._lengths.append(self._run if self._run <= self.longest else 1)
            self._run = 0
        self._run += 1
        return True

    @property
    def length(self) -> int:
        """Samples of the latest buffers; 1 where stamps do not show any."""
        return max(self._lengths) if self._run <= self.longest else 1


class LiveClock:
    """Puts samples in order by their stamps, and what was lost between them as NaN.

    A stamp that is late alone, since a driver held it back, is followed by ones that are not; after a loss all are late, and after
    samples that came twice all are early. So a stamp that is off waits for the next 16, and whole periods that all of them are late are
    lost samples. Samples of a buffer are late together: there 16 buffers decide, in two seconds at most. With a counter nothing has to
    wait. Where samples came twice or the clock was set, one NaN keeps windows apart; a sample that comes twice with its stamp is left
    out, unless stamps say that both are of one buffer, or have too few digits to say it.

    Parameters
    ----------
    period : float
        Nominal seconds from sample to sample.

    Attributes
    ----------
    rate : Rate
        Since the clock was set.
    lost, repeated, jumps, back, twice, empty : int
        Samples that did not come and that came twice or too late, how often clock or counter were set, stamps that are before the last
        one by half a period or more, samples that were left out since they came twice with their stamps, and that came without a number.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._waiting: list[Row] = []
        self._told: list[bool] = []
        """Of samples that wait, whether their stamps tell anything that the stamp before them did not."""
        self._earliest, self._latest_off = math.inf, -math.inf
        """Periods by which those that wait are late: of the one that is least late, and most."""
        self._buffers = Buffers(max(1, int(_LONGEST_BUFFER / period)))
        self._next = 0
        self._expected = self._last = math.nan
        self._counter: int | None = None
        self._begin, self._stamped, self._same = math.nan, 0, 0
        self._before: Row = (math.nan,) * 3
        self._has_buffers, self._of_earlier_clock = False, 0
        self._highest = self._came = 0
        self.rate = Rate()
        self._newest = math.nan
        self._latest: Row = (math.nan,) * 3
        self._shortest = math.inf
        """Seconds from one stamp to another."""
        self._alike: list[Row] = []
        """Samples that are like the one before them, stamp and values, until the next stamp says what they are."""
        self.lost = self.repeated = self.jumps = self.back = self.twice = self.empty = 0

    def rows(self, row: Row, counter: float | None = None) -> list[Row]:
        """Take a sample, and return those that are in order now."""
        if counter is not None:
            return self._next_rows(row, counter)
        if row[0] == self._latest[0] and not _differ(row, self._latest):
            self._alike.append(row)
            return self._of_alike(came_twice=False) if len(self._alike) > _WAIT else []
        seconds, self._latest = row[0] - self._latest[0], row
        step = seconds / self._seconds()
        if step > _MOVES:
            self._shortest = min(self._shortest, seconds)
        # Stamps with few digits are alike where two samples lie within one digit: none ever comes after a single period.
        has_few_digits = self._shortest > _COARSE * self._seconds()
        return [*self._of_alike(came_twice=_MOVES < step < 1 + _HALF and not has_few_digits), *self._next_rows(row)]

    def _of_alike(self, *, came_twice: bool) -> list[Row]:
        """Return what is in order of samples that are alike: nothing where they came twice."""
        alike, self._alike = self._alike, []
        if came_twice:
            self.twice += len(alike)
            return []
        return [one for row in alike for one in self._next_rows(row)]

    def _next_rows(self, row: Row, counter: float | None = None) -> list[Row]:
        """Take a sample that is none that came before, and return those that are in order now."""
        if math.isfinite(row[0]):
            self._begin = row[0] if math.isnan(self._begin) else self._begin
            self._stamped += 1
            if row[0] == self._before[0]:
                differs = _differ(row, self._before)
                self._has_buffers |= differs
                self._same += not differs
            self._newest, self._before = row[0], row
        if counter is not None:
            return self._counted(row, counter)
        step = (row[0] - self._last) / self._seconds()
        if math.isfinite(row[0]):
            self._last = row[0]
        tells = self._buffers.see(step)
        length = self._buffers.length
        self.back += step <= -_HALF and length == 1
        if step < -max(_WAIT, 2 * length, _SET_BACK / self._period):
            # Nothing before it says when this one is due.
            return [*self._settled_at_last(), *self._jumped(row[0]), self._taken(row)]
        if not self._waiting and not (tells and abs(self._off(row, 0)) >= _HALF):
            return [self._taken(row, tells=tells)]
        self._wait(row, tells=tells)
        wait = max(_WAIT, min(_WAIT * length, int(_LONGEST_WAIT / self._period)))
        return self._settled() if len(self._waiting) > wait or self._is_due() else []

    def rest(self) -> list[Row]:
        """Return what still waits, at the end: samples of one buffer say nothing of what was lost."""
        found = self._of_alike(came_twice=not self._has_buffers)
        return [*found, *self._settled_at_last()]

    def _settled_at_last(self) -> list[Row]:
        """Return what waits for stamps that do not come any more."""
        found: list[Row] = []
        while self._waiting:
            is_one_buffer = self._waiting[-1][0] - self._waiting[0][0] < _MOVES * self._seconds()
            if is_one_buffer or 1 < len(self._waiting) <= 2 * self._buffers.length:
                found += self._taken_first(len(self._waiting))
            else:
                found += self._settled()
        return found

    def _counted(self, row: Row, counter: float) -> list[Row]:
        """Take a sample that says its number."""
        if not math.isfinite(counter):
            return [self._taken(row)]
        number, before = int(counter), self._counter
        by = 1 if before is None else number - before
        if -_WAIT < by <= 0:
            # It came before, or as missing: too late for its place.
            self.repeated += 1
            return []
        if by < 0:
            # Counters of some bits begin anew.
            by %= 1 << self._highest.bit_length()
        self._counter, self._highest = number, max(self._highest, number)
        if not 1 <= by <= _MOST_LOST:
            return [*self._jumped(row[0]), self._taken(row)]
        return [*self._gap(by - 1), self._taken(row)]

    def _off(self, row: Row, place: int) -> float:
        """Return by how many periods a stamp comes late, with so many samples before it that wait; less than zero where it is early."""
        return (row[0] - self._expected) / self._seconds() - place

    @property
    def _rate_error(self) -> float:
        """Standard error of the period: samples of a buffer are late together."""
        return self.rate.error * math.sqrt(self._buffers.length)

    def _seconds(self) -> float:
        """Return the period by which stamps are judged: what they show once they show it well."""
        shown, error = self.rate.period, self._rate_error
        is_known = error < _KNOWN * self._period and abs(shown - self._period) < _NO_MISTAKE * self._period
        return shown if is_known else self._period

    def _offs(self) -> list[float]:
        """Return by how many periods each sample that waits is late, NaN where its stamp tells nothing."""
        both = enumerate(zip(self._waiting, self._told, strict=True))
        return [self._off(row, place) if tells else math.nan for place, (row, tells) in both]

    def _wait(self, row: Row, *, tells: bool) -> None:
        """Let a sample wait."""
        self._see_off(self._off(row, len(self._waiting)) if tells else math.nan)
        self._waiting.append(row)
        self._told.append(tells)

    def _see_off(self, off: float) -> None:
        """Note how late the earliest and the latest of those that wait are."""
        if math.isfinite(off):
            self._earliest, self._latest_off = min(self._earliest, off), max(self._latest_off, off)

    def _is_due(self) -> bool:
        """Return whether nothing was lost or repeated before those that wait: one of them is not off, or some are late and some early."""
        return self._earliest < _HALF and self._latest_off > -_HALF

    def _settled(self) -> list[Row]:
        """Return what waits up to the last sample that is not off, or all of it, after what was lost before it."""
        off = (
            0.0
            if self._is_due() or not math.isfinite(self._earliest)
            else min(self._earliest, self._latest_off, key=abs)
        )
        by = math.floor(off + _HALF)
        if by > _MOST_LOST:
            found = self._jumped(self._waiting[0][0])
        elif by < 0 and self._came <= 2 * self._buffers.length:
            # The first buffer was late, and said when the others are due.
            self._expected += by * self._seconds()
            found = []
        elif by < 0:
            self.repeated -= by
            self._next += by
            self._expected += by * self._seconds()
            found = [_apart(self._waiting[0][0])]
        else:
            found = self._gap(by)
        due = [place for place, off in enumerate(self._offs()) if abs(off) < _HALF]
        return [*found, *self._taken_first(due[-1] + 1 if due else len(self._waiting))]

    def _taken_first(self, count: int) -> list[Row]:
        """Take so many of those that wait."""
        both = zip(self._waiting[:count], self._told[:count], strict=True)
        found = [self._taken(row, tells=tells) for row, tells in both]
        del self._waiting[:count], self._told[:count]
        self._earliest, self._latest_off = math.inf, -math.inf
        for off in self._offs():
            self._see_off(off)
        return found

    def _jumped(self, stamp: float) -> list[Row]:
        """Begin anew with a clock that was set, and return what keeps windows from what was before."""
        self.jumps += 1
        self._begin, self._stamped, self._same = stamp, 1, 0
        self._of_earlier_clock = self.repeated
        self.rate, self._next, self._expected = Rate(), 0, stamp
        return [_apart(stamp)]

    def _gap(self, missing: int) -> list[Row]:
        """Return so many samples that were lost."""
        found = [(self._expected + place * self._seconds(), math.nan, math.nan) for place in range(missing)]
        self.lost += missing
        self._next += missing
        self._expected += missing * self._seconds()
        return found

    def _taken(self, row: Row, *, tells: bool = True) -> Row:
        """Note a sample and its stamp, and follow the clock with it if it tells anything."""
        self._came += 1
        self.empty += not (math.isfinite(row[1]) and math.isfinite(row[2]))
        if math.isfinite(row[0]):
            self.rate.see(self._next, row[0])
            if math.isnan(self._expected):
                self._expected = row[0]
            late = max(-_HALF, min(_HALF, self._off(row, 0))) if tells else 0.0
            self._expected += _FOLLOW / self._buffers.length * late * self._seconds()
        self._next += 1
        self._expected += self._seconds()
        return row

    @property
    def comes_faster(self) -> str:
        """What to say where stamps show a higher rate than the nominal one, by which samples seem to come twice; nothing elsewhere."""
        # Lines that come again are no samples, but those of one buffer may be equal where nothing moves.
        stamped = self._stamped - (0 if self._has_buffers else self._same)
        repeated = self.repeated - self._of_earlier_clock
        if stamped < _ENOUGH or repeated < _MOST_REPEATED * stamped or self._newest <= self._begin:
            return ""
        rate = (stamped - 1) / (self._newest - self._begin)
        if rate < _FASTER / self._period:
            return ""
        nominal = 1 / self._period
        return (
            f"samples must come at the nominal rate; stamps show {rate:.7g} Hz, not {nominal:.6g}: parameters are wrong; "
            f"give --sample-rate {rate:.7g}"
        )

    def words(self) -> list[str]:
        """Return what there is to say of the clock."""
        nominal, period, error = 1 / self._period, self.rate.period, self._rate_error
        if not (math.isfinite(period) and period > 0 and math.isfinite(error)):
            said = [f"rate: {nominal:.6g} Hz nominal; no stamps to compare it with"]
        elif self.comes_faster:
            said = [f"rate: {self.comes_faster}"]
        else:
            drift, of_drift = (self._period / period - 1) * 1e6, error / period * 1e6
            said = [
                f"rate: {nominal:.6g} Hz nominal, {1 / period:.7g} Hz effective; drift {drift:+.1f} ± {of_drift:.1f} ppm"
            ]
            if abs(drift) > max(_NOTABLE * 1e6, 3 * of_drift):
                said.append(
                    f"the rate differs by {drift / 1e4:+.2g} %: inertia is off by twice that; give --sample-rate {1 / period:.7g}"
                )
        said.append(f"lost samples: {self.lost}")
        if self.lost > self._came:
            said.append(
                "more samples are missing than came: check the sample rate, and that times are in seconds or say their unit"
            )
        if self.twice:
            said.append(f"{self.twice} samples came twice, with the same stamp and the same values: left out")
        if self.repeated:
            said.append(
                f"{self.repeated} samples more came than their stamps or numbers have room for: repeated, late, or of another rate"
            )
        if self.back:
            said.append(
                f"{self.back} stamps are before the one that came last: samples are out of order, or the clock was set"
            )
        if self.jumps:
            said.append(f"the counter or clock jumped {self.jumps} times: no window goes over that")
        return said


def _differ(row: Row, other: Row) -> bool:
    """Return whether values differ; what is missing in one of them says nothing."""
    return any(abs(one - two) > 0 for one, two in zip(row[1:], other[1:], strict=True))


def _apart(stamp: float) -> Row:
    """Return a missing sample that keeps windows on either side of it apart."""
    return stamp, math.nan, math.nan
