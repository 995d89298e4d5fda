"""Time: the sample period, durations and lengths of windows."""

from __future__ import annotations

import math
import re
from typing import Any, cast

import numpy.typing as npt

from tvident._arguments.measured import knows_its_unit, measured
from tvident._arguments.numbers import finite_number, positive_number, whole_number
from tvident._arguments.shown import shown
from tvident._arguments.times import period_of_times
from tvident._units import times_in_seconds

_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0}


TOO_SHORT = 2e-7
"""A sample period in seconds, 5 MHz, that no recorder of motion has: it may be in days, as spreadsheets and datenum count."""

_DAY = 86_400.0

_WHOLE = 1e-4
"""By how much whole samples a second may be off, beside what the digits of times leave open."""

_SHORTEST, _LONGEST = 1e-30, 1e30
"""Sample periods in seconds: nothing is recorded faster or more slowly, and beyond them numbers leave the range of doubles."""

_MOST_DIGITS = 100
"""By how many powers of ten a derivative may be larger or smaller than the samples: doubles have 308, and squares are taken."""

_COUNTABLE = float(1 << 53)
"""Doubles count samples up to here."""


def sample_period(
    samples: int, *, delta: float | None = None, sample_rate: float | None = None, t: npt.ArrayLike | None = None
) -> float:
    """Return the sample period in seconds from whichever way it was given, 1 where it was not."""
    given = [name for name, value in (("delta", delta), ("sample_rate", sample_rate), ("t", t)) if value is not None]
    if len(given) > 1:
        raise TypeError(f"give only one of delta, sample_rate and t; got {' and '.join(given)}; drop all but one")
    if sample_rate is not None:
        rate = positive_number("sample_rate", sample_rate)
        if not 1 / _LONGEST <= rate <= 1 / _SHORTEST:
            raise ValueError(
                f"sample_rate must be between {1 / _LONGEST:g} and {1 / _SHORTEST:g} Hz; got {rate:g}; give samples per second"
            )
        return 1.0 / rate
    if t is not None:
        return _possible("the step of t", period_of_times(times_in_seconds(t), samples))
    return 1.0 if delta is None else _possible("delta", positive_number("delta", delta))


def may_be_days(step: float, rounded: float = 0.0) -> bool:
    """Return whether equal steps of times, taken as seconds, may be in days: shorter than any recorder's, or whole samples a second.

    Rates of 86.4 kHz and its multiples are those of no recorder. Of the step so much may be rounded, as a part of it.
    """
    if not step > 0:
        return False
    rate = 1 / (_DAY * step)
    return step <= TOO_SHORT or (round(rate) >= 1 and abs(rate - round(rate)) < _WHOLE + rounded * rate)


def in_unit_of_time(delta: Any, factor: float) -> float | None:
    """Return a sample period in seconds that was given in another unit of time; what says its unit itself needs no other.

    Raises
    ------
    TypeError
        If it says its unit itself.
    """
    if delta is None or factor == 1:
        return cast("float | None", delta)
    if knows_its_unit(delta):
        raise TypeError(f"delta says its unit itself; got {shown(delta)} beside time_unit=; leave time_unit out")
    return positive_number("delta", delta) * factor


def _possible(name: str, period: float) -> float:
    """Return a sample period that a record may have."""
    if not _SHORTEST <= period <= _LONGEST:
        raise ValueError(
            f"{name} must be between {_SHORTEST:g} and {_LONGEST:g} s; got {period:g}; give the sample period in seconds"
        )
    return period


def check_power(name: str, derivative: int, period: float) -> None:
    """Check that samples divided by this power of the sample period stay within the range of doubles."""
    if derivative * abs(math.log10(period)) > _MOST_DIGITS:
        most = math.floor(_MOST_DIGITS / abs(math.log10(period)))
        raise ValueError(
            f"{name} must be at most {most} with a sample period of {period:g} s, or the estimates leave the range of doubles; "
            f"got {derivative}; ask for a lower derivative or take another unit of time"
        )


def seconds(name: str, value: str) -> float:
    """Return the seconds of a duration such as ``"0.2 s"``."""
    duration = _time_in(value)
    if not (math.isfinite(duration) and duration > 0):
        units = ", ".join(_SECONDS)
        raise ValueError(f"{name} must be samples or a duration such as '0.2 s'; got {shown(value)}; units are {units}")
    return duration


def delay(name: str, value: object, *, word: str | None = None) -> float:
    """Return a time that may be negative, in seconds: from a number of them, or from a text with a unit such as ``"-2 ms"``.

    Where a word may stand in its place, the error names it.
    """
    if not isinstance(value, str):
        return finite_number(name, value)
    late = _time_in(value)
    if not math.isfinite(late):
        raise ValueError(
            f"{name} must be {f'{word!r}, ' if word else ''}seconds, or a time such as '2 ms'; got {shown(value)}; "
            f"units are {', '.join(_SECONDS)}"
        )
    return late


def _time_in(text: str) -> float:
    """Return the seconds of a number with a unit of time; NaN where a text is none."""
    # The Greek letter looks like the sign of a millionth.
    match = re.fullmatch(r"\s*([+-]?)\s*([0-9.eE+-]+)\s*([a-zµ]+)\s*", text.replace("\u03bc", "µ"))
    try:
        return float(match[1] + match[2]) * _SECONDS[match[3]] if match else math.nan
    except (KeyError, ValueError):
        return math.nan


def window_length(name: str, value: int | str, period: float, *, odd: bool) -> int:
    """Return a length in samples from a number of samples or a duration such as ``"0.2 s"``, or one that knows its unit."""
    duration = seconds(name, value) if isinstance(value, str) else _of_quantity(name, value)
    if duration is not None:
        samples = duration / period
        if not samples < _COUNTABLE:
            raise ValueError(
                f"{name} must be less than or equal to the length of the record; got {shown(value)}, which is {samples:g} samples; "
                "shorten it"
            )
        return max(1, 2 * round((samples - 1) / 2) + 1) if odd else max(1, round(samples))
    length = whole_number(name, value, least=1)
    if odd and length % 2 == 0:
        raise ValueError(
            f"{name} must be odd, so that every window has a sample at its centre; got {length}; "
            f"use {length - 1} or {length + 1}"
        )
    return length


def _of_quantity(name: str, value: object) -> float | None:
    """Return the seconds of a duration that knows its unit, None where a length is none."""
    duration = measured(name, value)
    if duration is not None and not (math.isfinite(duration) and duration > 0):
        raise ValueError(f"{name} must be samples or a duration above zero; got {shown(value)}; give '0.2 s', say")
    return duration


def length_given(name: str, value: object, *, odd: bool = False, least: int = 1) -> int | str:
    """Return a length as it was given, a number of samples or a duration, checked as far as it can be without a sample period."""
    if isinstance(value, str):
        seconds(name, value)
        return value
    duration = _of_quantity(name, value)
    if duration is not None:
        return f"{duration!r} s"
    length = whole_number(name, value, least=least)
    return window_length(name, length, 1.0, odd=odd)


def check_window(name: str, length: int, samples: int, *, least: int = 1) -> None:
    """Check that a window is long enough to be one and fits into the record."""
    if length < least:
        raise ValueError(f"{name} must be at least {least} samples; got {length}; use {least} or more")
    if length > samples:
        raise ValueError(
            f"{name} must be less than or equal to the length of the record; got {length} samples for a record of {samples}; "
            f"use at most {samples} samples or a longer record"
        )
