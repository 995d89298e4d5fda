"""Rows of numbers in text: in bulk where nothing is unusual, cell by cell where something is."""

from __future__ import annotations

import io
import math
import re

import numpy as np
import numpy.typing as npt

from tvident._files.cells import hides_numbers, is_present, number, split, without_comment
from tvident._files.channels import FileError, Say
from tvident._files.dialect import CURE, Dialect, not_a_number
from tvident._files.names import printable

Numbers = npt.NDArray[np.float64]

_CLEARLY_DECIMAL = re.compile(r"(?<!\d)0,\d|\d{4},\d|,\d{1,2}(?!\d)|,\d{4}")
"""Thousands are separated in groups of three behind one to three digits that do not begin with 0."""

_CLEARLY_POINTS = re.compile(r"(?<!\d)0?\.\d|\d{4}\.|\.\d{0,2}(?!\d)|\.\d{4}")
"""The same for points, which separate thousands where semicolons separate cells and no number has a comma."""

_MOST_WORDS = 20
"""Lines of words that may stand below the numbers."""

_BLANK_LINE = re.compile(r"(^|\n)[ \t]*\n")


class Rows:
    """Reads pieces of whole lines, one after the other."""

    def __init__(self, dialect: Dialect, say: Say) -> None:
        self._dialect = dialect
        self._say = say
        self._width = len(dialect.names)
        self._line = 0
        """Of the text, before the next piece."""
        self._blank = 0
        """Last line that was empty in a text of one column."""
        self._words: tuple[int, str] | None = None
        """First line of words below the numbers: the end of the table, if no numbers follow."""
        self._words_end = 0
        self._points = self._commas = 0
        """First line that has a number with this decimal sign."""
        self._is_decimal = False
        self._may_be_thousands = False
        """A point was found, and all of them may separate thousands."""
        self._are_points = dialect.separator != ";"

    def skip(self, lines: int) -> None:
        self._line += lines

    def read(self, text: str) -> Numbers:
        """Return the rows of some whole lines."""
        check_text(text, self._line)
        # Numbers below words are an error, and so are empty lines in a single column: line by line both are found.
        unusual = self._words is not None or hides_numbers(text)
        unusual |= self._width == 1 and (self._blank > 0 or _BLANK_LINE.search(text) is not None)
        found = None if unusual else self._in_bulk(text)
        lines = text.count("\n")
        if found is None:
            found = self._line_by_line(text.split("\n")[: lines + 1])
        if not self._are_points and "." in text:
            self._are_points = _CLEARLY_POINTS.search(text) is not None
            self._may_be_thousands = True
        self._line += lines
        return found

    def finish(self) -> None:
        """Check what only the whole text shows, and say what was not read."""
        if self._commas and not self._is_decimal:
            raise FileError(
                f"a comma in line {self._commas} may be a decimal sign or separate thousands, as all others in this file; {CURE}"
            )
        if self._may_be_thousands and not self._are_points:
            self._say(
                "every point has three digits behind it; it is read as the decimal sign, not as a separator of thousands"
            )
        if self._words is not None:
            first, words = self._words
            where = f"line {first}" if first == self._words_end else f"lines {first} to {self._words_end}"
            self._say(f"{where} below the numbers: not read, it holds words: '{printable(words, 60)}'")

    def _in_bulk(self, text: str) -> Numbers | None:
        """Return the rows of a text that holds nothing but numbers, None where something else may be in it."""
        has_points, has_commas = "." in text, self._dialect.comma and "," in text
        if (has_points or self._points) and (has_commas or self._commas):
            return None  # to find the lines
        if has_commas:
            self._is_decimal |= _CLEARLY_DECIMAL.search(text) is not None
            text = text.replace(",", ".")
        found = self._without_empty_cells(text)
        # A number too large for 64 bits becomes infinite there.
        if found is None or np.isinf(found).any():
            return None
        if has_commas:
            self._commas = self._commas or self._line + 1
        elif has_points and self._dialect.comma:
            self._points = self._points or self._line + 1
        return found

    def _without_empty_cells(self, text: str) -> Numbers | None:
        """Return the rows of a text of numbers and empty cells."""
        d = self._dialect
        between = "" if d.separator is None else re.escape(d.separator)
        if d.cells == self._width + 1 and between:
            text = re.sub(f"{between} *\n", "\n", text)
        if not text.strip():
            return np.empty((0, self._width))
        found = self._loaded(text)
        if found is None and between and '"' not in text:
            empty = f"(?<={between}) *(?={between}|\n|$)|^(?={between})"
            found = self._loaded(re.sub(empty, "nan", text, flags=re.MULTILINE))
        if found is None or (found.size and found.shape[1] != self._width):
            return None
        return found.reshape(-1, self._width)

    def _loaded(self, text: str) -> Numbers | None:
        try:
            return np.loadtxt(
                io.StringIO(text),
                delimiter=self._dialect.separator,
                comments="#" if "#" in text else None,
                quotechar='"' if '"' in text else None,
                ndmin=2,
            )
        except (ValueError, UserWarning):
            return None

    def _line_by_line(self, lines: list[str]) -> Numbers:
        rows = []
        for place, whole in enumerate(lines, self._line + 1):
            line = without_comment(whole)
            if not line.strip():
                if self._width == 1 and place < self._line + len(lines) and not whole.lstrip().startswith("#"):
                    self._blank = place
                continue
            row = self._row(place, line)
            if row is not None:
                rows.append(row)
        return np.array(rows, dtype=np.float64).reshape(-1, self._width)

    def _row(self, place: int, line: str) -> list[float] | None:
        """Return the numbers of a line, or None where it holds words that may be the end of the table."""
        d = self._dialect
        cells = split(line, d.separator)
        while len(cells) > self._width and not cells[-1]:
            cells.pop()
        values = self._plain(line, cells)
        if values is None:
            if self._is_end(cells):
                self._words = self._words or (place, line.strip())
                self._words_end = place
                if place - self._words[0] < _MOST_WORDS:
                    return None
                raise FileError(not_a_number(self._words[0], None, self._words[1]))
            self._check_width(place, line, cells)
            values = self._cell_by_cell(place, cells)
        self._check_order(place)
        return values

    def _plain(self, line: str, cells: list[str]) -> list[float] | None:
        """Return the numbers of a line without anything unusual in it."""
        if len(cells) != self._width or "_" in line or not line.isascii() or (self._dialect.comma and "," in line):
            return None
        try:
            values = [float(cell) if cell else math.nan for cell in cells]
        except ValueError:
            return None
        if any(map(math.isinf, values)):
            return None
        if self._dialect.comma and "." in line:
            return None if self._commas or not self._points else values
        return values

    def _is_end(self, cells: list[str]) -> bool:
        """Return whether a line may stand below the numbers: words first, and not a row in which one number is wrong."""
        comma = self._dialect.comma
        if not cells or number(cells[0], comma=comma) is not None:
            return False
        return len(cells) != self._width or not any(is_present(cell, comma=comma) for cell in cells)

    def _check_width(self, place: int, line: str, cells: list[str]) -> None:
        if len(cells) == self._width:
            return
        raise FileError(
            f"every line must have {self._width} cells; line {place} has {len(cells)}: '{printable(line.strip(), 60)}'; "
            f"repair it, or {CURE}"
        )

    def _check_order(self, place: int) -> None:
        """Refuse numbers below what was no number."""
        if self._words is not None:
            raise FileError(not_a_number(self._words[0], None, self._words[1]) + f"; line {place} has numbers again")
        if self._blank:
            raise FileError(
                f"a text of one column must have a number in every line; line {self._blank} is empty; write nan where a value "
                f"is missing, or remove the line"
            )

    def _cell_by_cell(self, place: int, cells: list[str]) -> list[float]:
        values = []
        for name, cell in zip(self._dialect.names, cells, strict=True):
            value = number(cell, comma=self._dialect.comma)
            if value is None:
                raise FileError(not_a_number(place, name, cell))
            if self._dialect.comma and math.isfinite(value):
                self._note_sign(place, cell)
            values.append(value)
        return values

    def _note_sign(self, place: int, cell: str) -> None:
        """Keep which decimal sign numbers have; both in one file may be separators of thousands."""
        if "," in cell:
            self._commas = self._commas or place
            self._is_decimal |= _CLEARLY_DECIMAL.search(cell) is not None
        elif "." in cell:
            self._points = self._points or place
        if self._commas and self._points:
            raise FileError(
                f"numbers must have one decimal sign; line {self._commas} has a comma and line {self._points} a point; {CURE}"
            )


def check_text(text: str, lines: int) -> None:
    """Refuse what is no text; ``lines`` stand before it."""
    place = text.find("\0")
    if place >= 0:
        raise FileError(
            f"a text must not hold the character NUL; line {lines + text.count(chr(10), 0, place) + 1} does; save it as UTF-8"
        )
