"""The clock of a live recording: its rate, its drift, and which samples were lost."""

from __future__ import annotations

import math
from dataclasses import dataclass

Row = tuple[float, float, float]
"""Time, angle, torque."""

_WAIT = 16
"""Samples that decide whether a stamp was late or early alone, or samples were lost or repeated before it."""

_HALF = 0.5
"""Periods: a stamp that is later belongs to the next sample."""

_MOVES = 0.25
"""Periods from stamp to stamp, at least, where they say how samples follow each other: those of one buffer are alike."""

_COARSE = 1.005
"""Periods from stamp to stamp, at least, where their last digit is longer than a period."""

_FOLLOW = 0.05
"""Part of a stamp's lateness by which the next one is expected later: the clock is followed over some 20 samples."""

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


class LiveClock:
    """Puts samples in order by their stamps, and what was lost between them as NaN.

    A stamp that is late alone, since a driver held it back, is followed by ones that are not; after a loss all are late, and after
    samples that came twice all are early. So a stamp that is off waits for the next 16, and whole periods that all of them are late are
    lost samples. With a counter nothing has to wait. Where samples came twice or the clock was set, one NaN keeps windows apart; a
    sample that comes twice with its stamp is left out, unless stamps say that both are of one buffer, or have too few digits to say it.

    Parameters
    ----------
    period : float
        Nominal seconds from sample to sample.

    Attributes
    ----------
    rate : Rate
        Since the clock was set.
    lost, repeated, jumps, back, twice : int
        Samples that did not come and that came twice or too late, how often clock or counter were set, stamps that are before the last
        one by half a period or more, and samples that were left out since they came twice with their stamps.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._waiting: list[Row] = []
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
        self.lost = self.repeated = self.jumps = self.back = self.twice = 0

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
        self.back += step <= -_HALF
        off = self._off(row, len(self._waiting))
        if step < -_WAIT:
            # Nothing before it says when this one is due.
            return [*self._settled_at_last(), *self._jumped(row[0]), self._taken(row)]
        is_due = not abs(off) >= _HALF or -_MOVES < step < _MOVES
        if not self._waiting and is_due:
            return [self._taken(row)]
        self._waiting.append(row)
        return self._settled() if len(self._waiting) > _WAIT or abs(off) < _HALF else []

    def rest(self) -> list[Row]:
        """Return what still waits, at the end: samples of one buffer say nothing of what was lost."""
        found = self._of_alike(came_twice=not self._has_buffers)
        return [*found, *self._settled_at_last()]

    def _settled_at_last(self) -> list[Row]:
        """Return what waits for stamps that do not come any more."""
        found: list[Row] = []
        while self._waiting:
            if self._waiting[-1][0] - self._waiting[0][0] < _MOVES * self._seconds():
                found += map(self._taken, self._waiting)
                self._waiting.clear()
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

    def _seconds(self) -> float:
        """Return the period by which stamps are judged: what they show once they show it well."""
        shown, error = self.rate.period, self.rate.error
        is_known = error < _KNOWN * self._period and abs(shown - self._period) < _NO_MISTAKE * self._period
        return shown if is_known else self._period

    def _settled(self) -> list[Row]:
        """Return what waits up to the sample that is off least, after what was lost before them."""
        off = [self._off(row, place) for place, row in enumerate(self._waiting)]
        least = min(range(len(off)), key=lambda place: abs(off[place]) if math.isfinite(off[place]) else math.inf)
        by = math.floor(off[least] + _HALF) if math.isfinite(off[least]) else 0
        if by > _MOST_LOST:
            found = self._jumped(self._waiting[0][0])
        elif by < 0:
            self.repeated -= by
            self._next += by
            self._expected += by * self._seconds()
            found = [_apart(self._waiting[0][0])]
        else:
            found = self._gap(by)
        found += [self._taken(row) for row in self._waiting[: least + 1]]
        del self._waiting[: least + 1]
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

    def _taken(self, row: Row) -> Row:
        """Note a sample and its stamp, and follow the clock with it."""
        self._came += 1
        if math.isfinite(row[0]):
            self.rate.see(self._next, row[0])
            if math.isnan(self._expected):
                self._expected = row[0]
            late = max(-_HALF, min(_HALF, self._off(row, 0)))
            self._expected += _FOLLOW * late * self._seconds()
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
        nominal, period, error = 1 / self._period, self.rate.period, self.rate.error
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
