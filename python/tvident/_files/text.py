"""Columns of numbers in text."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import IO, TextIO, TypeVar

import numpy as np

from tvident._arguments import is_called_time
from tvident._files.channels import Channels, FileError, Say
from tvident._files.comments import Comments
from tvident._files.dialect import Dialect, dialect_of, mixed_line
from tvident._files.headers import CURE
from tvident._files.lists import without_lists
from tvident._files.names import printable
from tvident._files.rows import Numbers, OtherDecimalSignError, Rows, check_text
from tvident._files.statistics_below import without_statistics
from tvident._files.times import TimeColumn
from tvident._files.unpacked import opened
from tvident._units import named_unit, with_unit

Content = TypeVar("Content")

_HEAD, _PIECE = 1 << 20, 1 << 22
"""Characters in which the numbers must begin; characters that are read at once: an interrupt is heard between."""

_LONGEST_LINE = 1_000_000

_ABOVE = 1 << 14
"""Characters in which what stands above the numbers is looked for."""

_START, _MOSTLY = 4096, 0.3
"""Bytes that show the alphabet of a text, and the part of its letters that are digits and other letters of one byte."""

_MOST_ABOVE, _TALLEST = 100, 8
"""Lines above the numbers that are looked at, and lines of one row of names."""

_HOLDS_A_NUMBER = re.compile(r"(?:^|[,;\t|])\s*[+-]?[.,]?\d[\d.,]*\s*(?:[,;\t|]|$)", re.MULTILINE)
"""A row that does is none of names."""

_OPENING = re.compile(r'(?:^|(?<=[\s,;|]))"(?![\s,;|]|$)')
_QUOTES = re.compile('"+')
"""What begins a cell in quotes; within it quotes are doubled."""

_WESTERN = re.compile("[\xa0°µ²³·±]")
_FOREIGN = re.compile("[\x80-\x9f]|[\xa1-\xff]{3}|[\xa1-\xff][\xa1-\xbf\xd7\xf7]|[\xa1-\xbf\xd7\xf7][\xa1-\xff]")
"""What no Western name has: controls, three letters with accents in a row, or signs beside such letters."""

_ALPHABETS = {
    "cp932": "Shift-JIS",
    "gb18030": "GB 18030",
    "euc_kr": "EUC-KR",
    "cp1252": "Windows-1252",
    "cp1251": "Windows-1251",
}
"""In which programs write names, where not in UTF-8."""

_WESTERN_EUROPEAN = "latin-1"

_COMPRESSED = {
    b"\x1f\x8b": "gzip",
    b"PK\x03\x04": "zip",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
    b"\x28\xb5\x2f\xfd": "zstd",
}
"""How compressed files begin."""


def read_text(path: Path, say: Say) -> Channels:
    """Read columns of numbers, with or without names, separated by commas, semicolons, tabs, bars or blanks."""
    return _decoded(path, lambda file: read_columns(file, say))


def read_whole(path: Path) -> str:
    """Return a text of which all must be known before it can be read."""
    return _decoded(path, lambda file: file.read())


def read_start(path: Path) -> str:
    """Return what a text begins with: the lines above its numbers are in it."""
    return _decoded(path, lambda file: file.read(_ABOVE))


def _decoded(path: Path, read: Callable[[TextIO], Content]) -> Content:
    """Read a text in the alphabet that it is written in."""
    with opened(path) as file:
        start = file.read(_START)
    for magic, kind in _COMPRESSED.items():
        if start.startswith(magic):
            cure = ", or let its name end in .csv.gz" if kind == "gzip" and path.suffix.lower() != ".gz" else ""
            raise FileError(f"a text must not be compressed; this is a {kind} file; unpack it{cure}")
    encodings = _encodings(start)
    try:
        return _read_as(path, encodings[0], read)
    except UnicodeError:
        if len(encodings) == 1:
            raise FileError(
                f"a text that begins as {encodings[0]} must end so; it does not; save it as UTF-8"
            ) from None
        return _read_as(path, encodings[1], read)


def _read_as(path: Path, encoding: str, read: Callable[[TextIO], Content]) -> Content:
    with io.TextIOWrapper(opened(path), encoding=encoding) as file:
        return read(file)


def _encodings(start: bytes) -> tuple[str, ...]:
    """Return the alphabets that a text which begins so may be written in."""
    for encoding, marks in (("utf-32", (b"\xff\xfe\0\0", b"\0\0\xfe\xff")), ("utf-16", (b"\xff\xfe", b"\xfe\xff"))):
        if start.startswith(marks):
            return (encoding,)
    # Without a mark: of digits and Western letters one of two bytes is zero in UTF-16, and in no other alphabet.
    even, odd = (start[side::2].count(0) for side in (0, 1))
    for encoding, zeros, others in (("utf-16-le", odd, even), ("utf-16-be", even, odd)):
        if zeros > _MOSTLY * (len(start) // 2) and others < zeros / 20:
            return (encoding,)
    # UTF-8, or else the Western European alphabet of older programs, in which every byte is a letter.
    return "utf-8-sig", _WESTERN_EUROPEAN


def read_columns(file: TextIO, say: Say) -> Channels:
    """Read a text, and again where only its end shows which sign separates thousands."""
    said: list[str] = []
    try:
        channels = _read(file, None, said.append)
    except OtherDecimalSignError as found:
        said = []
        file.seek(0)
        channels = _read(file, found.sign, said.append)
    for message in said:
        say(message)
    return channels


def copy_text(path: Path, rows: IO[bytes], say: Say) -> list[str | None]:
    """Copy the columns of a text, row by row, as 64-bit floats; return their names, None where a column holds no numbers."""

    def copy(file: TextIO) -> list[str | None]:
        decimal = None
        while True:
            said: list[str] = []
            file.seek(0)
            rows.seek(0)
            try:
                names = _copied(file, rows, decimal, said.append)
            except OtherDecimalSignError as found:
                decimal = found.sign
                continue
            rows.truncate()
            for message in said:
                say(message)
            return names

    return _decoded(path, copy)


def names_of_text(path: Path) -> list[str]:
    """Return what the columns of a text are called; those of words too, which only all of its lines tell."""

    def begin(file: TextIO) -> list[str]:
        begun = _begun(file, None, lambda _: None)
        return [] if begun is None else list(begun[0].names)

    return _decoded(path, begin)


def _copied(file: TextIO, copy: IO[bytes], decimal: str | None, say: Say) -> list[str | None]:
    begun = _begun(file, decimal, say)
    if begun is None:
        raise FileError("it is empty; record again")
    dialect, rows, parts = begun
    for part in parts:
        copy.write(np.ascontiguousarray(part).tobytes())
    rows.finish()
    copy.seek(-8 * len(dialect.names) * rows.hollow, 1)
    for column in rows.times:
        say(
            f"column '{printable(dialect.names[column], 40)}' holds times of a clock: not read piece by piece; give sample_rate="
        )
    left_out = rows.dropped | set(rows.times)
    return [None if column in left_out else name for column, name in enumerate(dialect.names)]


def _read(file: TextIO, decimal: str | None, say: Say) -> Channels:
    begun = _begun(file, decimal, say)
    if begun is None:
        return {}
    dialect, rows, parts = begun
    read = list(parts)
    rows.finish()
    return _columns(dialect, read, rows, say)


def _begun(file: TextIO, decimal: str | None, say: Say) -> tuple[Dialect, Rows, Iterator[Numbers]] | None:
    """Return how a text is written and its rows, piece by piece; None where it is empty."""
    file = without_lists(file, say)
    head = file.read(_HEAD)
    rest = file.readline(_LONGEST_LINE) if head and not head.endswith("\n") else ""
    if len(rest) >= _LONGEST_LINE:
        _refuse_long_line(head.count("\n") + 1)
    head += rest
    check_text(head, 0)
    comments = Comments(head)
    head = comments.behind(head)
    lines = _with_whole_names(head.split("\n"))
    longest = max(range(len(lines)), key=lambda index: len(lines[index]))
    if len(lines[longest]) > _LONGEST_LINE:
        _refuse_long_line(longest + 1)
    dialect = dialect_of(lines, say)
    if dialect is None:
        if head.strip():
            raise FileError(f"holds no numbers; {mixed_line(lines)}{CURE}")
        return None
    if file.encoding == _WESTERN_EUROPEAN:
        _say_foreign(dialect.names, say)
    dialect = replace(dialect, decimal=decimal, first=_first_that_holds_anything(lines, dialect, say))
    rows = Rows(dialect, say)
    rows.skip(dialect.first)
    comments.repeat(dialect.above)
    first = "\n".join(lines[dialect.first :])
    pieces = chain([first], _pieces(file, head.count("\n")))
    return dialect, rows, map(rows.read, map(comments.all, pieces))


def _first_that_holds_anything(lines: Sequence[str], dialect: Dialect, say: Say) -> int:
    """Return the first row that has a cell: where samples have times, separators alone below the names are none."""
    first, separator = dialect.first, dialect.separator
    if separator is None or not any(is_called_time(named_unit(name)[0]) for name in dialect.names):
        return first
    while first + 1 < len(lines) and separator in lines[first] and not lines[first].strip(f'{separator}" \t\r'):
        first += 1
    if first > dialect.first:
        many = first - dialect.first
        say(f"the first {'row holds' if many == 1 else f'{many} rows hold'} nothing: not read")
    return first


def _say_foreign(names: Sequence[str], say: Say) -> None:
    """Say that names look as if they were in another alphabet than the one that they were read in."""
    foreign = next((name for name in names if _FOREIGN.search(_WESTERN.sub(" ", name))), None)
    if foreign is None:
        return
    maybe: dict[str, str] = {}
    for encoding, called in _ALPHABETS.items():
        try:
            name = foreign.encode(_WESTERN_EUROPEAN).decode(encoding)
        except UnicodeError:
            continue
        if name != foreign:
            maybe.setdefault(name, called)
    each = [f"'{printable(name, 40)}' in {called}" for name, called in maybe.items()]
    known = f": it may be {' or '.join(each)}" if each else ""
    say(f"the name '{printable(foreign, 40)}' is neither in UTF-8 nor in Latin-1{known}; save the file as UTF-8")


def _with_whole_names(lines: list[str]) -> list[str]:
    """Return lines with names that a spreadsheet wrote over several, in quotes, in the last of these; numbers stay where they are."""
    start = 0
    while start < min(len(lines), _MOST_ABOVE):
        end = start
        last = min(start + _TALLEST, len(lines) - 1)
        row = lines[start]
        while _is_open(row) and end < last:
            end += 1
            row += "\n" + lines[end]
        if end > start and not _is_open(row) and not _HOLDS_A_NUMBER.search(row):
            joined = " ".join(one.strip() for one in lines[start : end + 1])
            lines[start : end + 1] = [""] * (end - start) + [joined]
            start = end
        start += 1
    return lines


def _is_open(row: str) -> bool:
    """Return whether a cell begins with a quote and does not end; a quote within a cell is an inch sign."""
    opening = _OPENING.search(row)
    while opening is not None:
        ends = (one.end() for one in _QUOTES.finditer(row, opening.end()) if (one.end() - one.start()) % 2)
        end = next((one for one in ends if row[one : one + 1] in {*",;| \t\r\n", ""}), None)
        if end is None:
            return True
        opening = _OPENING.search(row, end)
    return False


def _refuse_long_line(place: int) -> None:
    raise FileError(
        f"a line must have at most {_LONGEST_LINE} characters; line {place} has more; write one line for every sample"
    )


def _pieces(file: TextIO, lines: int) -> Iterator[str]:
    """Give the rest of a text in pieces of whole lines."""
    carried = ""
    while piece := file.read(_PIECE):
        whole, newline, last = (carried + piece).rpartition("\n")
        if len(last) > _LONGEST_LINE:
            _refuse_long_line(lines + whole.count("\n") + 2)
        carried = last
        if newline:
            lines += whole.count("\n") + 1
            yield whole + newline
    if carried:
        yield carried


def _columns(dialect: Dialect, parts: list[Numbers], rows: Rows, say: Say) -> Channels:
    """Return rows as columns, each in one piece of memory."""
    width = len(dialect.names)
    columns = np.empty((width, sum(part.shape[0] for part in parts)))
    start = 0
    while parts:
        part = parts.pop(0)
        columns[:, start : start + len(part)] = part.T
        start += len(part)
    if rows.hollow:
        columns = columns[:, : -rows.hollow]
    columns = without_statistics(columns, say)
    if not dialect.named:
        # A separator at the end of every line makes no column.
        while width > 1 and np.isnan(columns[width - 1]).all():
            width -= 1
    names = list(dialect.names)
    # Separators before or between others make columns without a name that hold nothing.
    hollow = {
        column
        for column in range(width)
        if dialect.named and names[column] == str(column) and np.isnan(columns[column]).all()
    }
    for column, times in rows.times.items():
        names[column], columns[column] = in_seconds(names[column], times, columns[column], say)
    return {names[column]: columns[column] for column in range(width) if column not in rows.dropped | hollow}


def in_seconds(name: str, times: TimeColumn, seconds: Numbers, say: Say) -> tuple[str, Numbers]:
    """Return the name and the samples of a column of times, which is said, as they go on where a clock began again."""
    found, turns = times.unwrapped(seconds)
    since = f"since {times.first}" if times.is_dated else "of a clock"
    often = "once" if turns == 1 else f"{turns} times"
    again = f", which began again {often} and goes on here" if turns else ""
    say(f"column '{printable(name, 40)}' holds times: read as seconds {since}{again}")
    return with_unit(named_unit(name)[0], "s"), found
