"""The clock of a live recording: its rate, its drift, and which samples were lost."""

from __future__ import annotations

import math

from tvident._live.changes import Looks, RateChange, Stretches
from tvident._live.counts import NO_MISTAKE, WHOLE, ClockCounts
from tvident._live.rate import HALF, LONGEST_BUFFER, MOVES, Buffers, Came, Lateness, Rate, RateLook, Row
from tvident._live.waiting import Waiting

_WAIT = 16
"""Samples that decide whether a stamp was late or early alone, or samples were lost or repeated before it; buffers, where samples come
in buffers whose stamps are late or early together."""

_LONGEST_WAIT = 2.0
"""Seconds that samples wait for buffers that decide, at most."""

_COARSE = 1.005
"""Periods from stamp to stamp, at least, where their last digit is longer than a period."""

_FOLLOW = 0.05
"""Part of a stamp's lateness by which the next one is expected later: the clock is followed over some 20 samples."""

_SET_BACK = 0.1
"""Seconds by which a stamp is before the last one, at least, where the clock was set."""

_KNOWN = 1e-3
"""Relative error of a period that is known well."""

_MOST_LOST = 1_000_000
"""A longer gap is no loss, but another recording."""

_ADDS_UP, _SURE = 0.1, 8.0
"""Periods that a wrong period may add up to while buffers are compared, and standard errors by which it is none of chance."""


class LiveClock(ClockCounts):
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
    """

    def __init__(self, period: float) -> None:
        super().__init__(period)
        self._look: RateLook | None = RateLook(period)
        """Until the first samples say at which rate they come."""
        self._looked = period
        """The period that they say."""
        self._waiting = Waiting()
        self._buffers = Buffers(max(1, int(LONGEST_BUFFER / period)))
        self._lateness = Lateness()
        self._looks, self._stretches = Looks(), Stretches()
        self._earlier = (math.nan, 0)
        """Of the clock before it was set: when a sample was due, and how many had come."""
        self._next = 0
        self._expected = self._last = math.nan
        self._before: Row = (math.nan,) * 3
        self._highest = 0
        self._latest: Row = (math.nan,) * 3
        self._shortest = math.inf
        """Seconds from one stamp to another."""
        self._alike: list[Row] = []
        """Samples that are like the one before them, stamp and values, until the next stamp says what they are."""

    def rows(self, row: Row, counter: float | None = None) -> list[Row]:
        """Take a sample, and return those that are in order now."""
        self.empty += not (math.isfinite(row[1]) and math.isfinite(row[2]))
        if counter is not None:
            self._note(row)
            return self._counted(row, counter)
        if self._look is None:
            return self._row(row)
        return self._looked_at() if self._look.has_seen(row) else []

    def _looked_at(self) -> list[Row]:
        """Return what is in order of the first samples, judged by the rate at which they come."""
        if self._look is None:
            return []
        look, self._look = self._look, None
        self._buffers = look.buffers.begun_again()
        if abs(look.period - self._period) < NO_MISTAKE * self._period:
            self._looked = look.period
        else:
            self._other = look.period
            self._is_thin = look.period > (1 + HALF) * self._period
        return [one for row in look.rows for one in self._row(row)]

    def _row(self, row: Row) -> list[Row]:
        """Take a sample without a number."""
        if row[0] == self._latest[0] and not _differ(row, self._latest):
            self._alike.append(row)
            return self._of_alike(came_twice=False) if len(self._alike) > _WAIT else []
        seconds, self._latest = row[0] - self._latest[0], row
        step = seconds / self._seconds()
        if step > MOVES:
            self._shortest = min(self._shortest, seconds)
        # Stamps with few digits are alike where two samples lie within one digit: none ever comes after a single period.
        has_few_digits = self._shortest > _COARSE * self._seconds()
        return [*self._of_alike(came_twice=MOVES < step < 1 + HALF and not has_few_digits), *self._next_rows(row)]

    def _of_alike(self, *, came_twice: bool) -> list[Row]:
        """Return what is in order of samples that are alike: nothing where they came twice."""
        alike, self._alike = self._alike, []
        if came_twice:
            self.twice += len(alike)
            return []
        return [one for row in alike for one in self._next_rows(row)]

    def _note(self, row: Row) -> None:
        """Note the stamp of a sample."""
        if not math.isfinite(row[0]):
            return
        self._begin = row[0] if math.isnan(self._begin) else self._begin
        self._stamped += 1
        if row[0] == self._before[0]:
            differs = _differ(row, self._before)
            self._has_buffers |= differs
            self._same += not differs
        self._newest, self._before = row[0], row

    def _next_rows(self, row: Row) -> list[Row]:
        """Take a sample that is none that came before, and return those that are in order now."""
        self._note(row)
        step = (row[0] - self._last) / self._seconds()
        if math.isfinite(row[0]):
            self._last = row[0]
        tells = self._buffers.see(step * self._seconds() / self._period)
        length = self._buffers.length
        # Stamps within a buffer are counted back at the nominal rate: where it is another, only the first tells anything.
        is_far = abs(self._seconds() / self._period - 1) * length > _ADDS_UP
        tells &= self._buffers.begins or step > 1 + HALF or length == 1 or not is_far
        self.back += step <= -HALF and length == 1
        far = -max(_WAIT, 2 * length, _SET_BACK / self._period)
        # A stamp that comes after a wrong one is where it was due.
        if step < far and not self._off(row, len(self._waiting.came)) > far:
            # Nothing before it says when this one is due.
            return [*self._settled_at_last(), *self._jumped(row[0]), self._taken(Came(row))]
        came = Came(row, tells, self._buffers.begins)
        found = self._changed(row[0]) if tells and (self._buffers.begins or length == 1) else []
        if found or (not self._waiting.came and not (tells and abs(self._off(row, 0)) >= HALF)):
            return [*found, self._taken(came)]
        self._waiting.add(came, self._off(row, len(self._waiting.came)))
        return self._decided()

    def _changed(self, stamp: float) -> list[Row]:
        """Return what waits if the latest samples show that another rate was taken for losses, of which there were none then."""
        # Where samples show that the nominal rate is a mistake, none is judged by another.
        if not math.isfinite(stamp) or self._other != self._period or self.rate.count < _WAIT:
            return []
        known = self._seconds()
        period = self._looks.see(self._came + len(self._waiting.came), stamp, known, self.rate.scatter)
        periods = period / self._period
        if period == known:
            return []
        begin, lost, repeated = self._looks.since(period)
        if periods > 1 + HALF and abs(periods - round(periods)) < WHOLE:
            # Stamps are the same where samples are lost by turns.
            self._thinned = self._thinned or RateChange(begin, known, period)
            return []
        if abs(period - self._period) >= NO_MISTAKE * self._period:
            # What is taken for lost, or repeated, keeps windows from samples that are up to half a step from their times.
            self._other = period
            self.changes.append(RateChange(begin, known, period))
            return []
        self.lost -= lost
        self.repeated -= repeated
        self.mistaken += lost + repeated
        found = self._taken_first(len(self._waiting.came))
        self._note_change(RateChange(begin, known, period), Rate())
        self._stretches, self._expected = Stretches(), stamp
        return found

    def _note_change(self, change: RateChange, rate: Rate) -> None:
        """Go on with another rate."""
        self.changes.append(change)
        self.rate, self._lateness, self._looks, self._looked = rate, Lateness(), Looks(), change.after

    def _decided(self) -> list[Row]:
        """Return what is in order of those that wait, once they say what was lost before them."""
        most = max(_WAIT, int(_LONGEST_WAIT / self._period))
        length = self._buffers.length
        enough = min(_WAIT * length, most)
        if self._waiting.is_due:
            return self._settled()
        if not self._have_waited(enough) and len(self._waiting.came) <= most:
            return []
        found = self._taken_first(self._waiting.late_alone(self._buffers.length, self._lateness))
        is_decided = self._is_no_chance() and self._have_waited(enough)
        return [*found, *self._settled()] if is_decided or len(self._waiting.came) > most else found

    def _have_waited(self, enough: int) -> bool:
        """Return whether so many wait, and 16 of them have stamps of their own."""
        return len(self._waiting.came) > enough and self._waiting.telling > _WAIT

    def _is_no_chance(self) -> bool:
        """Return whether those that wait are not all late, or early, by chance: single samples are not, if 16 are."""
        length = self._buffers.length
        if length == 1 or self._waiting.earliest < 0:
            return True
        return self._lateness.is_no_chance(self._waiting.earliest, len(self._waiting.came) / length)

    def rest(self) -> list[Row]:
        """Return what still waits, at the end: samples of one buffer say nothing of what was lost."""
        found = self._looked_at()
        found += self._of_alike(came_twice=not self._has_buffers)
        return [*found, *self._settled_at_last()]

    def _settled_at_last(self) -> list[Row]:
        """Return what waits for stamps that do not come any more."""
        found: list[Row] = []
        while waiting := self._waiting.came:
            is_usual = 0 < self._waiting.earliest <= self._waiting.latest <= self._lateness.usual
            is_one_buffer = waiting[-1].row[0] - waiting[0].row[0] < MOVES * self._seconds()
            if is_usual or is_one_buffer or 1 < len(waiting) <= 2 * self._buffers.length:
                found += self._taken_first(len(waiting))
            else:
                found += self._taken_first(self._waiting.late_alone(self._buffers.length, self._lateness))
                found += self._settled()
        return found

    def _counted(self, row: Row, counter: float) -> list[Row]:
        """Take a sample that says its number."""
        if not math.isfinite(counter):
            return [self._taken(Came(row))]
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
            return [*self._jumped(row[0]), self._taken(Came(row))]
        return [*self._gap(by - 1), self._taken(Came(row))]

    def _off(self, row: Row, place: int) -> float:
        """Return by how many periods a stamp comes late, with so many samples before it that wait; less than zero where it is early."""
        return (row[0] - self._expected) / self._seconds() - place

    def _seconds(self) -> float:
        """Return the period by which stamps are judged: what they show once they show it well."""
        shown, error = self.rate.period, self.rate.error
        differs = abs(shown - self._period)
        if not (error < _KNOWN * self._period and differs < NO_MISTAKE * self._period):
            return self._looked
        # Buffers are compared with 16 before them: what the period is off by adds up over these.
        is_known = error * _WAIT * self._buffers.length < _ADDS_UP * self._period or differs > _SURE * error
        return shown if is_known else self._looked

    def _settled(self) -> list[Row]:
        """Return what waits up to the last sample that is not off, or all of it, after what was lost before it."""
        found: list[Row] = []
        off = 0.0
        waiting = self._waiting
        if math.isfinite(waiting.earliest) and not waiting.is_due and self._is_no_chance():
            off = min(waiting.earliest, waiting.latest, key=abs)
        by = math.floor(off + HALF)
        first = waiting.came[0]
        if by > _MOST_LOST or (by > 0 and self._has_returned()):
            found += self._jumped(first.row[0])
        elif by < 0 and self._came <= 2 * self._buffers.latest:
            # The first buffer was late, and said when the others are due.
            self._expected += by * self._seconds()
            self._lateness = Lateness()
        elif by < 0:
            self._note_taken_for(by)
            self.repeated -= by
            self._next += by
            self._expected += by * self._seconds()
            found.append(_apart(first.row[0]))
        elif by > 0:
            self._note_taken_for(by)
            found += self._gap(by)
            self._leave_out_unsure()
        offs = enumerate(
            self._off(came.row, place) if came.tells else math.nan for place, came in enumerate(waiting.came)
        )
        due = [place for place, off in offs if abs(off) < HALF]
        return [*found, *self._taken_first(due[-1] + 1 if due else len(waiting.came))]

    def _note_taken_for(self, by: int) -> None:
        """Note that so many samples are counted as lost, or repeated, which may be another rate."""
        if self._other == self._period:
            self._looks.took_for_lost(self._came, by)

    def _has_returned(self) -> bool:
        """Return whether those that wait have stamps of the clock as it was before it was set."""
        due, came = self._earlier
        due += (self._came - came) * self._seconds()
        return abs(self._waiting.came[0].row[0] - due) < _SET_BACK

    def _leave_out_unsure(self) -> None:
        """Leave out the buffer before which samples were lost, for its stamps are counted back from when it was sent.

        Its first samples may have been taken before the loss.
        """
        if self._buffers.length == 1:
            return
        for place, (row, tells, begins) in enumerate(self._waiting.came):
            if begins and place:
                break
            self.unsure += math.isfinite(row[1]) and math.isfinite(row[2])
            self._waiting.came[place] = Came(_apart(row[0]), tells, begins)

    def _taken_first(self, count: int) -> list[Row]:
        """Take so many of those that wait."""
        if not count:
            return []
        (first, rest), self._waiting = self._waiting.parted(count), Waiting()
        found = [self._taken(came) for came in first]
        for place, came in enumerate(rest):
            self._waiting.add(came, self._off(came.row, place))
        return found

    def _jumped(self, stamp: float) -> list[Row]:
        """Begin anew with a clock that was set, and return what keeps windows from what was before."""
        self.jumps += 1
        self._begin, self._stamped, self._same = stamp, 1, 0
        self._of_earlier_clock, self._other = self.repeated, self._period
        self._earlier, self._lateness = (self._expected, self._came), Lateness()
        self.rate, self._next, self._expected = Rate(), 0, stamp
        self._looks, self._stretches = Looks(), Stretches()
        return [_apart(stamp)]

    def _gap(self, missing: int) -> list[Row]:
        """Return so many samples that were lost."""
        found = [(self._expected + place * self._seconds(), math.nan, math.nan) for place in range(missing)]
        self.lost += missing
        self._next += missing
        self._expected += missing * self._seconds()
        return found

    def _taken(self, came: Came) -> Row:
        """Note a sample and its stamp, and follow the clock with it if it tells anything."""
        self._came += 1
        row = came.row
        if math.isfinite(row[0]):
            if math.isnan(self._expected):
                self._expected = row[0]
            late = self._off(row, 0)
            # A stamp that is far too early or late is wrong; samples of a buffer are late together.
            is_right = late <= _SET_BACK / self._seconds() and (late >= -HALF or late >= -self._lateness.usual)
            if is_right and came.tells and (came.begins or self._buffers.length == 1):
                self.rate.see(self._next, row[0])
                if (found := self._stretches.see(self._next, row[0])) is not None:
                    self._note_change(*found)
                self._follow(late, came)
        elif math.isfinite(self._expected):
            row = (self._expected, *row[1:])
        self._next += 1
        self._expected += self._seconds()
        return row

    def _follow(self, late: float, came: Came) -> None:
        """Follow the clock with a sample that is so late: the mean of samples, which are late and early; buffers are only late."""
        if self._buffers.length == 1:
            self._lateness.note(late)
            self._expected += _FOLLOW * max(-HALF, min(HALF, late)) * self._seconds()
        elif came.begins:
            self._expected += self._lateness.see(late) * self._seconds()


def _differ(row: Row, other: Row) -> bool:
    """Return whether values differ; what is missing in one of them says nothing."""
    return any(abs(one - two) > 0 for one, two in zip(row[1:], other[1:], strict=True))


def _apart(stamp: float) -> Row:
    """Return a missing sample that keeps windows on either side of it apart."""
    return stamp, math.nan, math.nan
