"""Lines of CSV or JSON from a pipe, as many at a time as there are."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import select
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tvident._units import is_unit, named_unit, unit_of

_BLOCK = 1 << 16
_DAMAGED = 1e-3
"""Of the bytes of a text, at most: of random bytes one of 256 is NUL."""
_OTHER_ALPHABET = 0.25
"""Of the bytes of the first line, at least: in UTF-16 every other byte of a number is NUL."""
_LONGEST = 1 << 20
"""Bytes of a line."""

Cells = Callable[[str], list[float]]


class Lines:
    """Numbers of named channels from newline-separated CSV or JSON.

    The first line says what it is: ``{`` or ``[`` begins JSON; anything else is CSV, with a header where a cell is no number.

    Parameters
    ----------
    descriptor : int
        Of the file or pipe.
    names : sequence of str
        Channels by name, or by number from 0; of nested JSON joined by dots.
    """

    def __init__(self, descriptor: int, names: Sequence[str]) -> None:
        self._descriptor = descriptor
        self._names = list(names)
        self._cells: Cells | None = None
        self._rest = b""
        self._early: list[str] = []
        """Lines that came before anybody asked for pieces."""
        self._is_begun = self._has_ended = False
        self.units = [""] * len(self._names)
        """Of the channels, as a header, a line below it or keys say them."""
        self.read = self.unreadable = self.restarts = 0
        self.first_unreadable = ""
        """The line, and the key that it has not."""

    def begin(self, wait: float, until: float) -> None:
        """Wait for the lines that say units: the first, and the one below a header; no longer than until a time of the monotonic clock."""
        while not self._has_begun() and not self._has_ended and time.monotonic() < until:
            self._early += self._come(wait)

    def pieces(self, wait: float) -> Iterator[list[list[float]]]:
        """Give what has come, every time that something has, or an empty piece after waiting so many seconds; end where the pipe does."""
        while True:
            if not self._early:
                self._early = self._come(wait)
            lines: list[str] = []
            if self._has_begun() or self._has_ended:
                lines, self._early = self._early, lines
            else:
                self._early += self._come(wait)
            yield [row for line in lines if (row := self._row(line)) is not None]
            if self._has_ended and not self._early:
                return

    def _come(self, wait: float) -> list[str]:
        """Return the lines that have come, none after waiting so many seconds."""
        ready, _, _ = select.select([self._descriptor], [], [], wait)
        if not ready:
            return []
        block = os.read(self._descriptor, _BLOCK)
        self._has_ended = not block
        if not self._is_begun and not self._early and _is_no_text(block):
            raise ValueError(
                "lines must be UTF-8; they hold the character NUL, as UTF-16 does; write them as UTF-8, in PowerShell by "
                "$OutputEncoding = [Text.Encoding]::UTF8"
            )
        *lines, self._rest = (self._rest + block).split(b"\n")
        if self._has_ended and self._rest:
            lines, self._rest = [self._rest], b""
        if len(self._rest) > _LONGEST:
            raise ValueError(
                f"a line must hold at most {_LONGEST} bytes; got more without an end; separate samples by newlines"
            )
        # A mark of the alphabet may stand before the first.
        return [line.decode("utf-8", "replace").strip().removeprefix("\ufeff") for line in lines]

    def _has_begun(self) -> bool:
        """Take the first lines, if they have come: how lines are read, and units in a header or below it; the rest are numbers."""
        if self._is_begun:
            return True
        first = self._first(0)
        if first is None:
            return False
        line = self._early[first]
        if line[0] in "{[":
            self._cells, self._is_begun = _json(self._names), True
            named = [named_unit(name)[1] for name in self._names]
            self.units = [unit if unit_of(unit) is not None else "" for unit in named]
            return True
        separator = _separator(line)
        header = _split(line, separator)
        has_header = not all(map(_is_number, header))
        places = _places(self._names, header if has_header else None, len(header))
        self._cells = _csv(separator, places, len(header))
        if has_header:
            below = self._first(first + 1)
            if below is None and not self._has_ended:
                return False
            self.units = [named_unit(header[place])[1] for place in places]
            cells = [] if below is None else _split(self._early[below], separator)
            if len(cells) == len(header) and all(map(is_unit, cells)) and not all(map(_is_number, cells)):
                self.units = [cells[place].strip("[]()") for place in places]
                first = below or first
            del self._early[: first + 1]
        self._is_begun = True
        return True

    def _first(self, begin: int) -> int | None:
        """Return the first waiting line that says something; one that was damaged is no header and no number of cells."""
        waiting = range(begin, len(self._early))
        return next((k for k in waiting if _says_something(self._early[k]) and "\0" not in self._early[k]), None)

    def _row(self, line: str) -> list[float] | None:
        """Return the numbers of a line; None if it has none."""
        if not _says_something(line) or self._cells is None:
            return None
        try:
            row = self._cells(line)
        except (ValueError, IndexError, KeyError, TypeError, RecursionError) as error:
            self.unreadable += 1
            lacks = f", which has no {error.args[0]!r}" if isinstance(error, KeyError) else ""
            self.first_unreadable = self.first_unreadable or f"{line[:80]!r}{lacks}"
            return [math.nan] * len(self._names)
        self.read += 1
        return row


def _is_no_text(block: bytes) -> bool:
    """Return whether what comes first is UTF-16 or packed, and not text in which a byte was damaged."""
    first = block.split(b"\n", 1)[0]
    return first.count(b"\0") > len(first) * _OTHER_ALPHABET or block.count(b"\0") > max(1, len(block) * _DAMAGED)


def _says_something(line: str) -> bool:
    return bool(line) and not line.startswith("#")


def _separator(line: str) -> str | None:
    """Return what separates the cells of a line outside quotes; None where blanks do."""
    bare = re.sub('"[^"]*"', "", line)
    return next((sign for sign in ";\t," if sign in bare), None)


def _split(line: str, separator: str | None) -> list[str]:
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        cells = next(csv.reader([line], delimiter=separator or " ", skipinitialspace=True))
    except csv.Error:
        raise ValueError(
            f"quotes must close within a line of CSV; got {line[:80]!r}; write numbers without quotes"
        ) from None
    return [cell.strip() for cell in cells]


def _number(cell: str) -> float:
    """Return the number in a cell, NaN where it is empty; a comma is a decimal sign, since it separated nothing."""
    if "_" in cell:  # which Python reads over
        raise ValueError
    return float(cell.replace(",", ".")) if cell else math.nan


def _is_number(cell: str) -> bool:
    try:
        _number(cell)
    except ValueError:
        return False
    return True


def check_one(name: str, names: Sequence[str]) -> None:
    """Check that no more than one channel has a name."""
    places = [str(place) for place, one in enumerate(names) if one == name]
    if len(places) > 1:
        raise ValueError(
            f"a name must be that of one channel; got {name!r}, which {len(places)} have; give the number of one, "
            f"{', '.join(places[:-1])} or {places[-1]}"
        )


def _places(names: Sequence[str], header: Sequence[str] | None, count: int) -> list[int]:
    """Return the columns of channels."""
    plain = [named_unit(cell)[0] for cell in header or ()]
    places = []
    for name in names:
        check_one(name, plain if name not in (header or ()) else header or ())
        if header is not None and name in header:
            places.append(list(header).index(name))
        elif name in plain:
            places.append(plain.index(name))
        elif name.isdigit() and int(name) < count:
            places.append(int(name))
        else:
            there = ", ".join(header) if header else f"numbers from 0 to {count - 1}, since there is no header"
            raise ValueError(f"a channel must be one of those that come; got {name!r}; there are {there}")
    return places


def _csv(separator: str | None, places: Sequence[int], count: int) -> Cells:
    """Return what reads lines of so many cells; those with more were cut at other places, unless the last one is empty."""

    def cells(line: str) -> list[float]:
        parts = _split(line, separator)
        if any(parts[count:]) or len(parts) > count + 1:
            raise ValueError
        return [_number(parts[place]) for place in places]

    return cells


def _json(names: Sequence[str]) -> Cells:
    paths = [name.split(".") for name in names]

    def value(found: Any, name: str, path: Sequence[str]) -> float:
        if isinstance(found, dict) and name in found:
            found = found[name]
        else:
            for part in path:
                found = found[int(part)] if isinstance(found, list) else found[part]
        return math.nan if found is None else float(found)

    def cells(line: str) -> list[float]:
        found = json.loads(line)
        return [value(found, name, path) for name, path in zip(names, paths, strict=True)]

    return cells
