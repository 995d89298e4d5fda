"""Times of samples: dates and durations become seconds, and times that were printed with few digits become uniform again."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._arguments.arrays import real_array
from tvident._arguments.containers import plain

Seconds = npt.NDArray[np.float64]

_YEAR = 31_556_952.0
"""Seconds."""

_PARTS = {"ns": ("nanoseconds", 1e17, "1e9"), "us": ("microseconds", 1e14, "1e6"), "ms": ("milliseconds", 1e11, "1e3")}
"""Parts of seconds, the times from which on they are no seconds, but, from the year 1973 on, these, and how many are a second."""

_FAR = 1e5
"""Sample periods from zero to the first sample, of a clock that began long before."""

_COUNTABLE = float(1 << 53)
"""Doubles count samples up to here."""

_LONGEST = 1e30
"""Seconds of a sample period, as in `sampling`."""

# How far a time stamp may lie from a uniform grid, as a fraction of the sample period.
_JITTER = 1e-3

_ROUNDINGS = 4
"""How often times may be rounded on their way."""

_FEW_TIMES = 100
"""Times of which a step is asked first: they deny most steps."""

_FEW_BEHIND = 8
"""Rows behind the last sample, at most, that programs write below their numbers."""

_TURNS = 2
"""How often a counter begins again, at least, for that to be seen."""

_FINE = 0.25
"""Of a period: the largest step of times whose digits behind the point differ."""

_DIGITS = 9
"""Digits behind the point that printed times may have: nanoseconds."""

_BLOCKS = 4096
"""Parts of a record of whose times the extremes are kept: they bound the period as all times do."""

_FEW_SHARED = 0.01
"""So few samples that have the time of another are mistakes, not times that are too coarse."""

_HALVINGS = 50

_NOT_AN_HOUR = 60.0
"""Seconds by which a step may differ from an hour and still be that of summer time."""

_SEARCHED = 1e-6
"""How closely the period is found, as a part of what times may be off."""


class NotUniformError(ValueError):
    """Times increase, but not by equal steps.

    Parameters
    ----------
    words : callable
        Returns the message. To make it takes longer than to see that steps differ, and whoever takes the times as they are needs none.
    times : ndarray
        In seconds.
    """

    def __init__(self, words: Callable[[], str], times: Seconds) -> None:
        super().__init__(words, times)
        self.times = times

    def __str__(self) -> str:
        return str(self.args[0]())

    def __repr__(self) -> str:
        return f"{type(self).__name__}({str(self)!r})"


def times_of(t: npt.ArrayLike) -> npt.NDArray[np.number]:
    """Return times in seconds: numbers as they are, dates and durations from the first on.

    Raises
    ------
    TypeError
        If they are no times.
    ValueError
        If one is missing.
    """
    values = _dates(plain("t", t))
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "mM":
        return real_array("t", values)
    if np.datetime_data(values.dtype)[0] in {"Y", "M"}:
        raise ValueError(
            f"t must have a unit of fixed length; got {values.dtype}, whose months differ; give seconds, or t.astype('datetime64[ns]')"
        )
    if np.isnat(values).any():
        place = int(np.flatnonzero(np.isnat(values))[0])
        raise ValueError(f"t must hold finite times; t[{place}] is missing (NaT); repair it")
    since = values - values.flat[0] if values.size else values.astype("m8[s]")
    return np.asarray(since / np.timedelta64(1, "s"))


def _dates(values: Any) -> Any:
    """Return dates of Python as NumPy has them, in UTC."""
    first = values[0] if isinstance(values, list | tuple) and values else values
    if isinstance(values, np.ndarray) and values.dtype.kind == "O" and values.size:
        first = values.flat[0]
    if isinstance(first, dt.datetime):
        utc = [one if one.tzinfo is None else one.astimezone(dt.UTC).replace(tzinfo=None) for one in values]
        return np.asarray(utc, dtype="M8[us]")
    if isinstance(first, np.timedelta64 | np.datetime64) and not isinstance(values, np.ndarray):
        return np.asarray(values)
    if isinstance(first, dt.timedelta) and not isinstance(first, np.timedelta64):
        return np.asarray(values, dtype="m8[us]")
    if isinstance(first, str) or (isinstance(values, np.ndarray) and values.dtype.kind in "SU"):
        raise TypeError(
            "t must hold numbers; got text; read it with np.asarray(t, dtype=float), dates with np.asarray(t, dtype='datetime64[us]')"
        )
    return values


def begin_of(t: npt.ArrayLike | None) -> float:
    """Return the time of the first sample in seconds: 0 where times are dates, or were not given."""
    return 0.0 if t is None else float(times_of(t).flat[0])


def period_of_times(t: npt.ArrayLike, samples: int) -> float:
    """Return the period of times that are uniform, within rounding or within the digits that they were printed with.

    Raises
    ------
    NotUniformError
        If they increase by steps that differ.
    ValueError
        If they do not increase, are missing or too coarse, or are not as many as the samples.
    """
    given = times_of(t)
    if given.ndim > 1 and given.size == max(given.shape):
        given = given.reshape(-1)
    if given.shape != (samples,):
        raise ValueError(
            f"t must hold one time for each of the {samples} samples; got shape {given.shape}; check its length"
        )
    if samples == 1:
        return 1.0
    kind = given.dtype if given.dtype.kind == "f" else np.dtype(np.float64)
    seconds = given.astype(np.float64, copy=False)
    size = np.abs(seconds)
    # Differences of times that are larger by far leave the range of doubles.
    bad = ~(size < _COUNTABLE * _LONGEST)
    if bad.any():
        place = int(np.flatnonzero(bad)[0])
        raise ValueError(f"t must hold finite times; t[{place}] is {seconds[place]}; repair it")
    period = float(seconds[-1] - seconds[0]) / (samples - 1)
    check_no_counts(seconds)
    if not period > 0:
        raise _not_increasing(seconds)
    distance = np.abs(seconds - (seconds[0] + period * np.arange(samples)))
    largest = float(size.max())
    if float(distance.max()) <= max(_JITTER * period, rounding(kind) * largest):
        return period
    slack = float(np.spacing(size.max().astype(kind)))
    quantum, bounds = _printed(seconds, period, slack, largest)
    # Times that most samples share may be of any rate.
    if quantum is None or bounds is None or not bounds[0] > 0:
        raise _not_uniform(seconds, distance, period)
    shortest, longest = bounds
    rate = _plainest(1 / longest, 1 / shortest)
    if quantum >= 1 / rate:
        raise _too_coarse(seconds, distance, period, quantum, rate)
    if longest / shortest - 1 > _JITTER:
        raise ValueError(
            f"t must tell the sample rate to a thousandth; printed in steps of {quantum:g} s it may be {1 / longest:.6g} to "
            f"{1 / shortest:.6g} Hz; give sample_rate={rate:.9g}, or what the recorder was set to, instead of t"
        )
    return 1 / rate


def check_no_counts(times: Seconds) -> None:
    """Refuse times so large that they count smaller parts of seconds since 1970, as clocks of computers do."""
    counted = counted_since_1970(float(times[0])) if times.size > 1 else None
    if counted is not None and abs(float(times[-1] - times[0])) < (times.size - 1) * float(times[0]) / _FAR:
        unit, words = counted
        parts, _, many = _PARTS[unit]
        raise ValueError(
            f"t must be in seconds; the first, {words}; if it counts {parts} since 1970, call it 'time [{unit}]', divide it by {many}, "
            f"or give time_unit={unit!r}"
        )


def counted_since_1970(first: float) -> tuple[str, str] | None:
    """Return the unit that a first time must be counted in, since it is too large for seconds, and why in words; None where it is not."""
    for unit, (_, least, _) in _PARTS.items():
        if first >= least:
            return unit, f"{first:.5g}, would be of the year {first / _YEAR + 1970:.0f} if it were seconds"
    return None


def _too_coarse(seconds: Seconds, distance: Seconds, period: float, quantum: float, rate: float) -> ValueError:
    """Return what to say of times whose digits are no finer than their steps."""
    if np.count_nonzero(np.diff(seconds) <= 0) <= _FEW_SHARED * seconds.size:
        return _not_uniform(seconds, distance, period)
    return ValueError(
        f"t must tell samples apart; it was printed in steps of {quantum:g} s, which several samples share; "
        f"give sample_rate={rate:.9g} instead of t"
    )


def _not_uniform(seconds: Seconds, distance: Seconds, period: float) -> ValueError:
    """Return what says where times are not uniform, and what to do."""
    if not (np.diff(seconds) > 0).all():
        return _not_increasing(seconds)
    return NotUniformError(partial(_uneven, seconds, float(distance.max()), period), seconds)


def _uneven(seconds: Seconds, farthest: float, period: float) -> str:
    """Return what to say of times that increase by steps that differ, of which one lies farthest from a uniform grid."""
    # The widest step tells where; the farthest sample may be an innocent one.
    steps = np.diff(seconds)
    usual = float(np.median(steps))
    place = int(np.abs(steps - usual).argmax()) + 1
    cure = "resample the record onto a uniform grid" + clock_changed(seconds[place] - seconds[place - 1])
    if farthest < period / 2:
        count = np.arange(seconds.size) - (seconds.size - 1) / 2
        rate = float(count @ count / (count @ (seconds - seconds[0])))
        cure += f", or give sample_rate={rate:.6g} if only the clock was read unevenly"
    return (
        f"t must be uniform; the step to t[{place}] = {seconds[place]:g} is {seconds[place] - seconds[place - 1]:g} s "
        f"where the others are {usual:g} s; {cure}"
    )


def _not_increasing(seconds: Seconds) -> ValueError:
    """Return what says where times do not increase, and what to do."""
    place = int(np.flatnonzero(np.diff(seconds) <= 0)[0]) + 1
    now, before = float(seconds[place]), float(seconds[place - 1])
    if now == before:
        return ValueError(
            f"t must increase; t[{place}] = {now!r} is that of the sample before; leave one of the two out, or give sample_rate= instead "
            "of t if samples were taken evenly"
        )
    cure = _cure_of_counter(seconds) or (
        f"sort the samples by time, or cut the record where its clock was set back{clock_changed(now - before)}"
    )
    behind = seconds.size - place
    if behind <= _FEW_BEHIND and seconds.size > _FEW_TIMES:
        rows = (
            "row, if it is no sample but a mean" if behind == 1 else f"{behind} rows, if they are no samples but means"
        )
        cure += f", or leave out the last {rows}, say"
    return ValueError(f"t must increase; t[{place}] = {now!r} comes after t[{place - 1}] = {before!r}; {cure}")


def _cure_of_counter(seconds: Seconds) -> str:
    """Return what to do about a counter that begins again and again after the same time; nothing where there is none."""
    steps = np.diff(seconds)
    back = steps < 0
    usual = float(np.median(steps))
    # The step over a turn is as any other, and the turn is taken off.
    turns = usual - steps[back]
    if np.count_nonzero(back) < _TURNS or usual <= 0 or not np.ptp(turns) < usual:
        return ""
    turn = float(np.median(turns))
    return (
        f"it goes back {turns.size} times by the same, as a counter does that begins again after {turn:.6g} s: unwrap it by that "
        f"(numpy.unwrap), or give sample_rate={1 / usual:.6g} if samples were taken evenly; if trials follow one another, cut the "
        "record where each begins and give a list of them"
    )


def clock_changed(step: float) -> str:
    """Return the cure where a step of time is that of a clock between summer and winter time."""
    hours = round(step / 3600)
    if abs(hours) != 1 or abs(step - 3600 * hours) > _NOT_AN_HOUR:
        return ""
    return "; a step of an hour is that of summer time: give times in UTC, in pandas .dt.tz_localize('Europe/Berlin', ambiguous='infer')"


def printed_step(seconds: Seconds) -> float:
    """Return the decimal step that times were printed in, 0 where they have too many digits for one."""
    largest = float(np.abs(seconds).max())
    return _quantum(seconds, float(np.spacing(largest)), largest) or 0.0


def rounding(kind: np.dtype[Any]) -> float:
    """Return how much times of a type may be rounded on their way, as a part of the largest."""
    return _ROUNDINGS * float(np.spacing(np.ones(1, kind))[0])


def irregular_at_sight(t: Any, samples: int) -> _core.RowTimes | None:
    """Return what the core saw of times that `period_of_times` would find not uniform, where one look at plain numbers shows it."""
    # A class of its own may hold a unit or a mask.
    if type(t) is not np.ndarray or t.dtype != np.float64 or t.shape != (samples,):
        return None
    seconds: Seconds = t
    check_no_counts(seconds)
    seen = _core.RowTimes(seconds)
    return seen if _is_irregular(seconds, seen) else None


def _is_irregular(seconds: Seconds, seen: _core.RowTimes) -> bool:
    """Tell whether increasing times are certainly not uniform."""
    largest = seen.largest()
    if seconds.size < 3 or not seen.increase() or not largest < _COUNTABLE * _LONGEST:  # noqa: PLR2004 - one step is uniform
        return False
    allowed = max(_JITTER * seen.length() / (seconds.size - 1), rounding(seconds.dtype) * largest)
    # Twice what is allowed: here distances are rounded in another way.
    if not seen.farthest() > 2 * allowed:
        return False
    # The largest may be printed with fewer digits behind the point than the others.
    last = seconds[-_FEW_TIMES:] if abs(seconds[-1]) >= abs(seconds[0]) else seconds[:_FEW_TIMES]
    slack = float(np.spacing(largest))
    return all(_quantum(some, slack, largest) is None for some in (last, seconds))


def _quantum(seconds: Seconds, slack: float, largest: float) -> float | None:
    """Return the decimal step that all times are multiples of, but for rounding; None where they have too many digits for one.

    The largest magnitude of the times is given.
    """
    # Most times are none of most steps, as few of them show.
    parts = (seconds[:_FEW_TIMES], seconds)
    for digits in range(_DIGITS + 1):
        allowed = slack * 10.0**digits
        if allowed > 0.1:  # noqa: PLR2004 - the numbers do not tell such steps
            return None
        bound = allowed + float(np.spacing(largest * 10.0**digits))
        if all(_off(part * 10.0**digits) <= bound for part in parts):
            return 10.0**-digits
    return None


def _printed(
    seconds: Seconds, period: float, slack: float, largest: float
) -> tuple[float | None, tuple[float, float] | None]:
    """Return the decimal step that times were printed in, and the shortest and the longest period that they may have."""
    quantum = _quantum(seconds, slack, largest)
    bounds = None if quantum is None else _periods(seconds, period, (1 + _SEARCHED) * quantum + 4 * slack)
    if bounds is not None:
        return quantum, bounds
    # Printed with so many digits from the first on, as %.6g does, the largest have the fewest behind the point.
    last = seconds[np.abs(seconds) >= 10.0 ** np.floor(np.log10(largest))]
    coarse = _quantum(last, slack, largest) if last.size >= _FEW_TIMES else None
    # A coarser one might hide that a sample is lost where times are small.
    if coarse is None or coarse > _FINE * period:
        return quantum, None
    return coarse, _periods(seconds, period, (1 + _SEARCHED) * coarse + 4 * slack)


def _off(scaled: Seconds) -> float:
    """Return how far numbers are from whole ones, at most."""
    return float(np.abs(scaled - np.rint(scaled)).max())


def _periods(seconds: Seconds, period: float, allowed: float) -> tuple[float, float] | None:
    """Return the shortest and the longest period at which times lie within one step from a grid; None where none does.

    Times that are cut off lie within one step of their digits, as rounded ones do.
    """
    count = np.arange(seconds.size, dtype=np.float64)
    slope = period + float(np.polyfit(count, seconds - seconds[0] - period * count, 1)[0])
    left = seconds - seconds[0] - slope * count
    some = np.unique([np.r_[part.argmin(), part.argmax()] + first for first, part in _blocks(left)])
    at, of = count[some], left[some]

    def spread(change: float) -> float:
        rest = of - change * at
        return float(rest.max() - rest.min())

    # The spread is convex: its least comes first, then where it becomes too large on either side.
    reach = 2 * allowed / max(1.0, float(at[-1]))
    low, high = -reach, reach
    for _ in range(_HALVINGS):
        one, other = low + (high - low) / 3, high - (high - low) / 3
        low, high = (low, other) if spread(one) < spread(other) else (one, high)
    best = (low + high) / 2
    if spread(best) > allowed:
        return None
    ends = []
    for outside in (best - reach, best + reach):
        near, far = best, outside
        for _ in range(_HALVINGS):
            middle = (near + far) / 2
            near, far = (middle, far) if spread(middle) <= allowed else (near, middle)
        ends.append(slope + near)
    return ends[0], ends[1]


def _blocks(values: Seconds) -> list[tuple[int, Seconds]]:
    size = max(1, values.size // _BLOCKS)
    return [(first, values[first : first + size]) for first in range(0, values.size, size)]


def _plainest(least: float, most: float) -> float:
    """Return the number between two that has the fewest digits: a rate that somebody set."""
    middle = (least + most) / 2
    for digits in range(-math.floor(math.log10(middle)), 17):
        unit = 10.0**-digits
        rounded = round(middle / unit) * unit if digits <= 0 else round(middle, digits)
        if least <= rounded <= most:
            return float(rounded)
    return middle
