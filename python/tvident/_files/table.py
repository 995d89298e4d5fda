"""Columns of results in files and on the screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files.names import listed, printable
from tvident._files.places import check_place
from tvident._files.replacement import replaced
from tvident._files.table_formats import WRITERS, check_rows

_FORMULA = ("=", "+", "-", "@")
"""What a spreadsheet takes for the beginning of a formula."""


def header(name: str, units: Mapping[str, str]) -> str:
    """Return a column's name with its unit in brackets, where it has one."""
    unit = unit_of(name, units)
    return f"{name} [{unit}]" if unit else name


def unit_of(name: str, units: Mapping[str, str]) -> str:
    """Return the unit of a column: a standard error has that of what it belongs to."""
    return units.get(name) or units.get(name.removesuffix("_stderr"), "")


def _cell(name: str) -> str:
    """Return a name as a cell of text: in quotes where it holds a separator, with an apostrophe where a spreadsheet would compute it."""
    plain = printable(name, len(name))
    if plain.startswith(_FORMULA):
        plain = f"'{plain}"
    quoted = plain.replace('"', '""')
    return f'"{quoted}"' if any(one in plain for one in ',;"#') or plain != plain.strip() else plain


def write_table(path: str | Path, columns: Mapping[str, npt.NDArray[Any]], units: Mapping[str, str]) -> None:
    """Write columns to a file of the kind that its ending says, which appears whole or not at all."""
    path = arguments.path_of("path", path)
    check_place(path)
    ending = path.suffix.lower()
    if ending != ".npz":
        _check_lengths(columns)
        check_rows(ending, len(next(iter(columns.values()), ())))
    with replaced(path) as file:
        if ending in WRITERS:
            WRITERS[ending](file, columns, {name: unit_of(name, units) for name in columns})
        elif ending == ".npz":
            _write_npz(file, {header(name, units): values for name, values in columns.items()})
        else:
            write_csv(file, columns, units)


def _check_lengths(columns: Mapping[str, npt.NDArray[Any]]) -> None:
    """Refuse columns of a table that have no common length."""
    shapes = {name: np.shape(values) for name, values in columns.items()}
    if any(len(shape) != 1 for shape in shapes.values()) or len(set(shapes.values())) > 1:
        got = listed(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(
            f"columns of a table must have one length; got {got}; write a file that ends in .npz, or leave some out"
        )


def _write_npz(file: IO[bytes], columns: Mapping[str, npt.NDArray[Any]]) -> None:
    """Write what ``np.savez`` would, whose own arguments are no names for columns."""
    import zipfile  # noqa: PLC0415 - the library loads without

    with zipfile.ZipFile(file, "w", allowZip64=True) as archive:
        for name, values in columns.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(values), allow_pickle=False)


def write_csv(file: IO[bytes], columns: Mapping[str, npt.NDArray[Any]], units: Mapping[str, str]) -> None:
    """Write columns as text: a header, then a line for every row, numbers with all their digits."""
    file.write((",".join(_cell(header(name, units)) for name in columns) + "\n").encode())
    rows = len(next(iter(columns.values()), ()))
    block = 10_000
    for first in range(0, rows, block):
        parts = [values[first : first + block].tolist() for values in columns.values()]
        file.write("".join(",".join(map(repr, row)) + "\n" for row in zip(*parts, strict=True)).encode())


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
