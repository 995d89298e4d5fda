"""Samples of a channel in a file: what reads some of them, and rows of numbers that lie one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from tvident._files import FileError, printable


class SourceChannel(Protocol):
    """Samples of one channel, wherever they are."""

    def read(self, first: int, end: int) -> npt.NDArray[Any]:
        """Return some samples, shape (end - first,)."""


class RowsOfFile:
    """Rows that lie one after the other in a file: the last that were read are kept, for another column of theirs."""

    def __init__(self, path: Path, offset: int, row: np.dtype[Any], columns: int = 1) -> None:
        self._path, self._offset, self._row, self._columns = path, offset, row, columns
        self._last: tuple[int, int, npt.NDArray[Any]] | None = None

    def read(self, first: int, end: int) -> npt.NDArray[Any]:
        """Return some rows, shape (end - first, columns)."""
        if self._last is not None and self._last[:2] == (first, end):
            return self._last[2]
        # Not mapped: pages of a map count as memory until the system wants them back.
        count, start = (end - first) * self._columns, self._offset + first * self._columns * self._row.itemsize
        rows = np.fromfile(self._path, self._row, count, offset=start)
        if rows.size < count:
            raise FileError(f"{printable(self._path)}: must be whole; it ends before sample {end}; copy it again")
        self._last = first, end, rows.reshape(-1, self._columns)
        return self._last[2]


@dataclass(frozen=True)
class ColumnOfRows:
    """A column of rows, by its number, or the name of a field."""

    rows: RowsOfFile
    place: int | str

    def read(self, first: int, end: int) -> npt.NDArray[Any]:
        """Return some samples, as they lie between others."""
        found = self.rows.read(first, end)
        return found[self.place][:, 0] if isinstance(self.place, str) else found[:, self.place]


def opened_by_h5py(path: Path, kind: str) -> Any:
    """Open a file of HDF5.

    Raises
    ------
    FileError
        If it is damaged.
    ImportError
        If h5py is not installed; the message calls the file by its kind.
    """
    try:
        import h5py  # noqa: PLC0415 - an extra
    except ImportError:
        raise ImportError(
            f"{kind} needs h5py, which is not installed; install it with: pip install 'tvident[io]'"
        ) from None
    try:
        return h5py.File(path, "r")
    except OSError as error:
        raise FileError(
            f"{printable(path)}: must be whole; h5py says: {printable(error, 200)}; copy it again"
        ) from None
