"""Times as text: times of day, dates, and both, as acquisition software writes them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from datetime import date
from typing import Literal

import numpy as np
import numpy.typing as npt

_CLOCK = r"(?:T|\s+)?(?P<h>\d{1,3}):(?P<m>[0-5]\d):(?P<s>[0-5]\d)(?:(?P<sep>[.,:])(?P<f>\d{1,12}))?\s*(?:(?P<half>[AaPp])\.?[Mm]\.?)?"
_ZONE = r"\s*(?P<zone>Z|UTC|GMT|[+-]\d\d(?::?\d\d)?)?"
_YEAR_FIRST = r"(?P<y>\d{4})(?P<sign>[-/.])(?P<mo>\d{1,2})(?P=sign)(?P<d>\d{1,2})"
_COMPACT = r"(?P<y>\d{4})(?P<mo>\d\d)(?P<d>\d\d)T(?P<h>\d\d)(?P<m>[0-5]\d)(?P<s>[0-5]\d)(?:[.,](?P<f>\d{1,12}))?"
_COMPACT_ZONE = r"(?P<zone>Z|[+-]\d\d(?::?\d\d)?)?"
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_MONTH_NAMED = rf"(?P<d>\d{{1,2}})[- ](?P<name>(?i:{'|'.join(_MONTHS)}))[- ](?P<y>\d{{4}})"
_SHORT_YEAR = r"(?P<d>\d{2})\.(?P<mo>\d{2})\.(?P<short>\d{2})"
_YEAR_LAST = r"(?P<a>\d{1,2})(?P<sign>[-/.])(?P<b>\d{1,2})(?P=sign)(?P<y>\d{4})"
_FORMS = tuple(
    re.compile(form, re.ASCII)
    for form in (
        _CLOCK,
        rf"{_YEAR_FIRST}(?:{_CLOCK}{_ZONE})?",
        rf"{_YEAR_LAST}(?:{_CLOCK}{_ZONE})?",
        r"(?P<m>\d{1,3}):(?P<s>[0-5]\d)[.,](?P<f>\d{1,12})",
        _COMPACT + _COMPACT_ZONE,
        # As files are called by sensors, where a colon is not allowed.
        rf"{_YEAR_FIRST}T(?P<h>\d\d)\.(?P<m>[0-5]\d)\.(?P<s>[0-5]\d)(?:\.(?P<f>\d{{1,12}}))?{_ZONE}",
        rf"{_MONTH_NAMED}(?:{_CLOCK}{_ZONE})?",
        # A date alone in this form may be three numbers of a version.
        rf"{_SHORT_YEAR}{_CLOCK}{_ZONE}",
    )
)
_DAY, _HOUR = 86_400, 3600

_DURATION = re.compile(
    r"(?P<value>[+-]?\d{1,12}(?:[.,]\d{1,15})?(?:[eE][+-]?\d{1,2})?)\s(?P<unit>ms|sec|min|hr|days?)", re.ASCII
)
"""How MATLAB writes a duration."""
_LASTS = {
    "ms": 10**6,
    "sec": 10**9,
    "min": 60 * 10**9,
    "hr": 3600 * 10**9,
    "day": 86_400 * 10**9,
    "days": 86_400 * 10**9,
}
_ENDS_OF_DURATIONS = frozenset(unit[-1] for unit in _LASTS)
_NEVER = 10**12
"""Seconds after which a duration begins again."""

_MILLI = 3
"""Digits of milliseconds."""


@dataclass(frozen=True)
class Instant:
    """What a cell says of time."""

    nanoseconds: int
    """Since midnight, or of the first day of the calendar where there is a date."""
    is_dated: bool
    wraps: int
    """Seconds after which a clock begins again."""
    counted: int = 0
    """Digits behind a third colon, which count parts of a second and are no fraction."""
    doubtful: tuple[int, int] | None = None
    """Day and month of a date that may be read in two ways."""


Order = Literal["day", "month"] | None
"""What comes first in a date with the year at its end."""


def instant(cell: str, order: Order = None) -> Instant | None:
    """Return the time that a cell holds, None where it holds anything else."""
    if cell[-1:] in _ENDS_OF_DURATIONS and (lasting := _DURATION.fullmatch(cell)):
        lasts = round(float(lasting["value"].replace(",", ".")) * _LASTS[lasting["unit"]])
        return Instant(lasts, is_dated=False, wraps=_NEVER)
    if not cell[:1].isdigit() or not (":" in cell or cell[-4:].isdigit() or cell[:4].isdigit()):
        return None
    for form in _FORMS:
        found = form.fullmatch(cell)
        if found:
            return _instant(found.groupdict(), order)
    return None


def _instant(part: dict[str, str | None], order: Order) -> Instant | None:
    fraction = part.get("f") or ""
    # Behind a third colon stand milliseconds, with as many digits as they have; only more than three are a fraction.
    counted = len(fraction) if part.get("sep") == ":" and len(fraction) <= _MILLI else 0
    within = int(f"{fraction:0>{_MILLI}}{'0' * 6}" if counted else f"{fraction:0<9}"[:9])
    hours = int(part.get("h") or 0)
    if part.get("half"):
        hours = hours % 12 + (12 if part["half"] in {"p", "P"} else 0)
    seconds = _HOUR * hours + 60 * int(part.get("m") or 0) + int(part.get("s") or 0)
    if part.get("short") is not None:
        part = {**part, "y": f"20{part['short']}"}
    if part.get("y") is None:
        wraps = _DAY if "h" in part else _HOUR
        return Instant(10**9 * seconds + within, is_dated=False, wraps=wraps, counted=counted)
    doubtful = None
    if part.get("a") is not None:
        first, second = int(part["a"] or 0), int(part["b"] or 0)
        if order is None and part["sign"] == "/" and max(first, second) <= 12 and first != second:  # noqa: PLR2004 - months
            doubtful = first, second
        is_month = order == "month" or (order is None and part["sign"] == "/" and second > 12)  # noqa: PLR2004 - months
        month, day = (first, second) if is_month else (second, first)
    else:
        name = part.get("name")
        month = _MONTHS.index(name.lower()) + 1 if name else int(part["mo"] or 0)
        day = int(part["d"] or 0)
    try:
        days = date(int(part["y"] or 0), month, day).toordinal()
    except ValueError:
        return None
    zone = part.get("zone") or "Z"
    if zone not in {"Z", "UTC", "GMT"}:
        minutes = int(zone[-2:]) if len(zone) > len("+01") else 0
        seconds -= (1 if zone[0] == "+" else -1) * (_HOUR * int(zone[1:3]) + 60 * minutes)
    return Instant(10**9 * (_DAY * days + seconds) + within, is_dated=True, wraps=0, counted=counted, doubtful=doubtful)


class TimeColumn:
    """Turns the times of a column into seconds: of the day, or where there are dates since the first."""

    def __init__(self, cells: list[str]) -> None:
        """Look at some cells of the column for the order of days and months."""
        self.first: str = ""
        self._base = 0
        self._dates: set[tuple[int, int]] = set()
        self._order: Order = None
        self._wraps = 0
        self._counted: set[int] = set()
        for cell in cells:
            found = _FORMS[2].fullmatch(cell)
            if found and found["sign"] == "/":
                self._order = "day" if int(found["a"]) > 12 else "month" if int(found["b"]) > 12 else self._order  # noqa: PLR2004 - months

    def seconds(self, cell: str) -> float:
        """Return the seconds of a cell, NaN where it is empty.

        Raises
        ------
        ValueError
            If it holds anything else.
        """
        found = instant(cell, self._order)
        if found is None:
            if cell.strip():
                raise ValueError(cell)
            return math.nan
        if not self.first:
            self.first = cell
            self._base = found.nanoseconds if found.is_dated else 0
            self._wraps = found.wraps
        if found.is_dated != (self._wraps == 0):
            raise ValueError(cell)
        self._counted.add(found.counted)
        if found.doubtful:
            self._dates.add(found.doubtful)
        return (found.nanoseconds - self._base) / 1e9

    @property
    def is_doubtful(self) -> bool:
        """Whether dates differ, and what is a day may be a month."""
        return len(self._dates) > 1

    @property
    def may_count_frames(self) -> bool:
        """Whether one or two digits stand behind the third colon of every time: milliseconds of a recording have three sooner or later."""
        return 0 < max(self._counted, default=0) < _MILLI

    @property
    def is_dated(self) -> bool:
        return bool(self.first) and self._wraps == 0

    def unwrapped(self, seconds: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], int]:
        """Return times that go on where the clock began again, and how often it did."""
        if not self._wraps:
            return seconds, 0
        valid = np.flatnonzero(np.isfinite(seconds))
        back = np.diff(seconds[valid]) < -0.5 * self._wraps
        if not back.any():
            return seconds, 0
        turns = np.zeros(seconds.size)
        turns[valid[1:]] = np.cumsum(back)
        return seconds + self._wraps * turns, int(back.sum())
