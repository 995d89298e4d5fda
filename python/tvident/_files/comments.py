"""Comments that begin as those of MATLAB and of C do, behind numbers and between rows of them: written as those of all other texts."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from tvident._files.cells import is_comment

_BEHIND = re.compile(
    r"^(?P<row>[ \t]*[-+\d.,\"'](?:[-+\d.,;|:eEdDT \t\"']|/(?!/))*)(?P<mark>%|//|#)(?=[ \t]*[^\W\d_])", re.MULTILINE
)
"""Numbers, and what begins a comment of words: ``50 % 20 %`` are numbers with a unit."""

_ALONE = re.compile(r"^(?P<row>[ \t]*)(?:%|//)(?=[^\n]*[^\W\d_])[^\n]*", re.MULTILINE)

_BEGINS_AS_NUMBER = re.compile(r"[ \t]*[-+.]?\d")

_CELL = re.compile(r"[^\s,;|\"']+")

_SEPARATORS = ";\t|,"
"""Those that can be nothing else come first."""

_BETWEEN_BLANKS = re.compile(r"\d[ ]+[-+.\d]")

_LONGEST_ERROR = 20
"""Characters of what a spreadsheet writes where there is no number."""

_FEWEST_CELLS = 2
"""A number alone before a % may be one in percent, or belong to words: ``0 % load``."""

_MOSTLY = 0.5
"""Part of the rows: where more have such words, they may be a column."""


class Comments:
    """Finds comments in the pieces of a text whose first lines are known."""

    def __init__(self, head: str) -> None:
        rows = [line.rstrip(" \r") for line in head.splitlines() if _BEGINS_AS_NUMBER.match(line)]
        found = sum(_is_row(one) for one in _BEHIND.finditer(head)) if _may_hold(head) else 0
        # Where the last cell is mostly empty, it is one of words: "50 % load" there is no number of a sample.
        empty = sum(line.endswith((",", ";", "\t", "|")) for line in rows)
        self._are_column = max(found, empty) > _MOSTLY * len(rows)
        self._usual = {one: int(np.median([line.count(one) for line in rows])) for one in _SEPARATORS if rows}
        self._separator = next((one for one in _SEPARATORS if self._usual.get(one)), None)
        # A comma may be a decimal sign where blanks separate cells, too.
        if self._separator == "," and any(_BETWEEN_BLANKS.search(line) for line in rows):
            self._separator = None
        self._above: frozenset[str] = frozenset()

    def repeat(self, above: Iterable[str]) -> None:
        """Take the lines above the numbers: where one stands again, another recording begins, and that is no comment."""
        self._above = frozenset(above)

    def behind(self, text: str) -> str:
        """Return a text in which # begins what is behind numbers."""
        if self._are_column or not _may_hold(text):
            return text
        return _BEHIND.sub(lambda one: f"{self._row(one['row'])}#" if self._is_whole(one) else one[0], text)

    def _is_whole(self, found: re.Match[str]) -> bool:
        """Return whether what stands before a mark is a row, and not cells of it before one of words, as in ``0.5,0 % load,1.2``."""
        is_short = self._separator is not None and found["row"].count(self._separator) < self._usual[self._separator]
        return _is_row(found) and not is_short

    def _row(self, row: str) -> str:
        """Return numbers without the separator that only the comment behind them has."""
        row = row.rstrip(" ")
        while row[-1:] in self._usual and row.count(row[-1]) > self._usual[row[-1]]:
            row = row[:-1].rstrip(" ")
        return row

    def all(self, text: str) -> str:
        """Return lines of numbers in which # begins what is behind them, and lines that are comments."""
        if not _may_hold(text):
            return text
        return _ALONE.sub(lambda one: one[0] if one[0].strip() in self._above else "#", self.behind(text))


def _may_hold(text: str) -> bool:
    return "%" in text or "//" in text or "#" in text


def _is_row(found: re.Match[str]) -> bool:
    if found["mark"] == "#" and not is_comment(found.string[found.start("mark") : found.end() + _LONGEST_ERROR]):
        return False  # a spreadsheet's word for an error
    return len(_CELL.findall(found["row"])) >= _FEWEST_CELLS
