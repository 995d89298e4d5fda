"""What columns of numbers are called: the lines above the numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence

from tvident._files.cells import Separator, are_joined, is_present, is_remark, number, split, without_comment
from tvident._files.channels import FileError, Say
from tvident._files.lone_time import with_lone_time, with_unit_of_times
from tvident._files.names import listed, printable
from tvident._files.oscilloscopes import names_of_keys
from tvident._files.row_names import have_row_names
from tvident._units import (
    ROTARY,
    is_convertible,
    is_unit,
    named_unit,
    unit_of,
    with_ending,
    with_unit,
    without_brackets,
)

CURE = "export the channels as columns of numbers with a point as the decimal sign"

_SEARCHED = 100
"""Lines that are looked at for what makes them odd."""

_NAME = re.compile(r"[0-9]+")
"""A number that may be a name. Others are of a line of numbers in which something is wrong."""

_FRACTION = re.compile(r"0\d+")

_HINT = re.compile(r'"?sep=.?"?', re.IGNORECASE)
"""What a spreadsheet takes for the separator of what follows."""

_TYPE = re.compile(r"(u?int|float|single|double|real|bool|byte|word|string|str|text|number|[iuf])\d*", re.IGNORECASE)
"""What a column holds, rather than what it is called."""


_KEY = re.compile(r"[A-Za-z][A-Za-z ]*=")
"""How LabChart begins a line that says one thing of every channel."""

_MARK = re.compile(r"\s*(?:#+|[%!]+(?=[\s\w\"])|//+)\s*")
"""What other programs begin a line with that holds no numbers."""

_OF_SCOPE = (
    "data-type",
    "sampletime[",
    "variablesize",
    "symbolbased",
    "symbolname",
    "unit",
    "unit-scalefactor",
    "offset",
    "scalefactor",
)
"""What a scope of TwinCAT says of every channel, below its name."""

_OF_PROJECT = re.compile(r"name|file|(start|end) ?time of export", re.IGNORECASE)
"""What it says of all, above."""

_UNITS_KEY = re.compile(r"(units?|einheit(en)?|unit[ée]s?|unidad(es)?)[. ]*[:=]?", re.IGNORECASE)
"""What may stand before units, in place of one."""

_SAYS_UNIT = re.compile(r"\b(units?|einheit(en)?|unit[ée]s?|unidad(es)?)\b", re.IGNORECASE)
_STATED = re.compile(r"[:=]")
"""How a line says the unit of a channel in words: what it is of, a sign, and the unit."""

_MOSTLY = 0.5
"""Part of a line's cells that are units which are known, where the others are units, too."""

_FEW_WORDS = 3
"""With a unit that is not known, of a name above a single column."""

_APART = re.compile(r"\t|\s{2,}")
_WHOLE_BRACKETS = re.compile(r'"[^"]*"|(?:\[[^\]]*\]|\([^)]*\)|[^\s"])+')
_WITH_BRACKETS = re.compile(r'(?:"[^"]*"|[^\s"]+)(?:\s(?:\[[^\]]*\]|\([^)]*\)))?')
"""How words that blanks separate belong together where there are more than columns."""

_RANGE = re.compile(r"[+-]?[\d.,]+\s+(\S.*)")


class Line:
    """A line above the numbers."""

    def __init__(self, index: int, text: str, separator: Separator) -> None:
        self.place = index + 1
        self.is_comment = not without_comment(text).strip()
        whole = split(text, separator)
        mark = None if bool(whole) and whole[0] == "%" and _are_units(whole) else _MARK.match(text)
        bare = text if mark is None else text[mark.end() :]
        is_hint = _HINT.fullmatch(bare.strip()) is not None or (not self.is_comment and is_remark(text))
        self.says_something = any(one.isalnum() for one in bare) and not is_hint
        self.cells = split(bare, separator)
        self._text = bare.strip() if separator is None else ""
        self.width = len(self.cells)
        """With empty cells at its end."""
        while self.cells and not self.cells[-1]:
            self.cells.pop()

    def names(self, most: int, least: int) -> list[str]:
        """Return its cells if they are as many as columns: with, or without empty ones."""
        every = self.cells
        present = [cell for cell in every if cell]
        if least <= len(every) <= most or (len(every) <= most and self.width >= least and _are_units(every)):
            return every  # the last columns may have no unit
        if least <= len(present) <= most:
            return present
        for words in (
            _APART.split(self._text),
            _WHOLE_BRACKETS.findall(self._text),
            _WITH_BRACKETS.findall(self._text),
        ):
            if self._text and most == 1 and len(words) > 1:
                # Above a single column words are one name, if it has a unit: others may be a title.
                unit = named_unit(self._text)[1]
                is_name = unit and (unit_of(unit) is not None or len(self.cells) <= _FEW_WORDS)
                return [self._text.strip("\"'")] if is_name else []
            if self._text and len(words) > 1 and least <= len(words) <= most:
                return [word.strip().strip("\"'") for word in words]
        return []

    def groups(self, columns: int) -> list[str]:
        """Return to which group each column belongs, where a name stands above the first of its columns alone, or above each."""
        if not 1 < self.width <= columns + 1 or len(self.cells) > columns:
            return []
        if self.width < columns and all(self.cells):
            # Without empty cells between, each stands above as many columns, or nobody knows.
            each = columns // self.width
            return [cell for cell in self.cells for _ in range(each)] if each * self.width == columns else []
        cells = self.cells + [""] * (columns - len(self.cells))
        groups = [""]
        for cell in cells:
            groups.append(cell or groups[-1])
        return groups[1:]


class Names:
    """Finds the names of columns in the lines above the numbers."""

    def __init__(self, separator: Separator, cells: Sequence[str], above: Sequence[Line], say: Say) -> None:
        """Take the cells of the first line of numbers, and the lines above it that say something."""
        self.separator = separator
        self.say = say
        self.most = len(cells)
        self.least = max(index for index, cell in enumerate(cells) if cell) + 1
        lines = with_lone_time(_without_keys(above, self.most))
        self.above = lines if separator is not None else with_unit_of_times(lines, self.most)

    def found(self, numbers: Sequence[tuple[int, str]]) -> list[str] | None:
        """Return the names of columns, which differ, or None where the file has none; lines of numbers come with their place."""
        names = self._found([line for _, line in numbers])
        if names is None:
            self._check_no_fractions(numbers)
            return None
        return self._different(names)

    def _found(self, numbers: Sequence[str]) -> list[str] | None:
        """Return the names that stand nearest above the numbers, with units where these have a line of their own."""
        said = False
        for index in reversed(range(len(self.above))):
            line = self.above[index]
            names = line.names(self.most, self.least)
            if names:
                found = self._of_block(index, names)
                self._say_unread_units(self.above[:index], found)
                return found
            if not said and have_row_names(line.cells, numbers, self.separator):
                self.say(
                    f"line {line.place} has a name less than the rows have cells: its names are of the second and later columns, "
                    f"as R and pandas write names of rows: {listed(line.cells)}"
                )
                return ["", *line.cells]
            if not line.is_comment and not said:
                self._check_no_numbers(line)
                said = True
        return None

    def _say_unread_units(self, above: Sequence[Line], names: Sequence[str]) -> None:
        """Say which lines above the names state units that no name has."""
        read = {named_unit(name)[1] for name in names}
        for line in above:
            what, *said = (part.strip() for cell in line.cells for part in _STATED.split(cell) if part.strip())
            if said and _SAYS_UNIT.search(what) and all(map(unit_of, said)) and not read.intersection(said):
                text = printable(" ".join(line.cells), 60)
                self.say(
                    f"line {line.place} is not read: '{text}'; units stand behind names, as in angle [deg], or in a line below them"
                )

    def _of_block(self, last: int, nearest: list[str]) -> list[str]:
        """Return names from the lines that have a cell for every column: names, units, types, and what is neither."""
        self._check_nearest(last, nearest)
        block = [(self.above[last], nearest)]
        for line in reversed(self.above[:last]):
            cells = line.names(self.most, self.least)
            numbers = [is_present(one, comma=self.separator != ",") for one in cells]
            # Channels may be called 1 and 2, where their units stand below.
            if not cells or all(numbers) or (any(numbers) and not (len(block) == 1 and _are_units(nearest))):
                break
            block.append((line, cells))
        width = max(len(cells) for _, cells in block)
        block = [(line, cells + [""] * (width - len(cells))) for line, cells in block]
        units = self._units(block)
        rest = [one for one in block if units is None or one[0] is not units[0]]
        named = [one for one in rest if not all(_TYPE.fullmatch(cell) for cell in one[1] if cell)] or rest
        differing = [one for one in named if _differ(one[1])]
        # The nearest, but where it names no unit and another one does.
        line, names = max(differing or named, key=lambda one: units is None and _units_named(one[1]))
        # Several tabs may align a name with its column.
        is_doubtful = self.separator != "\t" or not line.cells[0]
        if is_doubtful and len(line.cells) > self.most and sum(map(bool, line.cells)) == len(names):
            self.say(
                f"line {line.place} has {len(line.cells)} cells, and the lines of numbers {self.most}: its names are taken one after the "
                f"other, for columns from the first on: {listed(names)}"
            )
        names, groups = self._grouped(line, names)
        names = _completed(names, [cells for other, cells in rest if other is not line])
        for other, cells in rest:
            if other not in {line, *groups} and abs(other.place - line.place) <= len(block):
                why = "" if units else ", and it holds no known units"
                self.say(
                    f"line {other.place} is not read as names: they are in line {line.place}{why}: '{printable(', '.join(cells), 60)}'"
                )
        if units is None:
            return names
        return [_with_unit(name, unit) for name, unit in zip(names, units[1], strict=True)]

    def _units(self, block: list[tuple[Line, list[str]]]) -> tuple[Line, list[str]] | None:
        """Return the line that holds units: all its cells do, or, where others are unknown, most."""
        if len(block) < 2:  # noqa: PLR2004 - names and units
            return None
        known = next((one for one in block if _are_units(one[1])), None)
        if known is not None:
            return known
        shares = [_share_of_units(cells) for _, cells in block]
        share = max(shares)
        if share < _MOSTLY or shares.count(share) > 1:
            return None
        line, cells = block[shares.index(share)]
        is_keyed = _UNITS_KEY.fullmatch(cells[0]) is not None
        return line, ["" if is_keyed and not place else cell for place, cell in enumerate(cells)]

    def _grouped(self, line: Line, names: list[str]) -> tuple[list[str], list[Line]]:
        """Return names with the groups of columns that lines above them name, and these lines.

        Motion capture writes X, Y, Z below the name of an angle or a moment, which stands above the first of the three or above each.
        """
        used: list[Line] = []
        place = self.above.index(line)
        for above in reversed(self.above[:place]):
            groups = above.groups(len(names))
            is_above_some = len(above.cells) > 1 and not above.cells[0]
            if not groups or (_differ(names) and (used or not is_above_some)) or _are_units(above.cells):
                break
            if any(is_present(one, comma=True) for one in groups):
                break
            names = [f"{group}.{name}" if group and name else name for group, name in zip(groups, names, strict=True)]
            used.append(above)
        return names, used

    def _check_nearest(self, last: int, names: list[str]) -> None:
        """Refuse a line of numbers in which something is wrong."""
        line, comma = self.above[last], self.separator != ","
        above = self.above[last - 1].names(self.most, self.least) if last else []
        if not any(is_present(cell, comma=comma) for cell in names):
            return
        if above or not all(_NAME.fullmatch(one) for one in names if is_present(one, comma=comma)):
            words = [one for one in names if number(one, comma=comma) is None]
            raise FileError(not_a_number(line.place, None, (words or names)[0]))
        self.say(f"line {line.place} is read as names of columns: {listed(names)}")

    def _check_no_numbers(self, nearest: Line) -> None:
        """Refuse a line that is no names: too few numbers, or too few names where a comma may be what makes numbers more."""
        words, comma = len(nearest.cells), self.separator != ","
        joined = next((cell for cell in nearest.cells if are_joined(cell)), None)
        if joined is not None:
            raise FileError(
                f"something must stand between two numbers; line {nearest.place} has '{printable(joined, 40)}'; write a blank before "
                "every sign"
            )
        if all(number(cell, comma=comma) is not None for cell in nearest.cells):
            raise FileError(
                f"every line must have {self.most} cells; line {nearest.place} has {words}; repair it, or begin it with #"
            )
        if self.separator == "," and words < self.most <= 2 * words:
            raise FileError(
                f"the line above the numbers must name every column; line {nearest.place} has {words}, and there are {self.most}; {CURE}: "
                "where a comma is the decimal sign and separates cells, too, nobody can tell which is which; or write semicolons or tabs "
                "between cells, or numbers in quotes"
            )
        if self.separator == ",":
            raise FileError(
                f"the line above the numbers must name every column; line {nearest.place} has {words}, and there are "
                f"{self.most}; {CURE} and one name for each, and begin lines that are not read with #"
            )
        self.say(
            f"line {nearest.place} is not read as names: it has {words} cells, and the lines of numbers {self.most}"
        )

    def _check_no_fractions(self, lines: Sequence[tuple[int, str]]) -> None:
        """Refuse numbers without names that are as likely one number with a decimal comma."""
        if self.separator != ",":
            return
        rows = [split(line, ",") for _, line in lines[:_SEARCHED] if line.strip()]
        if all(cell.isdecimal() for row in rows for cell in row):
            self.say("every comma separates two numbers; where it is the decimal sign, write points")
        for place, line in lines[:_SEARCHED]:
            suspect = next((cell for cell in split(line, ",")[1::2] if _FRACTION.fullmatch(cell)), None)
            if suspect is not None and self.most % 2 == 0:
                raise FileError(
                    f"without names of columns no number may begin with 0 as '{printable(suspect, 40)}' in line {place}, "
                    f"which may follow a decimal comma; {CURE}, and a first line that names them"
                )

    def _different(self, names: Sequence[str]) -> list[str]:
        """Return names that differ: without one the number of the column, of equal ones the later with a number."""
        given, found, again = set(names), dict[str, None](), []
        for index, name in enumerate(names):
            bare = name or (f"column_{index}" if str(index) in given else str(index))
            unique, count = bare, 1
            while unique in found or (count > 1 and unique in given):
                count += 1
                unique = with_ending(bare, f"_{count}")
            if count > 1:
                again.append(f"column {index} is called {printable(unique, 40)}")
            found[unique] = None
        if again:
            self.say(f"several columns have one name: {listed(again)}")
        return list(found)


def _without_keys(above: Sequence[Line], most: int) -> list[Line]:
    """Return lines above the numbers, of those that begin with a key the names and the units alone, without their key."""
    of_scope = names_of_keys([line.cells for line in above], most)
    if of_scope:
        above[-1].cells = of_scope
        return [above[-1]]
    keyed = {
        line.cells[0].rstrip("= ").casefold(): line for line in above if line.cells and _KEY.fullmatch(line.cells[0])
    }
    titles = keyed.get("channeltitle")
    if titles is None:
        return _without_repeated_keys(above, most)
    # Times stand before the channels, and have no title.
    has_times = len(titles.cells) == most
    units = keyed.get("unitname", keyed.get("range"))
    for line, of_times in ((titles, "time"), (units, "s")):
        if line is not None:
            of_channels = [_RANGE.sub(r"\1", cell) if line is units else cell for cell in line.cells[1:]]
            line.cells = [of_times, *of_channels] if has_times else of_channels
    return [line for line in above if line not in keyed.values() or line in {titles, units}]


def _without_repeated_keys(above: Sequence[Line], most: int) -> list[Line]:
    """Return lines above pairs of times and samples, which begin every pair with what they say of it, as scopes of TwinCAT write them.

    Nothing else has a name, a sample time with its unit, and a unit or a type, of every pair.
    """
    keys = {line: _key_of_pairs(line, most) for line in above}
    keyed = {key: line for line, key in keys.items()}
    names, rates, units = keyed.get("name"), keyed.get("sampletime["), keyed.get("unit")
    if names is None or rates is None or (units is None and "data-type" not in keyed):
        return list(above)
    last = max(keyed[key].place for key in _OF_SCOPE if key in keyed)
    of_times = [named_unit(cell)[1] for cell in rates.cells[::2]]
    times = ["time" if units is not None else with_unit("time", unit) for unit in of_times]
    for line, of_pairs in ((names, times), (units, of_times)):
        if line is not None:
            cells = [*line.cells, *[""] * (most - len(line.cells))]
            line.cells = [cell if place % 2 else of_pairs[place // 2] for place, cell in enumerate(cells)]
    dropped = {line for line in above if keys[line] and names.place < line.place <= last}
    dropped |= {
        line for line in above if line.cells and line.place < names.place and _OF_PROJECT.fullmatch(line.cells[0])
    }
    return [line for line in above if line in {names, units} or line not in dropped]


def _key_of_pairs(line: Line, most: int) -> str:
    """Return what a line begins every pair of cells with, up to a bracket; nothing where it does not."""
    keys = line.cells[::2]
    begun = {"".join(key.partition("[")[:2]).casefold() for key in keys}
    return begun.pop() if most % 2 == 0 and len(keys) == most // 2 and len(begun) == 1 else ""


def _share_of_units(cells: Sequence[str]) -> float:
    """Return the part of the cells that are units, without one that says that units follow."""
    present = [cell for place, cell in enumerate(cells) if cell and not (place == 0 and _UNITS_KEY.fullmatch(cell))]
    units = [cell for cell in present if is_unit(cell) and (cell.strip("[](){}<> ").isalpha() or len(cell) > 1)]
    return len(units) / len(present) if present else 0.0


def _units_named(names: Sequence[str]) -> int:
    """Return how many names have a unit that is known."""
    return sum(unit_of(unit) is not None for unit in (named_unit(name)[1] for name in names) if unit)


def _completed(names: list[str], others: Sequence[Sequence[str]]) -> list[str]:
    """Return names, those that are empty from the nearest other line that has one."""
    found = list(names)
    for cells in others:
        for place, cell in enumerate(cells[: len(found)]):
            if not found[place] and cell and sum(one == cell for one in cells) == 1 and not _UNITS_KEY.fullmatch(cell):
                found[place] = cell
    return found


def _differ(cells: Sequence[str]) -> bool:
    """Return whether no two of the cells that hold something are equal."""
    return len({cell for cell in cells if cell}) == sum(map(bool, cells))


def _are_units(cells: Sequence[str]) -> bool:
    return all(map(is_unit, cells)) and any(one.isalpha() or one in "°%" for cell in cells for one in cell)


def _with_unit(name: str, unit: str) -> str:
    """Return a name with the unit of another line, unless it has one itself; what has no name and a unit of times is a time."""
    bare = without_brackets(unit)
    if not name and is_convertible(ROTARY, "time", bare):
        return with_unit("time", bare)
    return name if named_unit(name)[1] else with_unit(name, bare)


def not_a_number(place: int, name: str | None, cell: str) -> str:
    """Return the message about a cell that holds no number."""
    column = "" if name is None else f" in column '{printable(name, 40)}'"
    return (
        f"line {place} must hold numbers; it has '{printable(cell, 40)}'{column}; write 1234.5 without separators of "
        f"thousands, leave the cell empty where a value is missing, and begin comments with #"
    )


def not_a_time(place: int, name: str, cell: str) -> str:
    """Return the message about a cell of a column of times."""
    return (
        f"line {place} must hold a time in column '{printable(name, 40)}', as the lines above; it has '{printable(cell, 40)}'; write "
        f"12:30:00.5 or 2024-12-31T12:30:00.5"
    )


def may_be_frames(name: str, first: str) -> str:
    """Return the message about times that end in a third colon and one or two digits."""
    return (
        f"what stands behind a third colon must be milliseconds; in column '{printable(name, 40)}' it never has three digits, as in "
        f"'{printable(first, 40)}', and may be tenths or hundredths of a second or frames; write 12:30:00.05"
    )
