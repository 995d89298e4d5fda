"""How a text of columns is written: what separates its cells, where its numbers begin, what its columns hold."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Literal

from tvident._files.cells import Separator, is_comment, is_present, number, split, without_comment
from tvident._files.channels import MOST_CHANNELS, Say, check_count
from tvident._files.headers import Line, Names
from tvident._files.names import printable
from tvident._files.times import instant

_COMPARED = 20
"""Rows that are looked at to tell one separator from another, and what columns hold."""

_SEPARATORS: tuple[Separator, ...] = (",", ";", "\t", "|", None)
"""The earlier one where numbers are the same for several."""

_SEARCHED, _SEARCHED_FOR_WORDS = 100, 2000
"""Lines that are looked at for what makes them odd, and for the first of a table with columns of words."""

_NOTES, _FEW = 3, 10
"""Cells of a column that are notes beside the table, and rows that are more."""

_FEWEST_COUNTED = 3
"""Columns whose numbers are no chance."""

_MOSTLY = 0.9
"""Cells below numbers of columns that are fractions: some programs write 2 for 2.0."""

_TWICE = 2
"""How much longer than all others the first step of times may be, whose steps differ."""

_FRACTION = re.compile(r"\d[.,]\d")

_BEGINS_AS_NUMBER = re.compile(r"[+-]?[.,]?[0-9]")

_HOLDS_CELLS = re.compile(r"[,;]\s*[+-]?\d")
"""Words that hold cells: what separates these is no blank."""

Kind = Literal["number", "time", "words", "nothing"]
"""What a column holds in the first lines."""


@dataclass(frozen=True)
class Dialect:
    """How a text of columns is written."""

    separator: Separator
    first: int
    """Index of the first line of numbers."""
    names: list[str]
    """Of the columns, which are as many."""
    cells: int
    """In the first line of numbers: more than names where separators end its lines."""
    named: bool
    """Whether the names are from the file."""
    kinds: tuple[Kind, ...]
    """Of the columns."""
    times: dict[int, list[str]]
    """First cells of the columns that hold times."""
    above: frozenset[str] = frozenset()
    """Lines above the numbers that say something."""
    decimal: str | None = None
    """The decimal sign, where it is known."""

    @property
    def comma(self) -> bool:
        """Whether a comma may be a decimal sign, since other signs separate cells."""
        return self.separator != "," and self.cells > 1

    @property
    def is_plain(self) -> bool:
        """Whether all columns hold numbers."""
        return not {"time", "words"}.intersection(self.kinds)


@dataclass(frozen=True)
class _Start:
    separator: Separator
    first: int
    cells: list[str]
    agree: int


def dialect_of(lines: Sequence[str], say: Say) -> Dialect | None:
    """Return how the first lines of a text are written, or None where there is no line of numbers."""
    starts = _starts(lines)
    # Single numbers are lines of numbers only where nothing separates any; of equals the first.
    several = [one for one in starts if len(one.cells) > 1]
    most = max((one.agree for one in several or starts), default=0)
    # A note beside the first rows costs one separator a row or two, and blanks none, where empty cells are no cells.
    start = next(
        (one for one in several or starts if one.agree >= max(1, most - _NOTES if most > _FEW else most)), None
    )
    start = _with_words(lines) if start is None else replace(start, first=_back(lines, start.first, start.separator))
    if start is None:
        return None
    above = [Line(index, lines[index], start.separator) for index in range(start.first)]
    found = Names(start.separator, start.cells, [line for line in above if line.says_something], say)
    check_count(found.least)
    rows = _rows(lines, start)
    names = found.found(list(enumerate(lines[start.first :], start.first + 1))[:_SEARCHED])
    is_named, names = names is not None, names or [str(index) for index in range(len(start.cells))]
    kinds = tuple(_kind([row[column] for row in rows]) for column in range(len(names)))
    times = {column: [row[column] for row in rows] for column, kind in enumerate(kinds) if kind == "time"}
    said = frozenset(lines[line.place - 1].strip() for line in above if line.says_something)
    return Dialect(start.separator, start.first, names, len(start.cells), is_named, kinds, times, said)


def mixed_line(lines: Sequence[str]) -> str:
    """Return what keeps the first line that looks like a line of numbers from being one."""
    for index, line in enumerate(lines[:_SEARCHED]):
        for separator in _SEPARATORS:
            cells = split(line, separator)
            words = [cell for cell in cells if not _is_number(cell)]
            if words and all(_BEGINS_AS_NUMBER.match(cell) for cell in cells if cell):
                cure = "begin comments with #; " if "%" in words[0] or "//" in words[0] else ""
                return f"'{printable(words[0], 40)}' in line {index + 1} is no number, nor a time that is known; {cure}"
    return ""


def _is_number(cell: str) -> bool:
    """Return whether a cell holds a number, a time or nothing."""
    return number(cell, comma=True) is not None or instant(cell) is not None


def _starts(lines: Sequence[str]) -> list[_Start]:
    """Return the first line of numbers for every separator, unless it is far below that for another.

    A line that none below agrees with may be a date or a number above the table: the search goes on.
    """
    # A line is looked at from all lines above that none agrees with.
    numbers = cache(_numbers)
    found: dict[Separator, _Start] = {}
    last = len(lines)
    for index, line in enumerate(lines):
        if index > last:
            break
        for separator in _SEPARATORS:
            if separator in found and found[separator].agree > 1:
                continue
            cells = numbers(line, separator)
            below = lines[index + 1 : index + 1 + _COMPARED]
            if (
                not cells
                or _counts(cells, lines[:index], below, separator)
                or _are_above_names(cells, below, separator)
            ):
                continue
            following = [one for one in lines[index : index + 2 * _COMPARED] if without_comment(one).strip()]
            agree = _agreeing(cells, [numbers(one, separator) for one in following[:_COMPARED]])
            if separator not in found or agree > found[separator].agree:
                found[separator] = _Start(separator, index, cells, agree)
            if agree > 1:
                last = min(last, index + _COMPARED)
    return [found[separator] for separator in _SEPARATORS if separator in found]


def _agreeing(cells: Sequence[str], rows: Sequence[Sequence[str]]) -> int:
    """Return how many rows have as many cells, and times where these have times; the row itself is one of them."""
    as_long = [row for row in rows if len(row) == len(cells)]
    if len(as_long) == 1:
        return 1
    here = [instant(cell) is not None for cell in cells]
    return sum(_are_alike(here, cells, row) for row in as_long)


def _are_alike(are_times: Sequence[bool], cells: Sequence[str], row: Sequence[str]) -> bool:
    """Return whether a row has times where other cells have times."""
    return all(
        (instant(cell) is not None) == is_time or not (cell and other)
        for is_time, other, cell in zip(are_times, cells, row, strict=True)
    )


def _counts(cells: list[str], above: Sequence[str], below: Sequence[str], separator: Separator) -> bool:
    """Return whether cells are the numbers of columns, as written above them where nothing has a name.

    Without an empty cell before them the numbers below must be fractions: whole ones may be samples themselves. Below names, or where
    the first column goes on from them, they are the first sample.
    """
    columns = len(cells)
    if columns > 1 and cells == ["", *map(str, range(columns - 1))]:
        return True
    if columns < _FEWEST_COUNTED or cells not in ([str(first + one) for one in range(columns)] for first in (0, 1)):
        return False
    if any(_are_words(split(line.lstrip(" #"), separator), columns) for line in above):
        return False
    rows = [split(line, separator) for line in below if without_comment(line).strip()]
    if not rows or not all(map(_FRACTION.search, rows[0])) or len(rows[0]) != columns:
        return False
    fractions = sum(_FRACTION.search(cell) is not None for row in rows for cell in row)
    return fractions >= _MOSTLY * columns * len(rows) and not _goes_on(cells[0], [row[0] for row in rows])


def _are_above_names(cells: list[str], below: Sequence[str], separator: Separator) -> bool:
    """Return whether cells without a first one stand above a line of as many that holds no number, as numbers of bodies do."""
    following = next((line for line in below if without_comment(line).strip()), "")
    words = split(following, separator)
    return not cells[0] and len(words) == len(cells) and not any(map(_is_number, filter(None, words)))


def _are_words(cells: Sequence[str], columns: int) -> bool:
    """Return whether cells may be the names of so many columns."""
    return len(cells) == columns and all(cells) and not any(map(_is_number, cells))


def _goes_on(first: str, below: Sequence[str]) -> bool:
    """Return whether numbers rise from a first one, and from it no more than between them: times, or what counts samples."""
    values = [number(cell, comma=True) for cell in (first, *below)]
    steps = [after - before for before, after in pairwise(values) if before is not None and after is not None]
    return len(steps) > 1 and min(steps) > 0 and steps[0] <= _TWICE * max(steps[1:])


def _numbers(line: str, separator: Separator) -> list[str]:
    """Return the cells of a line of numbers, and none where it is not one or nothing is separated."""
    line = without_comment(line)
    if not line.strip() or (separator is not None and separator not in line):
        return []
    cells = split(line, separator)
    # A single number with a comma may be two, and words of several blanks no thousands.
    comma = (separator != "," or '"' in line) and len(cells) > 1
    if any(number(cell, comma=comma) is None and instant(cell) is None for cell in cells):
        return []
    return cells if any(_is_present(cell, comma=comma) for cell in cells) else []


def _is_present(cell: str, *, comma: bool) -> bool:
    return is_present(cell, comma=comma) or instant(cell) is not None


def _back(lines: Sequence[str], index: int, separator: Separator) -> int:
    """Return the first of the lines directly above the numbers that belong to them.

    In these all values are missing, or words stand in columns that are empty below: remarks about the first rows.
    """
    if separator is None:
        return index
    width = len(split(lines[index], separator))
    below = [
        cells for cells in (split(line, separator) for line in lines[index : index + _COMPARED]) if len(cells) == width
    ]
    kinds = [_kind([row[column] for row in below]) for column in range(width)]
    while index > 0 and separator in lines[index - 1] and not is_comment(lines[index - 1]):
        cells = split(lines[index - 1], separator)
        are_missing = all(number(cell, comma=True) is not None and not is_present(cell, comma=True) for cell in cells)
        if any(cell and not cell.strip("-*") for cell in cells):
            break  # a line drawn below the names, or units of which there are none
        if not are_missing and not _has_remark(cells, kinds):
            break
        index -= 1
    return index


def _has_remark(cells: Sequence[str], kinds: Sequence[Kind]) -> bool:
    """Return whether cells are a row below which some columns are empty that hold words here."""
    if len(cells) != len(kinds):
        return False
    here = [_kind([cell]) for cell in cells]
    fits = all(one in {"nothing", kind} or kind == "nothing" for one, kind in zip(here, kinds, strict=True))
    counts = [one for one in here if one != "nothing"]
    return (
        fits
        and any(one in {"number", "time"} and kind == one for one, kind in zip(here, kinds, strict=True))
        and "words" in counts
    )


def _with_words(lines: Sequence[str]) -> _Start | None:
    """Return the first line of a table in which some columns hold words: remarks, states, names."""
    best: _Start | None = None
    for separator in _SEPARATORS:
        # Words of a sentence are separated by blanks, too.
        least = 2 if separator is not None else 3
        for index in range(min(len(lines), _SEARCHED_FOR_WORDS)):
            if separator is not None and separator not in lines[index]:
                continue
            start = _start_with_words(lines, index, separator)
            if start is not None and start.agree >= least and start.agree > (0 if best is None else best.agree):
                best = start
            if best is not None and best.agree >= _COMPARED:
                return best
    return best


def _start_with_words(lines: Sequence[str], index: int, separator: Separator) -> _Start | None:
    cells = split(without_comment(lines[index]), separator)
    if not 1 < len(cells) <= MOST_CHANNELS or not any(map(_is_number, cells)):
        return None
    start = _Start(separator, index, cells, 0)
    rows = _rows(lines, start)
    kinds = [_kind([row[column] for row in rows]) for column in range(len(cells))]
    if not {"number", "time"}.intersection(kinds):
        return None
    for column, kind in enumerate(kinds):
        present = [row[column] for row in rows if row[column]]
        if kind in {"number", "time"} and not _is_number(cells[column]):
            return None  # names above, of which one is empty
        if kind == "words" and (any(map(_is_number, present)) or all(map(_BEGINS_AS_NUMBER.match, present))):
            return None
        if kind == "words" and separator is None and any(map(_HOLDS_CELLS.search, present)):
            return None
    return _Start(separator, index, cells, len(rows))


def _rows(lines: Sequence[str], start: _Start) -> list[list[str]]:
    """Return the cells of the first rows of a table, up to one of another length."""
    rows: list[list[str]] = []
    for line in lines[start.first : start.first + 2 * _COMPARED]:
        bare = without_comment(line)
        if not bare.strip():
            continue
        cells = split(bare, start.separator)
        if len(cells) != len(start.cells) or len(rows) == _COMPARED:
            break
        rows.append(cells)
    return rows or [start.cells]


def _kind(cells: Sequence[str]) -> Kind:
    """Return what the cells of a column are: by the first that holds something, words if any are."""
    kinds: list[Kind] = []
    for cell in cells:
        if is_present(cell, comma=True):
            kinds.append("number")
        elif number(cell, comma=True) is None:
            kinds.append("time" if instant(cell) else "words")
    if not kinds:
        return "nothing"
    if "words" in kinds and len(kinds) <= _NOTES and len(cells) > _FEW:
        return "words"
    # One odd cell among numbers is an error of that line.
    return "words" if all(kind == "words" for kind in kinds) else next(kind for kind in kinds if kind != "words")
