"""Lines of CSV or JSON from a pipe, as many at a time as there are."""

from __future__ import annotations

import json
import math
import os
import select
from collections.abc import Callable, Iterator, Sequence
from typing import Any

_BLOCK = 1 << 16
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
        self.unreadable = 0
        self.first_unreadable = ""

    def pieces(self, wait: float) -> Iterator[list[list[float]]]:
        """Give what has come, every time that something has, or an empty piece after waiting so many seconds; end where the pipe does."""
        rest = b""
        while True:
            ready, _, _ = select.select([self._descriptor], [], [], wait)
            if not ready:
                yield []
                continue
            block = os.read(self._descriptor, _BLOCK)
            *lines, rest = (rest + block).split(b"\n")
            if not block and rest:
                lines, rest = [rest], b""
            if len(rest) > _LONGEST:
                raise ValueError(
                    f"a line must hold at most {_LONGEST} bytes; got more without an end; separate samples by newlines"
                )
            yield [row for line in lines if (row := self._row(line.decode("utf-8", "replace").strip())) is not None]
            if not block:
                return

    def _row(self, line: str) -> list[float] | None:
        """Return the numbers of a line; nothing where it has none."""
        if not line or line.startswith("#"):
            return None
        if self._cells is None:
            self._cells = _json(self._names) if line[0] in "{[" else None
            if self._cells is None:
                separator = next((sign for sign in ",;\t" if sign in line), None)
                cells = [cell.strip().strip('"') for cell in line.split(separator)]
                has_header = not all(_is_number(cell) for cell in cells)
                self._cells = _csv(separator, _places(self._names, cells if has_header else None, len(cells)))
                if has_header:
                    return None
        try:
            return self._cells(line)
        except (ValueError, IndexError, KeyError, TypeError, RecursionError):
            self.unreadable += 1
            self.first_unreadable = self.first_unreadable or line[:80]
            return [math.nan] * len(self._names)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return not cell
    return True


def _places(names: Sequence[str], header: Sequence[str] | None, count: int) -> list[int]:
    """Return the columns of channels."""
    plain = [cell.split("[")[0].split("(")[0].strip() for cell in header or ()]
    places = []
    for name in names:
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


def _csv(separator: str | None, places: Sequence[int]) -> Cells:
    def cells(line: str) -> list[float]:
        parts = line.split(separator)
        return [float(parts[place]) if parts[place].strip() else math.nan for place in places]

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
