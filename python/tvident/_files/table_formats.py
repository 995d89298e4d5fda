"""Tables in files of other programs: Parquet, HDF5, MATLAB and workbooks."""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Mapping
from importlib.util import find_spec
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from tvident._files.channels import FileWarning
from tvident._files.names import listed, printable

Columns = Mapping[str, npt.NDArray[Any]]

PACKAGES = {".parquet": "pyarrow", ".h5": "h5py", ".hdf5": "h5py", ".mat": "scipy", ".xlsx": "openpyxl"}
"""What each needs, by the ending; the extra ``io`` installs it."""

_MOST_ROWS = 1_048_576
"""Of a sheet, its header among them."""

_LONGEST_NAME = 63
"""Of a variable of MATLAB."""


def check_installed(ending: str) -> None:
    """Check, before any work, that a file of this ending can be written.

    Raises
    ------
    ImportError
        If its library is missing.
    """
    package = PACKAGES.get(ending)
    if package is not None and find_spec(package) is None:
        raise ImportError(
            f"files that end in {ending} need {package}, which is not installed; install it with: pip install 'tvident[io]', "
            "or write to .csv or .npz"
        )


def check_rows(ending: str, rows: int) -> None:
    """Refuse more rows than a sheet has."""
    if ending == ".xlsx" and rows >= _MOST_ROWS:
        raise ValueError(
            f"a sheet has at most {_MOST_ROWS - 1} rows of numbers; there are {rows}; write to .csv or .parquet, or take every step-th"
        )


def write_parquet(file: IO[bytes], columns: Columns, units: Mapping[str, str]) -> None:
    """Write columns with their units in the metadata."""
    import pyarrow as pa  # noqa: PLC0415 - an extra
    from pyarrow import parquet  # noqa: PLC0415 - likewise

    arrays = [pa.array(np.ascontiguousarray(values)) for values in columns.values()]
    fields = [
        pa.field(name, array.type, metadata={b"unit": units[name].encode()} if units.get(name) else None)
        for name, array in zip(columns, arrays, strict=True)
    ]
    parquet.write_table(pa.table(arrays, schema=pa.schema(fields)), file, write_page_checksum=True)


def write_hdf5(file: IO[bytes], columns: Columns, units: Mapping[str, str]) -> None:
    """Write a dataset for every column, with its unit as an attribute."""
    import h5py  # noqa: PLC0415 - an extra

    content = io.BytesIO()  # the library reads what it writes
    with h5py.File(content, "w", track_order=True) as made:
        for name, values in columns.items():
            # A slash would make a group.
            data = np.ascontiguousarray(values)
            data = data.astype(h5py.string_dtype()) if data.dtype.kind == "U" else data
            dataset = made.create_dataset(name.replace("/", "\u2215"), data=data)
            if units.get(name):
                dataset.attrs["unit"] = units[name]
    file.write(content.getbuffer())


def write_mat(file: IO[bytes], columns: Columns, units: Mapping[str, str]) -> None:
    """Write a variable for every column, and their units as fields of one structure."""
    from scipy.io import savemat  # noqa: PLC0415 - an extra

    names = _variables(list(columns))
    content: dict[str, Any] = {names[name]: np.ascontiguousarray(values)[:, None] for name, values in columns.items()}
    known = {names[name]: units[name] for name in columns if units.get(name)}
    renamed = [f"{printable(name, 40)} is called {names[name]}" for name in columns if names[name] != name]
    if renamed:
        warnings.warn(
            f"variables of MATLAB have letters, digits and _ in their names: {listed(renamed)}",
            FileWarning,
            stacklevel=2,
        )
    savemat(file, content | ({"units": known} if known else {}), do_compression=True, long_field_names=True)


def _variables(names: list[str]) -> dict[str, str]:
    """Return names that MATLAB allows, which differ."""
    found: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        bare = (plain if plain[:1].isalpha() else f"x{plain}")[:_LONGEST_NAME]
        unique, count = bare, 1
        while unique in found.values() or unique == "units":
            count += 1
            unique = f"{bare[: _LONGEST_NAME - 4]}_{count}"
        found[name] = unique
    return found


def write_xlsx(file: IO[bytes], columns: Columns, units: Mapping[str, str]) -> None:
    """Write a sheet: names, units, then a row for every sample; a cell without a number is empty, of an infinite one says so."""
    from openpyxl import Workbook  # noqa: PLC0415 - an extra
    from openpyxl.cell import WriteOnlyCell  # noqa: PLC0415 - likewise

    book = Workbook(write_only=True)
    sheet = book.create_sheet("tvident")

    def words(text: str) -> Any:
        """Return a cell that is never computed, without characters that a sheet must not hold."""
        cell = WriteOnlyCell(sheet, printable(text, len(text)))
        cell.data_type = "s"
        return cell

    def number(value: float) -> Any:
        """Return what becomes the number, None where it is none: openpyxl itself writes 16 digits, and some doubles have 17."""
        if math.isnan(value):
            # In a sheet of one column an empty cell would be an empty line.
            return None if len(columns) > 1 else words("nan")
        if math.isinf(value):
            return words(repr(value))
        if float(f"{value:.16g}") == value:
            return value
        cell = WriteOnlyCell(sheet, repr(value))
        cell.data_type = "n"
        return cell

    sheet.append([words(f"{name} [{units[name]}]" if units.get(name) else name) for name in columns])
    lists = [
        [words(one) if isinstance(one, str) else number(one) for one in values.tolist()] for values in columns.values()
    ]
    for row in zip(*lists, strict=True):
        sheet.append(row)
    book.save(file)


WRITERS = {
    ".parquet": write_parquet,
    ".h5": write_hdf5,
    ".hdf5": write_hdf5,
    ".mat": write_mat,
    ".xlsx": write_xlsx,
}
"""By the ending."""
