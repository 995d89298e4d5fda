"""Lists of numbers in cells of text, as pandas writes messages of robots: ``"[0.1, 0.2]"`` is a cell for each number."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TextIO, cast

from tvident._files.cells import split
from tvident._files.channels import WIDEST_LIST, Say
from tvident._files.names import listed, printable
from tvident._units import with_ending

_NUMBER = r"(?:[+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?|nan|NaN|None|null)"
_BETWEEN = r"(?:\s*+[,;]\s*+|\s++)"
_LIST = re.compile(
    rf"""(?P<before>^|[,;\t|])[ ]*+"?[ ]*+(?:(?:np\.|numpy\.)?array\((?:'[df]',[ ]*+)?)?
    (?:\[\s*+(?P<square>{_NUMBER}(?:{_BETWEEN}{_NUMBER})*+)\s*+\]|\(\s*+(?P<round>{_NUMBER}(?:,\s++{_NUMBER})++)\s*+\))
    (?:,[ ]*+dtype=\w++)?\)?[ ]*+"?[ ]*+(?=[,;\t|\r\n]|$)""",
    re.VERBOSE,
)
"""A cell that is a list. In round brackets single numbers are negative ones of accountants, and a comma alone separates thousands."""

_SPLIT = re.compile(r"[,;\s]+")
_NOTHING = frozenset(("None", "null"))

_LINES = 200
"""Lines in which the first list is looked for."""


@dataclass(frozen=True)
class _Lists:
    """Which columns hold lists.

    Parameters
    ----------
    separator : str
    cells : int
        Of a line.
    widths : mapping of int to int
        How many numbers the list of each column holds.
    """

    separator: str
    cells: int
    widths: Mapping[int, int]

    def flat(self, line: str) -> str:
        """Return a line with a cell for every number, as it is where it holds no list."""
        return _LIST.sub(self._of_match, line)

    def _of_match(self, found: re.Match[str]) -> str:
        numbers = _SPLIT.split(found["square"] or found["round"])
        return found["before"] + self.separator.join("nan" if one in _NOTHING else one for one in numbers)

    def names(self, line: str, *, numbered: bool) -> str:
        """Return a line above the numbers, of which the cells of lists are there as often as these have numbers."""
        cells = split(line, self.separator)
        if len(cells) != self.cells:
            return line
        many: list[str] = []
        for place, cell in enumerate(cells):
            count = self.widths.get(place, 0)
            again = (
                [with_ending(cell, f".{one}") if numbered and cell else cell for one in range(count)]
                if count
                else [cell]
            )
            many += [f'"{one}"' if self.separator in one else one for one in again]
        return self.separator.join(many)


class WithoutLists:
    """A text whose lists in cells are cells: it is read in whole lines, piece by piece.

    Parameters
    ----------
    file : TextIO
    lists : _Lists
    above : int
        Lines above the first that holds a list.
    """

    def __init__(self, file: TextIO, lists: _Lists, above: int) -> None:
        self._file, self._lists, self._above = file, lists, above
        self.encoding = file.encoding
        self._line, self._is_named = 0, False

    def read(self, size: int) -> str:
        """Return whole lines, of about so many characters."""
        text = self._file.read(size)
        rest = self._file.readline(size) if text and not text.endswith("\n") else ""
        *whole, last = (text + rest).split("\n")
        return "".join(f"{self._flat(line)}\n" for line in whole) + (self._flat(last) if last else "")

    def readline(self, limit: int) -> str:
        """Return the next line."""
        return self._flat(self._file.readline(limit))

    def seek(self, place: int) -> int:
        """Begin again: another place is none of whole lines."""
        self._line, self._is_named = 0, False
        return self._file.seek(place)

    def _flat(self, line: str) -> str:
        self._line += 1
        if self._line > self._above:
            return self._lists.flat(line)
        bare = line.rstrip("\r\n")  # of a text in memory both may stand there
        flat = self._lists.names(bare, numbered=not self._is_named)
        # The names stand above units.
        self._is_named |= flat != bare
        return flat + line[len(bare) :]


def without_lists(file: TextIO, say: Say) -> TextIO:
    """Return a text with a cell for every number of its lists, which is said; the text itself where it holds none."""
    start = list(islice(iter(lambda: file.readline(1 << 16), ""), _LINES))
    file.seek(0)
    has_list = [_LIST.search(line) is not None for line in start]
    # A number in brackets may be a name, of which one line has some.
    place = next((place for place, one in enumerate(has_list) if one and all(has_list[place + 1 : place + 2])), None)
    if place is None:
        return file
    lists, names = _lists_in(start, place)
    if lists is None:
        return file
    shown = [f"'{printable(name, 40)}'" for name in names]
    say(f"cells of {listed(shown)} hold lists: each of their numbers is a column, called by its place")
    return cast("TextIO", WithoutLists(file, lists, place))


def _lists_in(lines: Sequence[str], place: int) -> tuple[_Lists | None, list[str]]:
    """Return which columns of a line hold lists, and what they are called."""
    matches = list(_LIST.finditer(lines[place]))
    signs = [one["before"] or lines[place][one.end() : one.end() + 1] for one in matches]
    if len({*signs} - {"", "\r", "\n"}) != 1:
        return None, []
    separator = next(sign for sign in signs if sign.strip("\r\n"))
    marked = _LIST.sub(lambda found: f"{found['before']}[]", lines[place])
    cells = split(marked, separator)
    columns = [column for column, cell in enumerate(cells) if cell == "[]"]
    widths = [len(_SPLIT.split(one["square"] or one["round"])) for one in matches]
    if len(columns) != len(widths) or max(widths) > WIDEST_LIST:
        return None, []
    rows = (split(line, separator) for line in lines[:place])
    above = next((row for row in rows if len(row) == len(cells)), [])
    names = [above[column] if above else str(column) for column in columns]
    return _Lists(separator, len(cells), dict(zip(columns, widths, strict=True))), names
