"""Columns of results in files and on the screen."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

ENDINGS = (".csv", ".npz")
"""Kinds of files that tables are written to."""


def header(name: str, units: Mapping[str, str]) -> str:
    """Return a column's name with its unit in brackets, where it has one."""
    unit = units.get(name) or units.get(name.removesuffix("_stderr"))
    return f"{name} [{unit}]" if unit else name


def write_table(path: str | Path, columns: Mapping[str, npt.NDArray[Any]], units: Mapping[str, str]) -> None:
    """Write columns to a CSV or NPZ file, which appears whole or not at all."""
    path = Path(path)
    check_place(path)
    with replaced(path) as file:
        if path.suffix == ".npz":
            named = {header(name, units): values for name, values in columns.items()}
            np.savez(file, allow_pickle=False, **named)
        else:
            write_csv(file, columns, units)


def check_place(path: Path) -> None:
    """Check that tables can be written to files of this kind, and that there is a folder for it."""
    if path.suffix not in ENDINGS:
        raise ValueError(
            f"results are written to files that end in {' or '.join(ENDINGS)}; got {path.name!r}; rename it"
        )
    check_folder(path)


def check_folder(path: Path) -> None:
    """Check that there is a folder for a file, and no folder of its name."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "this is a folder; give the name of a file", str(path))
    if not path.parent.is_dir():
        raise FileNotFoundError(
            errno.ENOENT, "there is no such folder; make it first, or write elsewhere", str(path.parent)
        )


def write_csv(file: IO[bytes], columns: Mapping[str, npt.NDArray[Any]], units: Mapping[str, str]) -> None:
    """Write columns as text: a header, then a line for every row, numbers with all their digits."""
    file.write((",".join(header(name, units) for name in columns) + "\n").encode())
    rows = len(next(iter(columns.values()), ()))
    block = 10_000
    for first in range(0, rows, block):
        parts = [values[first : first + block].tolist() for values in columns.values()]
        file.write("".join(",".join(map(repr, row)) + "\n" for row in zip(*parts, strict=True)).encode())


@contextmanager
def replaced(path: Path) -> Iterator[IO[bytes]]:
    """Give a file to write to that takes the place of another when all went well, and vanishes otherwise."""
    check_folder(path)
    try:
        descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        # Nobody knows the name of the file that was to be renamed.
        raise type(error)(error.errno, error.strerror, str(path)) from None
    try:
        with os.fdopen(descriptor, "wb") as file:
            yield file
        umask = os.umask(0)
        os.umask(umask)
        Path(name).chmod(0o666 & ~umask)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows of cells as lines: the first two columns to the left, numbers to the right."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    left = {0, 1, len(widths) - 1}
    return [
        "  ".join(
            cell.ljust(width) if column in left else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
