"""Clocks in several columns: hour, minute and second, also behind year, month and day, are one channel of times."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from tvident._arguments import is_called_time
from tvident._files.channels import Channels, Say
from tvident._files.names import listed, printable
from tvident._files.second_words import PARTS, PER_SECOND, SECOND, without_clock
from tvident._units import named_unit

Numbers = npt.NDArray[np.float64]

_DATE, _CLOCK = ("year", "month", "day"), ("hour", "minute", "second")

_CALLED = {
    "year": re.compile(r"y|yr|years?|yyyy|jahr|ann[ée]e|año|ano|anno|jaar", re.IGNORECASE),
    "month": re.compile(r"M|MM|(?i:mo|mon|months?|monat|mois|mes|mese|maand)"),
    "day": re.compile(r"d|dd|days?|tag|jour|d[ií]a|giorno|dag", re.IGNORECASE),
    "hour": re.compile(r"h|hh|hrs?|hours?|std|stunden?|heures?|horas?|ore|ora|uur", re.IGNORECASE),
    "minute": re.compile(r"m|mm|(?i:mi|min|mins|minutes?|minuten?|minutos?|minut[io])"),
    "second": SECOND,
    **PARTS,
}
"""What columns of a clock are called: where a date stands beside, m may be the month, M the minute."""

_AGAIN = re.compile(r"_\d+$")
"""Behind a name that occurs twice."""

_LEAST = 3
"""Letters of a name without hours: m and s alone may be anything."""

_LEAST_AND_MOST = {
    "year": (0, 9999),
    "month": (1, 12),
    "day": (1, 31),
    "hour": (0, 24),
    "minute": (0, 59),
    "second": (0, 61),
}
"""A second may be a leap second; any but the last column of a clock is whole."""

_DAY, _HOUR = 86_400, 3600

_CENTURY = 2000
"""Of a year with two digits."""


def with_clocks_in_columns(channels: Channels, say: Say) -> Channels:
    """Return channels, of which columns of hours, minutes and seconds are one in their place, in seconds; which is said."""
    for group, columns in _clocks(channels):
        called = f"{group}time [s]"
        others = set(channels) - set(columns.values())
        if any(is_called_time(named_unit(name)[0].rpartition(".")[2]) for name in others if name.startswith(group)):
            continue  # a clock of its own tells more
        times = _seconds({part: channels[name] for part, name in columns.items()})
        if times is None:
            continue
        since, values = times
        say(
            f"{listed(list(columns.values()))} are the parts of one clock: read together as '{printable(called, 40)}', {since}"
        )
        first = next(name for name in channels if name in columns.values())
        return {
            called if name == first else name: values if name == first else one
            for name, one in channels.items()
            if name == first or name in others
        }
    return channels


def _clocks(channels: Channels) -> Iterator[tuple[str, Mapping[str, str]]]:
    """Give the columns that may be parts of a clock, by what they are, with the group before their names."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for name, values in channels.items():
        if values.ndim == 1 and values.size > 1 and values.dtype.kind in "iuf":
            called, unit = named_unit(name)
            group, dot, bare = called.rpartition(".")
            # Of time_sec the unit says which part it is.
            groups.setdefault(group + dot, []).append(
                (name, unit if is_called_time(bare) and name.endswith(f"_{unit}") else without_clock(bare))
            )
    for group, names in groups.items():
        one = _parts(names)
        if {"minute", "second"} <= one.keys() and len(set(one.values())) == len(one):
            yield group, _whole(one)


def _parts(names: Sequence[tuple[str, str]]) -> dict[str, str]:
    """Return which column is which part of a clock; of two that are called m or MM the first is the month."""
    found: dict[str, list[str]] = {part: [] for part in _CALLED}
    for name, bare in names:
        for part, pattern in _CALLED.items():
            if pattern.fullmatch(_AGAIN.sub("", bare)):
                found[part].append(name)
    both = list(dict.fromkeys([*found["month"], *found["minute"]]))
    if found["year"] and len(both) == 2 and 2 in {len(found["month"]), len(found["minute"])}:  # noqa: PLR2004 - month and minute
        found["month"], found["minute"] = ([one] for one in both)
    elif not found["year"] and not found["minute"]:
        found["minute"], found["month"] = found["month"], []
    if (
        not found["hour"]
        and max((len(name) for one in ("minute", "second") for name in found[one]), default=0) < _LEAST
    ):
        return {}
    return {part: each[0] for part, each in found.items() if len(each) == 1}


def _whole(found: Mapping[str, str]) -> Mapping[str, str]:
    """Return the parts of a clock without what does not go with the others: a date lacks nothing, and has hours."""
    parts: Sequence[str] = [*_CLOCK, *PER_SECOND] if "hour" in found else [*_CLOCK[1:], *PER_SECOND]
    if "hour" in found and set(_DATE) <= found.keys():
        parts = [*_DATE, *parts]
    return {part: found[part] for part in parts if part in found}


def _seconds(parts: Mapping[str, npt.NDArray[np.number]]) -> tuple[str, Numbers] | None:
    """Return since when, and seconds, that columns say together; None where they are no clock, which never goes back."""
    columns = {part: np.asarray(values, np.float64) for part, values in parts.items()}
    last = next(reversed(columns))
    for part, values in columns.items():
        least, most = _LEAST_AND_MOST.get(part, (0, PER_SECOND.get(part, 1) - 1))
        if not (values >= least).all() or not (values < most + 1).all():
            return None
        if part != last and (values != np.floor(values)).any():
            return None
    minutes = columns["minute"] * 60
    fractions = sum(
        (columns[part] / per_second for part, per_second in PER_SECOND.items() if part in columns), np.zeros(1)
    )
    times = columns.get("hour", np.zeros(1)) * _HOUR + minutes + columns["second"] + fractions
    if "day" in columns:
        days = _days(columns)
        if days is None:
            return None
        times = times + (days - days[0]) * _DAY
        first = np.datetime_as_string(np.datetime64("1970-01-01") + np.timedelta64(int(days[0]), "D"))
        since = f"from the midnight of {first} on"
    else:
        # At midnight, or at a full hour where there are no hours, a clock begins again.
        turn = _DAY if "hour" in columns else _HOUR
        times = times + turn * np.concatenate(([0], np.cumsum(np.diff(times) < -turn / 2)))
        since = "of the day" if "hour" in columns else "of the hour"
    steps = np.diff(times)
    return (since, times) if (steps >= 0).all() and (steps > 0).any() else None


def _days(columns: Mapping[str, Numbers]) -> Numbers | None:
    """Return days since 1970; None where a month has no such day."""
    years, months, days = (columns[part].astype(np.int64) for part in _DATE)
    years = np.where(years < 100, years + _CENTURY, years)  # noqa: PLR2004 - two digits
    begins = (years - 1970).astype("datetime64[Y]").astype("datetime64[M]") + (months - 1)
    found = begins.astype("datetime64[D]") + (days - 1)
    if (found.astype("datetime64[M]") != begins).any():
        return None
    return found.astype(np.int64).astype(np.float64)
