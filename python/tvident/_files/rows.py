"""Rows of numbers in text: in bulk where nothing is unusual, cell by cell where something is."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._files.cells import (
    are_joined,
    decimal_sign,
    fortran_as_usual,
    hides_numbers,
    is_present,
    is_remark,
    number,
    split,
    without_comment,
)
from tvident._files.channels import FileError, Say
from tvident._files.cut import what_lacks
from tvident._files.dialect import Dialect
from tvident._files.headers import CURE, may_be_frames, not_a_number, not_a_time
from tvident._files.names import printable
from tvident._files.no_values import Unmeasured
from tvident._files.times import TimeColumn, instant

Numbers = npt.NDArray[np.float64]

_CLEARLY_DECIMAL = re.compile(r"(?<!\d)0,\d|\d{4},\d|,\d{1,2}(?!\d)|,\d{4}")
"""Thousands are separated in groups of three behind one to three digits that do not begin with 0."""

_CLEARLY_POINTS = re.compile(r"(?<!\d)0?\.\d|\d{4}\.|\.\d{0,2}(?!\d)|\.\d{4}")
"""The same for points, which separate thousands where semicolons separate cells and no number has a comma."""

_MOST_DOUBTFUL = 3
"""Numbers in which a sign may separate thousands, for each one whose decimal sign is the other: an odd cell decides nothing."""

_MOST_WORDS = 20
"""Lines of words that may stand below the numbers."""

_STATISTICS = re.compile(
    r"(min|max|mean|average|avg|median|std|std[. ]*dev|sd|rms|sum|total|count|n"
    r"|minimum|maximum|mittelwert|mittel|summe|anzahl|standardabweichung|stabw|moyenne|m[ée]diane|[ée]cart[ -]type|somme|media|promedio"
    r"|mediana|suma|somma|m[ée]dia|gemiddelde|som)[. ]*[:=]?",
    re.IGNORECASE,
)
"""What spreadsheets and recorders write before numbers below the others."""

_TIMES = re.compile(r"\d+[-./:]\d+[-./:][\d.,:]+")

_BLANK_LINE = re.compile(r"(^|\n)[ \t]*\n")


_JUST_BEFORE = 1 << 16
"""Characters of the lines that a last one without an end is compared with."""


class OtherDecimalSignError(Exception):
    """What separates thousands was read as the decimal sign: the text is to be read again, with this one."""

    def __init__(self, sign: str) -> None:
        super().__init__(sign)
        self.sign = sign


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
        self._signs = {".": 0, ",": 0}
        """First line that has a number with this decimal sign."""
        self._doubtful = {".": 0, ",": 0}
        """First line that has a number in which this sign may as well separate thousands."""
        self._clear_count, self._doubtful_count = 0, 0
        """Where the decimal sign is known, numbers that have it, and those in which the other sign separates thousands."""
        self._remarks = {column: "" for column, kind in enumerate(dialect.kinds) if kind == "words"}
        """Where columns of words have their first, and the word."""
        self._numbers: set[int] = set()
        """Columns without anything in the first lines that have numbers further below."""
        self._unmeasured = Unmeasured()
        self._before = ""
        """The end of the last piece."""
        self._cut = ""
        """Why the last line is not read, which has no end."""
        self.hollow = 0
        """Rows at the end that hold separators alone."""
        self.times = {column: TimeColumn(cells) for column, cells in dialect.times.items()}

    def skip(self, lines: int) -> None:
        self._line += lines

    def read(self, text: str) -> Numbers:
        """Return the rows of some whole lines."""
        check_text(text, self._line)
        text = self._without_cut_line(text)
        # Numbers below words are an error, and so are empty lines in a single column: line by line both are found.
        unusual = self._words is not None or hides_numbers(text)
        unusual |= self._width == 1 and (self._blank > 0 or _BLANK_LINE.search(text) is not None)
        found = None if unusual else self._in_bulk(text)
        lines = text.count("\n")
        if found is None:
            found = self._line_by_line(text.split("\n")[: lines + 1])
        self._count_hollow(text, found.shape[0])
        self._line += lines
        return found

    def _without_cut_line(self, text: str) -> str:
        """Return a piece without a last line that has no end and lacks cells or digits: writing stopped within it."""
        whole, end, last = text.rpartition("\n")
        above, self._before = self._before + whole[-_JUST_BEFORE:], text[-_JUST_BEFORE:]
        cells = split(last, self._dialect.separator)
        if not last.strip() or self._words is not None or "#" in last or self._is_end(cells):
            return text
        rows = [self._cells(line) for line in above.split("\n")[1:]]
        lacks = what_lacks(
            cells, [row for row in rows if len(row) == self._width], is_time=self._width - 1 in self.times
        )
        if not lacks or self._width - 1 in self._remarks:
            return text
        place = self._line + text.count("\n") + 1
        self._cut = f"line {place} has no end and {lacks}: not read, since the file may have been cut there"
        return whole + end

    def _count_hollow(self, text: str, rows: int) -> None:
        """Count the rows at the end so far that hold separators alone: a sheet may write many below its last number."""
        separator = self._dialect.separator
        if separator is None or self._width == 1:
            return
        lines = text.split("\n") if self._words is None else text.split("\n")[: max(0, self._words[0] - self._line - 1)]
        hollow = 0
        for line in reversed(lines):
            if line.replace(separator, "").strip():
                break
            hollow += separator in line and not self._is_blank(line)
        self.hollow = self.hollow + rows if hollow >= rows else hollow

    @property
    def dropped(self) -> set[int]:
        """Columns that hold words."""
        return set(self._remarks)

    def finish(self) -> None:
        """Check what only the whole text shows, and say what was not read."""
        if self._dialect.decimal is None:
            self._check_signs()
        else:
            self._check_thousands()
        for column, times in self.times.items():
            if times.may_count_frames:
                raise FileError(may_be_frames(self._dialect.names[column], times.first))
            if times.is_doubtful:
                raise FileError(
                    f"dates must say what is the day and what the month; those of column '{printable(self._dialect.names[column], 40)}' do "
                    f"not, as '{times.first}'; write 2024-12-31"
                )
        for column, remark in sorted(self._remarks.items()):
            self._say(
                f"column '{printable(self._dialect.names[column], 40)}': not read, it holds words{remark and ': ' + remark}"
            )
        for message in self._unmeasured.said():
            self._say(message)
        if self._cut:
            self._say(self._cut)
        if self.hollow:
            self._say(f"the last {'row holds' if self.hollow == 1 else f'{self.hollow} rows hold'} nothing: not read")
        if self._words is not None:
            first, words = self._words
            where = f"line {first}" if first == self._words_end else f"lines {first} to {self._words_end}"
            self._say(f"{where} below the numbers: not read, as there are words: '{printable(words, 60)}'")

    def _in_bulk(self, text: str) -> Numbers | None:
        """Return the rows of a text that holds nothing but numbers, None where something else may be in it."""
        d = self._dialect
        text = fortran_as_usual(text) if d.is_plain else text
        bare = text if d.is_plain else _TIMES.sub("", text)
        has = {".": "." in bare, ",": d.comma and "," in bare}
        was = {sign: bool(self._signs[sign] or self._doubtful[sign]) for sign in ".,"}
        if any((has[one] or was[one]) and (has[other] or d.decimal == other) for one, other in (".,", ",.")):
            return None  # to find the lines
        found = self._without_empty_cells(text.replace(",", ".") if has[","] else text)
        # A number too large for 64 bits becomes infinite there.
        if found is None or np.isinf(found).any():
            return None
        for sign, is_clear in ((".", _CLEARLY_POINTS), (",", _CLEARLY_DECIMAL)):
            if has[sign] and d.comma:
                clear = is_clear.search(bare)
                known, place = (self._doubtful, bare.index(sign)) if clear is None else (self._signs, clear.start())
                known[sign] = known[sign] or self._line + 1 + bare.count("\n", 0, place)
            self._clear_count += len(is_clear.findall(bare)) if sign == d.decimal else 0
        for column, kind in enumerate(d.kinds):
            if kind == "nothing" and np.isfinite(found[:, column]).any():
                if column in self._remarks:
                    return None  # to find the line
                self._numbers.add(column)
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
                converters=self._converters(),
                ndmin=2,
            )
        except (ValueError, UserWarning):
            return None

    def _converters(self) -> dict[int | str, Callable[[str], Any]] | None:
        """Return what turns cells of times and words into numbers."""
        if self._dialect.is_plain:
            return None
        found: dict[int | str, Callable[[str], Any]] = {column: times.seconds for column, times in self.times.items()}
        return found | dict.fromkeys(self._remarks, _no_number)

    def _line_by_line(self, lines: list[str]) -> Numbers:
        rows = []
        for place, whole in enumerate(lines, self._line + 1):
            line = without_comment(whole)
            if self._is_blank(line) or self._is_remark(line):
                if self._width == 1 and place < self._line + len(lines) and not whole.lstrip().startswith("#"):
                    self._blank = place
                continue
            row = self._row(place, line)
            if row is not None:
                rows.append(row)
        return np.array(rows, dtype=np.float64).reshape(-1, self._width)

    def _is_blank(self, line: str) -> bool:
        """Return whether a line says nothing; tabs are a row in which nothing was measured only if they are as many as in other rows."""
        if line.strip():
            return False
        return self._dialect.separator != "\t" or len(split(line, "\t")) < max(2, self._width)

    def _is_remark(self, line: str) -> bool:
        """Return whether a line is a comment about what is missing; of as many cells as columns it may be a row of what is missing."""
        if not line.lstrip().startswith("#") or not self._dialect.is_plain:
            return False
        cells = split(line, self._dialect.separator)
        is_row = len(cells) == self._width
        # A cell of several words is no number that went wrong.
        if is_row and self._dialect.separator is not None and not any(" " in cell.strip() for cell in cells):
            return False
        return is_remark(line, least=2 if is_row else 1)

    def _cells(self, line: str) -> list[str]:
        """Return the cells of a line; separators at its end make none beyond the columns."""
        cells = split(line, self._dialect.separator)
        while len(cells) > self._width and not cells[-1]:
            cells.pop()
        return cells

    def _row(self, place: int, line: str) -> list[float] | None:
        """Return the numbers of a line, or None where it holds words that may be the end of the table."""
        cells = self._cells(line)
        if self._words is not None and not any(cells):
            return None
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
        d = self._dialect
        if (
            len(cells) != self._width
            or "_" in line
            or not line.isascii()
            or not d.is_plain
            or d.decimal
            or "nothing" in d.kinds
        ):
            return None
        if d.comma and ("," in line or "." in line):
            return None
        try:
            values = [float(cell) if cell else math.nan for cell in cells]
        except ValueError:
            return None
        if any(map(math.isinf, values)):
            return None
        return values

    def _is_end(self, cells: list[str]) -> bool:
        """Return whether a line may stand below the numbers: words first, and not a row in which one number is wrong."""
        first = cells[0] if cells else ""
        if not cells or number(first, comma=True) is not None or instant(first) is not None or are_joined(first):
            return False
        if _STATISTICS.fullmatch(cells[0]):
            return True
        if len(cells) != self._width:
            return True
        return 0 not in self._remarks and not any(is_present(cell, comma=True) for cell in cells)

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
            first, words = self._words
            if words in self._dialect.above:
                raise FileError(
                    f"a text must hold one recording; line {first} repeats what stands above the numbers, '{printable(words, 40)}', and "
                    f"numbers go on in line {place}; write each recording to a file of its own"
                )
            raise FileError(not_a_number(first, None, words) + f"; line {place} has numbers again")
        if self._blank:
            raise FileError(
                f"a text of one column must have a number in every line; line {self._blank} is empty; write nan where a value "
                f"is missing, or remove the line"
            )

    def _cell_by_cell(self, place: int, cells: list[str]) -> list[float]:
        return [self._cell(place, column, cell) for column, cell in enumerate(cells)]

    def _cell(self, place: int, column: int, cell: str) -> float:
        d = self._dialect
        if column in self.times:
            try:
                return self.times[column].seconds(cell)
            except ValueError:
                raise FileError(not_a_time(place, d.names[column], cell)) from None
        value = number(cell, comma=d.cells > 1, decimal=d.decimal)
        if d.kinds[column] == "nothing":
            self._note_remark(place, column, value)
        if column in self._remarks:
            if cell and not self._remarks[column]:
                self._remarks[column] = f"'{printable(cell, 40)}' in line {place}"
            return math.nan
        if value is None:
            raise FileError(not_a_number(place, d.names[column], cell))
        if math.isfinite(value):
            self._note_sign(place, cell)
        else:
            self._unmeasured.note(place, d.names[column], cell)
        return value

    def _note_remark(self, place: int, column: int, value: float | None) -> None:
        """Keep what a column that began empty holds: words or numbers, not both."""
        if value is not None and math.isnan(value):
            return
        if value is None and column not in self._numbers:
            self._remarks.setdefault(column, "")
        elif value is not None and column in self._remarks:
            raise FileError(not_a_number(place, self._dialect.names[column], self._remarks[column]))
        elif value is not None:
            self._numbers.add(column)

    def _note_sign(self, place: int, cell: str) -> None:
        """Keep which decimal sign numbers have; both in one file may be separators of thousands."""
        sign = decimal_sign(cell)
        if sign is None:
            return
        if sign == "?":
            sign = "," if "," in cell else "."
            if sign == self._dialect.decimal:
                return
            self._doubtful[sign] = self._doubtful[sign] or place
            self._doubtful_count += 1
        else:
            self._signs[sign] = self._signs[sign] or place
            self._clear_count += 1
        if self._signs["."] and self._signs[","]:
            raise FileError(
                f"numbers must have one decimal sign; line {self._signs[',']} has a comma and line {self._signs['.']} a point; {CURE}"
            )

    def _check_thousands(self) -> None:
        """Refuse many numbers in which a sign would separate thousands for the sake of few with the other."""
        if self._doubtful_count > _MOST_DOUBTFUL * self._clear_count:
            other, place = next((sign, place) for sign, place in self._doubtful.items() if place)
            raise FileError(
                f"the '{other}' in line {place} may be a decimal sign or separate thousands, as in {self._doubtful_count} numbers, and "
                f"{self._clear_count} with the other sign cannot tell; {CURE}"
            )

    def _check_signs(self) -> None:
        """Find the decimal sign of numbers in which it may separate thousands, from the others."""
        for sign, other in (".,", ",."):
            if self._signs[sign] and self._doubtful[other]:
                raise OtherDecimalSignError(sign)
        if self._doubtful[","] and not self._signs[","]:
            raise FileError(
                f"a comma in line {self._doubtful[',']} may be a decimal sign or separate thousands, as all others in this file; {CURE}"
            )
        if self._dialect.separator == ";" and self._doubtful["."] and not self._signs["."]:
            self._say(
                "every point has three digits behind it; it is read as the decimal sign, not as a separator of thousands"
            )


def _no_number(_: str) -> float:
    return math.nan


def check_text(text: str, lines: int) -> None:
    """Refuse what is no text; ``lines`` stand before it."""
    place = text.find("\0")
    if place >= 0:
        raise FileError(
            f"a text must not hold the character NUL; line {lines + text.count(chr(10), 0, place) + 1} does; save it as UTF-8"
        )
