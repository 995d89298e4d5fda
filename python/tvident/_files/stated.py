"""What a text states of its sample rate in the lines above its numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from tvident._files.cells import decimal_sign, number
from tvident._files.channels import FileError
from tvident._files.dialect import dialect_of
from tvident._files.names import printable
from tvident._files.recordings import TEXT_ENDINGS
from tvident._files.text import read_start
from tvident._files.unpacked import ending_of
from tvident._units import rate_of

_SEARCHED = 100
"""Lines that are looked at."""

_RATE = re.compile(
    r"\W*(?:(?:sampl(?:e|ing)|acquisition|scan|logging)[ _.-]?(?:rate|freq(?:uency|\.)?)|(?P<short>fs)"
    r"|abtast(?:rate|frequenz)|mess(?:rate|frequenz)"
    r"|fr[ée]quence d['\u2019](?:[ée]chantillonnage|acquisition)|frecuencia de muestreo|frequenza di campionamento)\b",
    re.IGNORECASE,
)
"""A short name may mean another thing, as full scale: its unit tells."""

_PERIOD = re.compile(
    r"\W*(?:(?:sampl(?:e|ing)|scan|logging)[ _.-]?(?:interval|period)|abtast(?:intervall|periode|zeit)|dt|delta[ _]?t|sampletime(?=\[)"
    r"|p[ée]riode d['\u2019][ée]chantillonnage|per[ií]odo de muestreo|periodo di campionamento)\b",
    re.IGNORECASE,
)
_BEFORE_UNIT = r"(?<=\d)(?!e[+-]?\d)(?=[^\W\d_])"
"""Where a unit follows its number without a blank, as in 500Hz."""

_NUMBER = re.compile(r"-?\d|nan$|inf$", re.IGNORECASE)

_BEHIND_NAME = re.compile(r'(?:[\[(][^\])]*[\])])?"?\s*,')


@dataclass(frozen=True)
class StatedRate:
    """Samples per second that a file states, and the words in which it does."""

    rate: float
    words: str


def stated_rate(path: Path) -> StatedRate | None:
    """Return the sample rate that lines above the numbers of a text state; None where none does, or several differ."""
    stated = _stated_in(_above_numbers(path))
    return None if stated is None or math.isnan(stated.rate) else stated


def no_rate_stated(path: Path) -> str:
    """Return that a line above the numbers of a text states a sample rate or period which is none; nothing where none does."""
    stated = _stated_in(_above_numbers(path))
    return "" if stated is None or stated.rate > 0 else f"'{stated.words}' is no sample rate or period"


def _above_numbers(path: Path) -> list[str]:
    """Return the lines of a text above the first one of numbers; all of the first ones where none is, none where it is no text."""
    if ending_of(path).lower() not in TEXT_ENDINGS:
        return []
    try:
        lines = read_start(path).split("\n")[:_SEARCHED]
    except (OSError, FileError, UnicodeError):
        return []
    try:
        dialect = dialect_of(lines, lambda _: None)
    except FileError:
        return lines
    return lines if dialect is None else lines[: dialect.first]


def _stated_in(lines: Iterable[str]) -> StatedRate | None:
    """Return what lines state, with NaN where that is no rate; None where they state nothing, or several rates."""
    found = [
        StatedRate(rate, printable(" ".join(line.strip(" \t\r,;").split()), 60))
        for line in lines
        if (rate := _rate_in(line)) is not None
    ]
    rates = [one for one in found if not math.isnan(one.rate)]
    return next(iter(rates or found), None) if len({one.rate for one in rates}) <= 1 else None


def _rate_in(line: str) -> float | None:
    """Return the samples per second of a line that states them, or seconds per sample, and nothing else; NaN where they cannot be."""
    for pattern, is_rate in ((_RATE, True), (_PERIOD, False)):
        said = pattern.match(line)
        if said is None:
            continue
        # Scopes of TwinCAT state it of every channel.
        rest = line[said.end() :].replace(said[0], " ").strip()
        # A comma behind the name separates cells, as further ones then do; others may be decimal signs.
        between = r"[\s:;=\",]+" if _BEHIND_NAME.match(rest) else r"[\s:;=\"]+"
        cells = [one.strip("[](){}") for one in re.split(f"{between}|{_BEFORE_UNIT}", rest, flags=re.IGNORECASE)]
        numbers = {
            cell: value for cell in cells if (value := number(cell, comma=True)) is not None and _NUMBER.match(cell)
        }
        units = {cell for cell in cells if cell and cell not in numbers and cell.lower() != "in"}
        values = set(numbers.values())
        value = values.pop() if len(values) == 1 else None
        if value is None or any(decimal_sign(cell) == "?" for cell in numbers) or len(units) > 1:
            return None
        if said.groupdict().get("short") and not units:
            return None
        rate = rate_of(value if value > 0 else 1.0, next(iter(units), ""), is_rate=is_rate)
        return rate if value > 0 or rate is None else math.nan
    return None
