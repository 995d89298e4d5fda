"""Files of results: columns that everybody reads, and beside them in JSON what brings the result back."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._files.channels import FileError
from tvident._files.names import printable
from tvident._files.places import check_folder
from tvident._files.replacement import replaced
from tvident._files.table import header

Arrays = Mapping[str, npt.NDArray[Any]]

_MEMBER, _KEY = "tvident.json", b"tvident"
"""Where the JSON is: a member of an NPZ file, an entry of the metadata of a Parquet file."""

ENDINGS = (".npz", ".parquet")
"""Files that a result comes back from."""


def keeps_result(path: str | Path) -> bool:
    """Return whether a file of this name is one that a result comes back from."""
    return Path(path).suffix.lower() in ENDINGS


def write_result(path: Path, arrays: Arrays, units: Mapping[str, str], facts: str) -> None:
    """Write a result to an NPZ or Parquet file, which appears whole or not at all.

    Raises
    ------
    ValueError
        If a table is to hold several records.
    ImportError
        If pyarrow is missing for Parquet.
    """
    check_folder(path)
    named = {header(name, units): values for name, values in arrays.items()}
    if path.suffix.lower() == ".npz":
        import zipfile  # noqa: PLC0415 - the library loads without

        with replaced(path) as file, zipfile.ZipFile(file, "w", allowZip64=True) as archive:
            for name, values in named.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, np.asanyarray(values), allow_pickle=False)
            archive.writestr(_MEMBER, facts)
        return
    arrow, parquet = _parquet()
    if any(values.ndim != 1 or values.size != arrays["time"].size for values in arrays.values()):
        raise ValueError(
            "a Parquet file holds a single record; got several, or coordinates of several; save to .npz, or take one: result[0]"
        )
    table = arrow.table({name: np.ascontiguousarray(values) for name, values in named.items()})
    with replaced(path) as file:
        parquet.write_table(table.replace_schema_metadata({_KEY: facts.encode()}), file, write_page_checksum=True)


def read_result(path: Path) -> tuple[dict[str, npt.NDArray[Any]], str]:
    """Return what `write_result` wrote: arrays by name, and the JSON.

    Raises
    ------
    FileError
        If the file is not there, damaged, or none that holds a result.
    """
    place = printable(path)
    if not keeps_result(path):
        raise FileError(
            f"{place}: a result comes back from {' or '.join(ENDINGS)}; got '{printable(path.suffix)}'; other files keep columns only, "
            "and their settings beside them: read them with tvident.read_recording"
        )
    if not path.exists():
        raise FileError(f"{place}: there is no such file; check the name and the folder")
    if not path.is_file():
        raise FileError(f"{place}: must be a file; it is a folder, a pipe or a device; name the file")
    try:
        named, facts = _from_npz(path) if path.suffix.lower() == ".npz" else _from_parquet(path)
    except (FileError, MemoryError, ImportError):
        raise
    except Exception as error:  # noqa: BLE001 - damaged archives raise many kinds
        raise FileError(f"{place}: must be whole; it cannot be read ({printable(error, 80)}); copy it again") from None
    if facts == "":
        raise FileError(
            f"{place}: must hold a result as result.save writes it; it holds others' columns; identify again"
        )
    return {name.partition(" [")[0]: values for name, values in named.items()}, facts


def _from_npz(path: Path) -> tuple[dict[str, npt.NDArray[Any]], str]:
    arrays: dict[str, npt.NDArray[Any]] = {}
    import zipfile  # noqa: PLC0415 - the library loads without

    with zipfile.ZipFile(path) as archive:
        if _MEMBER not in archive.namelist():
            return {}, ""
        for member in archive.namelist():
            if member.endswith(".npy"):
                content = io.BytesIO(archive.read(member))
                arrays[member.removesuffix(".npy")] = np.lib.format.read_array(content, allow_pickle=False)
        return arrays, archive.read(_MEMBER).decode()


def _from_parquet(path: Path) -> tuple[dict[str, npt.NDArray[Any]], str]:
    _, parquet = _parquet()
    table = parquet.read_table(path, page_checksum_verification=True)
    facts = (table.schema.metadata or {}).get(_KEY, b"").decode()
    return {name: table.column(name).to_numpy() for name in table.column_names}, facts


def _parquet() -> tuple[Any, Any]:
    try:
        import pyarrow as pa  # noqa: PLC0415 - optional
        from pyarrow import parquet  # noqa: PLC0415 - likewise
    except ImportError:
        raise ImportError(
            "Parquet files need pyarrow, which is not installed; install it with: pip install 'tvident[io]', or save to .npz"
        ) from None
    return pa, parquet
