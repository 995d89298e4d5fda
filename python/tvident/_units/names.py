"""Names of channels that hold their units: ``angle [deg]``, ``Torque (Nmm)``, ``t/ms``, ``knee_angle_deg``."""

from __future__ import annotations

import re

from tvident._units.parse import unit_of
from tvident._units.symbols import DOUBTFUL

_IN_BRACKETS = re.compile(
    r"(.*?)[\s_/]*(?:\[([^\[\]]*)\]|\(([^()]*(?:\([^()]*\))?[^()]*)\)|\{([^{}]*)\}|<([^<>]*)>)\s*", re.DOTALL
)
_WITHIN = re.compile(r"(.*?)[\s_]*(?:\[([^\[\]]*)\]|(?<=[\s_])\(([^()]*)\)|\(([^()]{2,})\))[\s_]*(.*)", re.DOTALL)
"""A unit before or amid words. Without a blank before it, what stands in parentheses may be the argument of a function."""
_WIDE = str.maketrans("（）［］【】｛｝", "()[][]{}")  # noqa: RUF001 - as Japanese and Chinese programs write them
_BEHIND_A_SIGN = re.compile(r"(.+?)\s*(?:(?<![/\s])\s*/\s*|,\s*|\s+(?:in|en)\s+)([^,]+)", re.DOTALL)
_OF_NO_NAME = re.compile(r"in\s+([mnuµ]?s)")
"""How Rohde & Schwarz call times."""
_PATHS = ("s", "h")
"""Symbols of a path and of a height, which would be units elsewhere."""
_LONG = (
    "deg|degrees?|rad|radians?|mrad|urad|Nm|Nmm|Ncm|mNm|cNm|kNm|N[ _·*.-]mm?|kN|mN|lbf|(?:in|ft)[ _-]?lbf?|lbf?[ _-]?(?:in|ft)"
    "|ms|msecs?|milliseconds?|us|usecs?|microseconds?|ns|nsecs?|nanoseconds?|secs?|seconds?|mm|um|µm|rpm|°"
    "|Deg|Degrees?|DEG|DEGREES?|RAD|RADIANS?|MRAD|NMM|LBF|MM|RPM|MSECS?|MILLISECONDS?|SECS?|SECONDS?"
)
_BEHIND_A_LINE = re.compile(rf"(.+?)(?:_|\.\.+|\s+-\s+|\s+)({_LONG}|(?<=[_.])N(?=[_.]))[_.]?", re.DOTALL)
"""Units that are no name of anything else, behind a line or a blank; MATLAB and R write a line or a point for every bracket."""
_AMID_LINES = re.compile(
    r"(.+?)([_ ])(deg|degrees|DEG|rad|mrad|Nmm?|mNm|kNm|kN)[_ ](?!(?i:per|s|sec)(?:[\W_]|$))(.+)", re.DOTALL
)
_ALONE = re.compile(
    "deg|degrees?|Nmm?|mNm|kNm|kN|mm|rpm|m(?:illi)?secs?|u(?:sec)s?|micro(?:secs?|seconds?)|milliseconds?|secs?|seconds?|ms|millis|micros",
    re.IGNORECASE,
)
"""What is a channel's whole name where a program writes units for names."""
_OF_TIMES = re.compile(
    r"(.*(?i:time|zeit|stamp|elapsed).*?)"
    r"(?:(?:[_\s]+|\.\.+)((?i:s|[mun]s|[mun]?secs?|millis|micros|nanos))|(?<=[a-z])([MUN][sS]|Millis|Micros|Nanos))[_.]*",
    re.DOTALL,
)
_TIMES = {"millis": "ms", "micros": "us", "nanos": "ns"}
"""What Arduino calls its times."""
_BEHIND_A_WORD = re.compile(r"(.*[a-z])(Deg|Degrees|Rad|Radians|MRad|Nm|Nmm|Ms|Msec|Sec)")
"""The same at the end of a name that capitals divide into words."""
_OF_TORQUES = re.compile(
    r"(.*(?:torque|moment|effort|tau).*?)[_\s]+(nmm?|mnm|knm|pct|percent)", re.IGNORECASE | re.DOTALL
)
"""Units that would be lengths elsewhere."""
_OF_TURNS = re.compile(
    r"(.*(?:angle|position|rotation|theta|phi|winkel).*?)[_\s]+(turns|revs|revolutions|rev)", re.IGNORECASE | re.DOTALL
)
"""Turns that an angle is in; ``rev`` alone may mean another thing, and is asked for."""
_TURNS = {"turns": "turns", "revs": "revs", "revolutions": "revolutions", "rev": "rev?"}
_TORQUES = {"pct": "%", "percent": "%", "nm": "Nm", "nmm": "Nmm", "mnm": "mNm", "knm": "kNm"}


_OF_CURRENTS = re.compile(
    r"(?!.*(?i:phase))(.*(?i:current|strom|courant|corriente|corrente|voltage|spannung).*?)[_\s]+([mk]?[AV])", re.DOTALL
)
"""Units of one letter, which would be a second channel's elsewhere: A and B."""


def named_unit(name: str) -> tuple[str, str]:
    """Return a channel's name without its unit, and the unit; an empty string if it has none.

    What stands in brackets at the end is the unit, whatever it is, unless it is a number, which tells channels apart (``Y[0]``; a ratio is
    `` [1]``); elsewhere only what is known as one.
    """
    if not name.isascii():
        name = name.translate(_WIDE)
    found = _IN_BRACKETS.fullmatch(name)
    if found and found[1]:
        unit = next(one for one in found.groups()[1:] if one is not None).strip()
        if unit == "MS" and found[1].isupper():
            unit = "ms"  # all is in capitals, so that these say nothing
        inner, known = named_unit(found[1]) if unit_of(unit) is None else ("", "")
        if known and unit_of(known) is not None:
            return f"{inner} ({unit})", known
        return (name, "") if unit.isdecimal() and not name.endswith(" [1]") else (found[1], unit)
    within = _WITHIN.fullmatch(name)
    if within:
        unit = next(one for one in within.groups()[1:4] if one is not None).strip()
        words = " ".join(one for one in (within[1], within[5]) if one)
        return (words, unit) if words and (unit_of(unit) is not None or unit in DOUBTFUL) else _without_brackets(name)
    return _without_brackets(name)


def _without_brackets(name: str) -> tuple[str, str]:
    nameless = _OF_NO_NAME.fullmatch(name)
    if nameless or _ALONE.fullmatch(name):
        return ("time", nameless[1]) if nameless else (name, _TIMES.get(name.lower(), name))
    found = _BEHIND_A_SIGN.fullmatch(name)
    if found and _is_unit_of(found[2], found[1]):
        return found[1], found[2].strip()
    for pattern, units in ((_OF_TORQUES, _TORQUES), (_OF_TURNS, _TURNS)):
        found = pattern.fullmatch(name)
        if found:
            return found[1], found[2] if found[2] in DOUBTFUL else units[found[2].lower()]
    found = _OF_TIMES.fullmatch(name)
    if found:
        unit = (found[2] or found[3]).lower()
        return found[1], _TIMES.get(unit, unit)
    for pattern in (_OF_CURRENTS, _BEHIND_A_LINE, _BEHIND_A_WORD):
        found = pattern.fullmatch(name)
        unit = found[2].replace("_", "-") if found else ""
        if found and unit_of(unit) is not None and unit_of(name) is None:
            return found[1], unit
    found = _AMID_LINES.fullmatch(name)
    return (f"{found[1]}{found[2]}{found[4]}", found[3]) if found else (name, "")


def _is_unit_of(text: str, symbol: str) -> bool:
    """Return whether what stands behind a slash is the unit of the symbol before it: ``M/Nm``, ``s/mm``, but not ``m/s``."""
    unit = unit_of(text)
    if unit is None:
        # Refused: the first may mean degrees or gon, the others a million.
        return text.strip().lower() in {"grad", "altgrad"} or text.strip() in DOUBTFUL
    length = unit_of("m")
    is_length = length is not None and unit.dimension == length.dimension
    return unit_of(symbol) is None or unit_of(f"{symbol}/{text}") is None or (symbol in _PATHS and is_length)


def derivative_units(unit: str, count: int) -> list[str]:
    """Return the units of a channel and its derivatives by time in seconds; empty strings if the channel has none."""
    base = f"({unit})" if "/" in unit else unit
    powers = ["", "/s", *(f"/s^{order}" for order in range(2, count))]
    return [base + power if unit and power else unit for power in powers[:count]]


def with_unit(name: str, unit: str) -> str:
    """Return a name with a unit in brackets behind it, where there is one."""
    return f"{name} [{unit}]" if unit else name


def with_ending(name: str, ending: str) -> str:
    """Return a name with an ending, in front of its unit."""
    bare, unit = named_unit(name)
    return with_unit(f"{bare}{ending}", unit) if unit else f"{name}{ending}"
