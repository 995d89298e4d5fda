"""What the clock of a live recording has found, and how it is said."""

from __future__ import annotations

import math

from tvident._live.changes import RateChange
from tvident._live.rate import SCATTER, Rate

NO_MISTAKE = 0.1
"""How far a period may be from the nominal one without being a mistake."""

_ENOUGH, _MOST_REPEATED, _FASTER = 200, 0.1, 1.1
"""Stamps that say at which rate they come, the part of them that may come twice, and how much faster than nominal they may be then."""

WHOLE = 0.05
"""Periods by which a longer period is no whole number of them, at least, where no other samples can be missing."""

_TURNS = 0.05
"""Of the samples that are lost by turns, how many more or fewer are lost, at most, where it is still said."""

_FEW = 32
"""Buffers, or samples, that say how far a rate is off, at least."""

_CERTAIN = 3.0
"""Standard errors by which a rate is off, at least, before what it hides is said."""

_NOTABLE = 1e-3
"""Of the rate: inertia goes with its square."""


class ClockCounts:
    """Counts what a clock finds.

    Parameters
    ----------
    period : float
        Nominal seconds from sample to sample.

    Attributes
    ----------
    rate : Rate
        Since the clock was set.
    changes : list of RateChange
        Of the rate while the session ran.
    mistaken : int
        Samples that were taken for lost, or repeated, until it showed that the rate had changed.
    lost, repeated, jumps, back, twice, empty, unsure : int
        Samples that did not come and that came twice or too late, how often clock or counter were set, stamps that are before the last
        one by half a period or more, samples that were left out since they came twice with their stamps, that came without a number, and
        that were left out since they may be from before a loss.
    """

    def __init__(self, period: float) -> None:
        self._period = self._other = period
        """Nominal, and what stamps show where the nominal one is a mistake."""
        self.rate = Rate()
        self._counter: int | None = None
        self._begin = self._newest = math.nan
        self._came = self._stamped = self._same = self._of_earlier_clock = 0
        self._has_buffers = False
        self.changes: list[RateChange] = []
        self._thinned: RateChange | None = None
        """To a whole number of nominal periods, which lost samples explain as well."""
        self._is_thin = False
        """Whether the first samples came at another rate than the nominal one that is two thirds of it or less."""
        self.mistaken = 0
        self.lost = self.repeated = self.jumps = self.back = self.twice = self.empty = self.unsure = 0

    @property
    def comes_faster(self) -> str:
        """What to say where stamps show a higher rate than the nominal one, by which samples seem to come twice; nothing elsewhere."""
        # Lines that come again are no samples, but those of one buffer may be equal where nothing moves.
        if self._other < (1 - NO_MISTAKE) * self._period:
            return self._must_be(f"{1 / self._other:.4g}", "parameters are wrong")
        stamped = self._stamped - (0 if self._has_buffers else self._same)
        repeated = self.repeated - self._of_earlier_clock
        if stamped < _ENOUGH or repeated < _MOST_REPEATED * stamped or self._newest <= self._begin:
            return ""
        rate = (stamped - 1) / (self._newest - self._begin)
        return "" if rate < _FASTER / self._period else self._must_be(f"{rate:.7g}", "parameters are wrong")

    @property
    def comes_slower(self) -> str:
        """What to say where stamps show a lower rate than the nominal one, by which samples seem to be lost; nothing elsewhere."""
        periods = self._other / self._period
        if periods < 1 + NO_MISTAKE or abs(periods - round(periods)) < WHOLE:
            return ""
        return self._must_be(f"{1 / self._other:.4g}", "samples are up to half a step from their times")

    def _must_be(self, rate: str, but: str) -> str:
        nominal = 1 / self._period
        return f"samples must come at the nominal rate; stamps show {rate} Hz, not {nominal:.6g}: {but}; give --sample-rate {rate}"

    @property
    def differs(self) -> str:
        """What to say where the rate is not the nominal one by more than clocks are; nothing elsewhere."""
        period, error = self.rate.period, self.rate.error
        drift = self._period / period - 1 if period > 0 else math.nan
        if not (self.rate.count >= _FEW and abs(drift) > max(_NOTABLE, _CERTAIN * error / period)):
            return ""
        said = f"the rate differs by {100 * drift:+.2g} %: inertia is off by twice that; give --sample-rate {1 / period:.7g}"
        return f"{said}, unless {self.hidden} samples more are lost than are counted" if self.hidden else said

    @property
    def hidden(self) -> int:
        """Samples that are lost beside those that are counted, if the rate is the nominal one: stamps are too late to tell which."""
        rate = self.rate
        if not (rate.count >= _FEW and rate.scatter > SCATTER * self._period):
            return 0
        slower = rate.period - self._period
        return round(slower / self._period * (rate.last - rate.first)) if slower > _CERTAIN * rate.error else 0

    @property
    def changed(self) -> str:
        """What to say where the rate changed while the session ran; nothing elsewhere."""
        if not self.changes:
            return ""
        latest = self.changes[-1]
        times = f", the last of {len(self.changes)} times," if len(self.changes) > 1 else ""
        nominal = 1 / self._period
        said = f"the rate changed{times} at {latest.stamp:.1f} s {latest}: inertia is off by twice what that is off {nominal:.6g} Hz"
        if self.mistaken:
            said += f"; {self.mistaken} samples were taken for lost or repeated until it showed"
        return said

    @property
    def thinned(self) -> str:
        """What to say where the rate became a half, a third, ... of the nominal one, or samples are lost by turns; nothing elsewhere."""
        change = self._thinned
        if change is None:
            return self._thin_from_the_first
        turns = round(change.after / self._period)
        which = "every second sample is" if turns == 2 else f"{turns - 1} of {turns} samples are"  # noqa: PLR2004 - a half
        return (
            f"from {change.stamp:.1f} s on the rate seems to be {1 / change.after:.4g} Hz, or {which} lost: "
            f"counted as lost; if it is the rate, give --sample-rate {1 / change.after:.4g} from there on"
        )

    @property
    def _thin_from_the_first(self) -> str:
        """The same of a session that began so: said while as many of all its samples are lost as that rate leaves out."""
        periods = self._other / self._period
        turns = round(periods)
        by_turns = (turns - 1) * self._came
        is_whole = turns > 1 and abs(periods - turns) < WHOLE and self._came >= _ENOUGH
        if not (self._is_thin and is_whole and abs(self.lost - by_turns) <= _TURNS * by_turns):
            return ""
        rate = f"{1 / self._other:.4g}"
        return (
            f"{turns - 1} of {turns} samples are lost, from the first on, or the rate is {rate} Hz: "
            f"counted as lost; if it is the rate, give --sample-rate {rate}"
        )

    @property
    def warning(self) -> str:
        """What must be said while the session runs."""
        return self.comes_faster or self.comes_slower or self.thinned or self.changed or self.differs

    def words(self) -> list[str]:
        """Return what there is to say of the clock."""
        said = [*self._rate_words(), *self._loss_words()]
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

    def _rate_words(self) -> list[str]:
        """Return what there is to say of the rate."""
        nominal, period, error = 1 / self._period, self.rate.period, self.rate.error
        other = self.comes_faster or self.comes_slower
        if not (math.isfinite(period) and period > 0 and math.isfinite(error)):
            return [f"rate: {nominal:.6g} Hz nominal; no stamps to compare it with"]
        if other:
            return [f"rate: {other}", *([self.changed] if self.changed else [])]
        drift, of_drift = (self._period / period - 1) * 1e6, error / period * 1e6
        said = [
            f"rate: {nominal:.6g} Hz nominal, {1 / period:.7g} Hz effective; drift {drift:+.1f} ± {of_drift:.1f} ppm"
        ]
        said += [one for one in (self.changed, self.differs) if one]
        return said

    def _loss_words(self) -> list[str]:
        """Return what there is to say of samples that did not come."""
        if not self._stamped and self._counter is None:
            return [
                "lost samples: not known, since samples have neither stamps nor numbers; give --time or --counter if they have"
            ]
        if self.comes_slower:
            return ["lost samples: not known at another rate than the nominal one"]
        said = [f"lost samples: {self.lost}"]
        if self.thinned:
            said.append(self.thinned)
        if self.hidden:
            said.append(
                f"stamps come {1000 * self.rate.scatter:.2g} ms late and early, so that samples lost one by one look like a slower "
                f"clock: if its rate is the nominal one, {self.hidden} more are lost"
            )
        if self.unsure:
            said.append(
                f"{self.unsure} samples of buffers before which samples were lost are left out: they may be from before the loss"
            )
        if self.lost > self._came:
            said.append(
                "more samples are missing than came: check the sample rate, and that times are in seconds or say their unit"
            )
        return said
