"""How a text of columns is written: what separates its cells, where its numbers begin, what its columns are called."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from tvident._files.cells import Separator, is_present, number, split, without_comment
from tvident._files.channels import FileError, Say, check_count
from tvident._files.names import listed, printable

_COMPARED = 20
"""Rows that are looked at to tell one separator from another."""

_SEPARATORS: tuple[Separator, ...] = (",", ";", "\t", None)
"""The earlier one where numbers are the same for several."""

_SEARCHED = 100
"""Lines that are looked at for what makes them odd."""

_BEGINS_AS_NUMBER = re.compile(r"[+-]?[.,]?[0-9]")

_UNITS = re.compile(
    r"-|1|%|[\[(].*[\])]|"
    r"([numkMGµμ]?(s|sec|m|g|N|V|A|Hz|rad|Pa|J|W|bar|N[ ·*.]?m)|deg|degrees|°|°C|K|min|h|rpm|counts|in|ft|lb|cm)"
    r"([/·*. ]?(s|rad|deg|m|kg|min)([\^²³]?-?\d?))?([\^²³]\d?)?"
)
_NAME = re.compile(r"[0-9]+")
"""A number that may be a name. Others are of a line of numbers in which something is wrong."""

_FRACTION = re.compile(r"0\d+")

_HINT = re.compile(r'"?sep=.?"?', re.IGNORECASE)
"""What a spreadsheet takes for the separator of what follows."""

CURE = "export the channels as columns of numbers with a point as the decimal sign"


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

    @property
    def comma(self) -> bool:
        """Whether a comma may be a decimal sign, since other signs separate cells."""
        return self.separator != "," and self.cells > 1


@dataclass(frozen=True)
class _Start:
    separator: Separator
    first: int
    cells: list[str]
    agree: int


def dialect_of(lines: Sequence[str], say: Say) -> Dialect | None:
    """Return how the first lines of a text are written, or None where there is no line of numbers."""
    starts = _starts(lines)
    if not starts:
        return None
    # Single numbers are lines of numbers only where nothing separates any; of equals the first.
    several = [one for one in starts if len(one.cells) > 1]
    start = max(several or starts, key=lambda one: one.agree)
    above = [_Line(index, lines[index], start.separator) for index in range(start.first)]
    return _Names(start, [line for line in above if line.says_something], say).dialect(lines)


def mixed_line(lines: Sequence[str]) -> str:
    """Return what keeps the first line that looks like a line of numbers from being one."""
    for index, line in enumerate(lines[:_SEARCHED]):
        for separator in _SEPARATORS:
            cells = split(line, separator)
            words = [cell for cell in cells if number(cell, comma=separator != ",") is None]
            if words and all(_BEGINS_AS_NUMBER.match(cell) for cell in cells if cell):
                return f"'{printable(words[0], 40)}' in line {index + 1} is no number; "
    return ""


def _starts(lines: Sequence[str]) -> list[_Start]:
    """Return the first line of numbers for every separator, unless it is far below that for another."""
    found: dict[Separator, _Start] = {}
    last = len(lines)
    for index, line in enumerate(lines):
        if index > last:
            break
        for separator in _SEPARATORS:
            cells = [] if separator in found else _numbers(line, separator)
            if cells and not _counts(cells):
                found[separator] = _start(lines, index, cells, separator)
                last = min(last, index + _COMPARED)
    return [found[separator] for separator in _SEPARATORS if separator in found]


def _start(lines: Sequence[str], index: int, cells: list[str], separator: Separator) -> _Start:
    following = [one for one in lines[index : index + 2 * _COMPARED] if without_comment(one).strip()]
    agree = sum(len(_numbers(one, separator)) == len(cells) for one in following[:_COMPARED])
    return _Start(separator, _back(lines, index, separator), cells, agree)


def _counts(cells: list[str]) -> bool:
    """Return whether cells are the numbers of columns, as written above them where nothing has a name."""
    return len(cells) > 1 and cells == ["", *map(str, range(len(cells) - 1))]


def _numbers(line: str, separator: Separator) -> list[str]:
    """Return the cells of a line of numbers, and none where it is not one or nothing is separated."""
    line = without_comment(line)
    if not line.strip() or (separator is not None and separator not in line):
        return []
    cells = split(line, separator)
    # A single number with a comma may be two.
    comma = separator != "," and len(cells) > 1
    if any(number(cell, comma=comma) is None for cell in cells):
        return []
    return cells if any(is_present(cell, comma=comma) for cell in cells) else []


def _back(lines: Sequence[str], index: int, separator: Separator) -> int:
    """Return the first of the lines directly above the numbers in which all values are missing."""
    while index > 0 and separator is not None and separator in lines[index - 1]:
        cells = split(lines[index - 1], separator)
        if any(number(cell, comma=True) is None or is_present(cell, comma=True) for cell in cells):
            break
        index -= 1
    return index


class _Line:
    """A line above the numbers."""

    def __init__(self, index: int, text: str, separator: Separator) -> None:
        self.place = index + 1
        self.is_comment = not without_comment(text).strip()
        bare = text.lstrip("# ") if self.is_comment else text
        self.says_something = any(one.isalnum() for one in bare) and not _HINT.fullmatch(bare.strip())
        self.cells = split(bare, separator)
        while self.cells and not self.cells[-1]:
            self.cells.pop()

    def names(self, most: int, least: int) -> list[str]:
        """Return its cells if they are as many as columns: with, or without empty ones."""
        every = self.cells
        present = [cell for cell in every if cell]
        if least <= len(every) <= most:
            return every
        return present if least <= len(present) <= most else []


class _Names:
    """Finds the names of columns in the lines above the numbers."""

    def __init__(self, start: _Start, above: Sequence[_Line], say: Say) -> None:
        self.start = start
        self.above = above
        self.say = say
        self.most = len(start.cells)
        self.least = max(index for index, cell in enumerate(start.cells) if cell) + 1

    def dialect(self, lines: Sequence[str]) -> Dialect:
        check_count(self.least)
        start = self.start
        names = self._found()
        if names is None:
            self._check_no_fractions(lines)
            return Dialect(start.separator, start.first, [str(i) for i in range(self.most)], self.most, named=False)
        return Dialect(start.separator, start.first, self._different(names), self.most, named=True)

    def _found(self) -> list[str] | None:
        """Return the names that stand nearest above the numbers, with units where these have a line of their own."""
        said = False
        for index in reversed(range(len(self.above))):
            line = self.above[index]
            names = line.names(self.most, self.least)
            if names:
                return self._with_units(self.above[index - 1] if index else None, line, names)
            if not line.is_comment and not said:
                self._check_no_numbers(line)
                said = True
        return None

    def _check_no_numbers(self, nearest: _Line) -> None:
        """Refuse a line that is no names: too few numbers, or too few names where a comma may be what makes numbers more."""
        words, comma = len(nearest.cells), self.start.separator != ","
        if all(number(cell, comma=comma) is not None for cell in nearest.cells):
            raise FileError(
                f"every line must have {self.most} cells; line {nearest.place} has {words}; repair it, or begin it with #"
            )
        if self.start.separator == ",":
            raise FileError(
                f"the line above the numbers must name every column; line {nearest.place} has {words}, and there are "
                f"{self.most}; {CURE} and one name for each, and begin lines that are not read with #"
            )
        self.say(
            f"line {nearest.place} is not read as names: it has {words} cells, and the lines of numbers {self.most}"
        )

    def _check_no_fractions(self, lines: Sequence[str]) -> None:
        """Refuse numbers without names that are as likely one number with a decimal comma."""
        if self.start.separator != ",":
            return
        rows = [split(line, ",") for line in lines[self.start.first : self.start.first + _SEARCHED] if line.strip()]
        if all(cell.isdecimal() for row in rows for cell in row):
            self.say("every comma separates two numbers; where it is the decimal sign, write points")
        for place, line in enumerate(lines[self.start.first : self.start.first + _SEARCHED], self.start.first + 1):
            suspect = next((cell for cell in split(line, ",")[1::2] if _FRACTION.fullmatch(cell)), None)
            if suspect is not None and self.most % 2 == 0:
                raise FileError(
                    f"without names of columns no number may begin with 0 as '{printable(suspect, 40)}' in line {place}, "
                    f"which may follow a decimal comma; {CURE}, and a first line that names them"
                )

    def _with_units(self, above: _Line | None, line: _Line, names: list[str]) -> list[str]:
        """Return names from the lines nearest to the numbers: the lower one may hold units, and no numbers."""
        upper = [] if above is None else above.names(self.most, self.least)
        comma = self.start.separator != ","
        if len(upper) == len(names) and all(_UNITS.fullmatch(cell) for cell in names if cell):
            bare = [cell.strip("[]()") for cell in names]
            return [f"{name} [{unit}]" if unit else name for name, unit in zip(upper, bare, strict=True)]
        if any(is_present(cell, comma=comma) for cell in names):
            if len(upper) == len(names) or not all(
                _NAME.fullmatch(one) for one in names if is_present(one, comma=comma)
            ):
                words = [one for one in names if number(one, comma=comma) is None]
                raise FileError(not_a_number(line.place, None, (words or names)[0]))
            self.say(f"line {line.place} is read as names of columns: {listed(names)}")
        elif above is not None and len(upper) == len(names) and above.place == line.place - 1:
            self.say(
                f"line {above.place} is not read as names: they are in line {line.place}, and it holds no known units"
            )
        return names

    def _different(self, names: Sequence[str]) -> list[str]:
        """Return names that differ: without one the number of the column, of equal ones the later with a number."""
        given, found, again = set(names), dict[str, None](), []
        for index, name in enumerate(names):
            bare = name or (f"column_{index}" if str(index) in given else str(index))
            unique, count = bare, 1
            while unique in found or (count > 1 and unique in given):
                count += 1
                unique = f"{bare}_{count}"
            if count > 1:
                again.append(f"column {index} is called {printable(unique, 40)}")
            found[unique] = None
        if again:
            self.say(f"several columns have one name: {listed(again)}")
        return list(found)


def not_a_number(place: int, name: str | None, cell: str) -> str:
    """Return the message about a cell that holds no number."""
    column = "" if name is None else f" in column '{printable(name, 40)}'"
    return (
        f"line {place} must hold numbers; it has '{printable(cell, 40)}'{column}; write 1234.5 without separators of "
        f"thousands, leave the cell empty where a value is missing, and begin comments with #"
    )
