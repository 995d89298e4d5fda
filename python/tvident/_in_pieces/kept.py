"""What is kept of work that may be interrupted: a folder beside the result, with the rows that are done."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from bisect import bisect_right
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._files import printable
from tvident._in_pieces.alone import NAME as LOCK
from tvident._in_pieces.alone import alone_in
from tvident._in_pieces.rows import make_room, read_columns, read_some, row_of, write_columns, write_rows
from tvident._status import Status

_FORMAT = 4
"""Folders of another number hold other things."""

Columns = Mapping[str, npt.NDArray[Any]]


def mark_of(path: Path) -> str:
    """Return what tells a file, or a folder of files, from what it is after a change."""
    files = sorted(one for one in path.rglob("*") if one.is_file()) if path.is_dir() else [path]
    told = [(str(one.relative_to(path)), one.stat().st_size, one.stat().st_mtime_ns) for one in files]
    return hashlib.sha256(json.dumps(told).encode()).hexdigest()


class Kept:
    """The folder of one call: ``.NAME.tvident`` beside the result.

    Parameters
    ----------
    output : Path
        The result that is to be.
    told : mapping
        Everything that the numbers depend on, as JSON has it: of another input, or other settings, nothing is used.

    Raises
    ------
    BlockingIOError
        If another call writes that result now.
    """

    def __init__(self, output: Path, told: Mapping[str, Any]) -> None:
        self.folder = output.with_name(f".{output.name}.tvident")
        self._told = hashlib.sha256(json.dumps([_FORMAT, told], sort_keys=True).encode()).hexdigest()
        try:
            self._lock = alone_in(self.folder)
        except BlockingIOError:
            place = printable(output)
            raise BlockingIOError(
                f"one call at a time may write a result; another writes {place}; wait, or write elsewhere"
            ) from None
        self._state = self._read()
        if self._state is None:
            self._clear()
            self._state = {"told": self._told, "notes": [], "rows": 0, "pieces": [], "flags": {}, "facts": {}}
            self._write()

    @property
    def notes(self) -> list[Any]:
        """What was noted of every piece that is done."""
        return list(self._found["notes"])

    @property
    def facts(self) -> dict[str, Any]:
        """What was noted of the whole record."""
        return dict(self._found["facts"])

    def note_fact(self, name: str, value: Any) -> None:
        """Keep something of the whole record."""
        self._found["facts"][name] = value
        self._write()

    def begin(self, columns: Columns, of: int, head: bytes | None = None) -> None:
        """Make the file of so many rows in all, before the first are kept, with room for them.

        With a `head` the file of all rows begins with it and is what a result may be; without one the columns of every piece lie one after
        the other, which costs half as much to write and a fifth to read.
        """
        with self.place.open("wb") as file:
            make_room(file, len(head or b"") + of * row_of(columns).itemsize)
            file.write(head or b"")

    def add(self, columns: Columns, note: Any, head: bytes | None = None) -> None:
        """Keep the rows of one more piece, and a note of it; the head is that which the file began with."""
        row, begin, done = row_of(columns), len(head or b""), self._found["rows"]
        with self.place.open("r+b") as file:
            # What an interrupted call wrote beyond the rows that it noted is written again.
            file.seek(begin + done * row.itemsize)
            count = write_columns(file, columns) if head is None else write_rows(file, row, columns)
        self._found["head"], self._found["are_rows"] = begin, head is not None
        self._found["pieces"].append(count)
        self._found["row"] = [[name, values.dtype.str] for name, values in columns.items()]
        _count(columns["status"], self._found["flags"])
        self._found["rows"] += count
        self._found["notes"].append(note)
        self._write()

    @property
    def is_empty(self) -> bool:
        """Whether nothing is kept that would be missed: rows that were not noted are written again."""
        holds = {one.name for one in self.folder.iterdir()} - {LOCK, "state.json", self.place.name}
        return not self.has_results and not holds

    @property
    def has_results(self) -> bool:
        """Whether rows or facts of the record are kept."""
        return bool(self._found["notes"] or self._found["facts"])

    @property
    def count(self) -> int:
        """Rows that are done."""
        return int(self._found["rows"])

    @property
    def flags(self) -> dict[str, int]:
        """How many of them have each flag."""
        return dict(self._found["flags"])

    def columns(self, first: int, end: int) -> dict[str, npt.NDArray[Any]]:
        """Return some of the rows that are done, column by column; those of one piece, where pieces keep their columns."""
        row = np.dtype([(name, kind) for name, kind in self._found["row"]])
        with self.place.open("rb", buffering=0) as file:
            if self._found["are_rows"]:
                file.seek(self._found["head"] + first * row.itemsize)
                return read_columns(file, row, end - first)
            begins = np.concatenate([[0], np.cumsum(self._found["pieces"])]).tolist()
            piece = bisect_right(begins, first) - 1
            file.seek(begins[piece] * row.itemsize)
            span = first - begins[piece], end - begins[piece]
            return read_some(file, row, self._found["pieces"][piece], span)

    def remove(self) -> None:
        """Remove the folder."""
        self._clear()
        if os.name == "nt":  # Open files cannot be removed there.
            self.close()
        shutil.rmtree(self.folder, ignore_errors=True)
        self.close()

    def close(self) -> None:
        """Let another call go on here."""
        if self._lock is not None:
            self._lock.close()

    @property
    def place(self) -> Path:
        """The file of all rows that are done, after its head."""
        return self.folder / "rows"

    @property
    def _found(self) -> dict[str, Any]:
        assert self._state is not None  # noqa: S101 - it was made
        return self._state

    def _read(self) -> dict[str, Any] | None:
        """Return what an interrupted call of the same kind left, or None."""
        try:
            state = json.loads((self.folder / "state.json").read_text(encoding="utf-8"))
            if state["told"] != self._told:
                return None
            rows = int(state["rows"])
            size = np.dtype([(name, kind) for name, kind in state["row"]]).itemsize if rows else 0
            if rows and self.place.stat().st_size < state["head"] + rows * size:
                return None
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return dict(state)

    def _clear(self) -> None:
        """Remove all that is in the folder but what says that a call works there."""
        for one in self.folder.iterdir():
            if one.is_dir() and not one.is_symlink():
                shutil.rmtree(one, ignore_errors=True)
            elif one.name != LOCK:
                one.unlink(missing_ok=True)

    def _write(self) -> None:
        beside = self.folder / "state.json.new"
        beside.write_text(json.dumps(self._state), encoding="utf-8")
        beside.replace(self.folder / "state.json")

    def __repr__(self) -> str:
        return f"<Kept in {printable(self.folder)}>"


def _count(status: npt.NDArray[np.uint16], counts: dict[str, int]) -> None:
    """Add how many rows have each flag."""
    there = int(np.bitwise_or.reduce(status))
    for flag in Status:
        if flag & there:
            found = int(np.count_nonzero(status & np.uint16(flag)))
            counts[str(flag.name)] = counts.get(str(flag.name), 0) + found
