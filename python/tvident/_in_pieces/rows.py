"""Rows of numbers from columns, and columns from rows: how results are kept, and what a file of rows holds."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Mapping
from typing import IO, Any

import numpy as np
import numpy.typing as npt

_AT_ONCE = 1 << 13
"""Rows that stay in the processor's cache while one column after the other is written into them."""

_KEEP_SIZE = 1
"""Of Linux: room beyond the end of a file does not belong to what it holds."""


def row_of(columns: Mapping[str, npt.NDArray[Any]]) -> np.dtype[Any]:
    """Return what a row of some columns holds."""
    return np.dtype([(name, values.dtype) for name, values in columns.items()])


def write_rows(file: IO[bytes], row: np.dtype[Any], columns: Mapping[str, npt.NDArray[Any]]) -> int:
    """Write columns as rows with these fields, and return how many there are."""
    count = next(iter(columns.values())).size
    rows = np.empty(min(count, _AT_ONCE), row)
    for first in range(0, count, _AT_ONCE):
        some = rows[: count - first]
        for name, values in columns.items():
            some[name] = values[first : first + some.size]
        file.write(some.view(np.uint8).data)
    return count


def make_room(file: IO[bytes], size: int) -> None:
    """Ask the system for the room that a file will need, where it can be asked.

    What is written is then given a place at once, not one by one as it is written, nor when the file takes the place of another.
    The file is as long as before: after a failure of the machine its length says what was written.

    Raises
    ------
    OSError
        If there is not so much room.
    """
    # Of systems of 32 bits some take sizes of 64.
    if not sys.platform.startswith("linux") or sys.maxsize < 1 << 32:
        return
    import ctypes  # noqa: PLC0415 - for this call alone

    allocate = getattr(ctypes.CDLL(None, use_errno=True), "fallocate", None)
    if allocate is None or allocate(file.fileno(), _KEEP_SIZE, ctypes.c_long(0), ctypes.c_long(size)) == 0:
        return
    number = ctypes.get_errno()
    if number in {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}:
        file.truncate()  # What there was is given back.
        raise OSError(number, os.strerror(number))


def write_columns(file: IO[bytes], columns: Mapping[str, npt.NDArray[Any]]) -> int:
    """Write columns one after the other, and return how many rows they have."""
    for values in columns.values():
        file.write(np.ascontiguousarray(values).view(np.uint8).data)
    return next(iter(columns.values())).size


def read_some(file: IO[bytes], row: np.dtype[Any], rows: int, span: tuple[int, int]) -> dict[str, npt.NDArray[Any]]:
    """Return some of so many rows whose columns lie one after the other from where the file stands."""
    begin, columns = file.tell(), {}
    for name in row.names or ():
        kind = row[name]
        file.seek(begin + span[0] * kind.itemsize)
        columns[name] = np.fromfile(file, kind, span[1] - span[0])
        begin += rows * kind.itemsize
    return columns


def read_columns(file: IO[bytes], row: np.dtype[Any], count: int) -> dict[str, npt.NDArray[Any]]:
    """Return the columns of the next so many rows of a file."""
    columns = {name: np.empty(count, row[name]) for name in row.names or ()}
    for first in range(0, count, _AT_ONCE):
        rows = np.fromfile(file, row, min(_AT_ONCE, count - first))
        for name, values in columns.items():
            values[first : first + rows.size] = rows[name]
    return columns
