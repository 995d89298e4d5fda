"""Results of long recordings in files, written piece by piece."""

from __future__ import annotations

import io
import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from tvident._files import check_folder, printable, replaced, write_csv
from tvident._in_pieces.rows import make_room, write_rows

Columns = Mapping[str, npt.NDArray[Any]]

Put = Callable[[Columns], object]
"""Takes the next rows."""

CHUNK = 1 << 18
"""Rows of a chunk of a Zarr array, or of a row group of a Parquet file."""

_SLASH = "\u2215"
"""In the place of a slash, which would make a group."""

_KEY = "tvident"
"""Where settings and constants are, in files that hold more than columns."""


class OutputTable:
    """What is to be written.

    Parameters
    ----------
    kinds : mapping of str to dtype
        Columns and what they hold.
    rows : int
        How many there will be.
    units : mapping of str to str
    facts : mapping
        Settings and constants, as JSON has them.
    """

    def __init__(
        self, kinds: Mapping[str, np.dtype[Any]], rows: int, units: Mapping[str, str], facts: Mapping[str, Any]
    ) -> None:
        self.kinds = dict(kinds)
        self.rows = rows
        self.facts = json.dumps(facts)
        self.units = {name: units.get(name) or units.get(name.removesuffix("_stderr"), "") for name in kinds}


def holds_rows(path: Path) -> bool:
    """Return whether a file of this name holds rows as they are kept, after :func:`head_of_rows`."""
    return path.suffix.lower() == ".npy"


def holds_facts(path: Path) -> bool:
    """Return whether a file of this name holds settings and what was judged beside its columns."""
    return path.suffix.lower() not in {".npy", ".csv"}


def head_of_rows(row: np.dtype[Any], rows: int) -> bytes:
    """Return what a file of so many rows begins with."""
    head = io.BytesIO()
    np.lib.format.write_array_header_2_0(
        head, {"descr": np.lib.format.dtype_to_descr(row), "fortran_order": False, "shape": (rows,)}
    )
    return head.getvalue()


@contextmanager
def _npy(file: IO[bytes], table: OutputTable) -> Iterator[Put]:
    row = np.dtype(list(table.kinds.items()))
    head = head_of_rows(row, table.rows)
    make_room(file, len(head) + table.rows * row.itemsize)
    file.write(head)

    yield lambda columns: write_rows(file, row, columns)


@contextmanager
def _csv(file: IO[bytes], table: OutputTable) -> Iterator[Put]:
    text = io.BytesIO()
    write_csv(text, {name: np.empty(0, kind) for name, kind in table.kinds.items()}, table.units)
    file.write(text.getvalue())
    head = len(text.getvalue())

    def put(columns: Columns) -> None:
        rows = io.BytesIO()
        write_csv(rows, columns, table.units)
        file.write(rows.getbuffer()[head:])

    yield put


@contextmanager
def _parquet(file: IO[bytes], table: OutputTable) -> Iterator[Put]:
    import pyarrow as pa  # noqa: PLC0415 - an extra
    from pyarrow import parquet  # noqa: PLC0415 - likewise

    fields = [
        pa.field(
            name,
            pa.from_numpy_dtype(kind),
            nullable=False,
            metadata={b"unit": table.units[name].encode()} if table.units[name] else None,
        )
        for name, kind in table.kinds.items()
    ]
    schema = pa.schema(fields, {_KEY.encode(): table.facts.encode()})
    # Dictionaries, compression and statistics cost more than all the rest, and numbers with noise have no use for them.
    with parquet.ParquetWriter(
        file, schema, compression="NONE", use_dictionary=False, write_statistics=["time"], write_page_checksum=True
    ) as writer:

        def put(columns: Columns) -> None:
            arrays = [pa.array(values) for values in columns.values()]
            writer.write_table(pa.table(arrays, schema=schema), row_group_size=CHUNK)

        yield put


@contextmanager
def _hdf5(path: Path, table: OutputTable) -> Iterator[Put]:
    import h5py  # noqa: PLC0415 - an extra

    with h5py.File(path, "w", track_order=True) as file:
        file.attrs[_KEY] = table.facts
        made = {}
        for name, kind in table.kinds.items():
            made[name] = file.create_dataset(name.replace("/", _SLASH), shape=(table.rows,), dtype=kind)
            if table.units[name]:
                made[name].attrs["unit"] = table.units[name]
        yield _by_places(made)


@contextmanager
def _zarr(path: Path, table: OutputTable) -> Iterator[Put]:
    import zarr  # noqa: PLC0415 - an extra

    group = zarr.open_group(str(path), mode="w")
    group.attrs[_KEY] = table.facts
    made = {}
    for name, kind in table.kinds.items():
        # Noise cannot be compressed, and trying takes longer than all the rest.
        made[name] = group.create_array(
            name.replace("/", _SLASH),
            shape=(table.rows,),
            dtype=kind,
            chunks=(min(CHUNK, max(table.rows, 1)),),
            compressors=None,
        )
        if table.units[name]:
            made[name].attrs["unit"] = table.units[name]
    yield _by_places(made)


def _by_places(made: Mapping[str, Any]) -> Put:
    done = 0

    def put(columns: Columns) -> None:
        nonlocal done
        count = next(iter(columns.values())).size
        for name, values in columns.items():
            made[name][done : done + count] = values
        done += count

    return put


_IN_FILES: Mapping[str, Callable[[IO[bytes], OutputTable], Any]] = {".npy": _npy, ".csv": _csv, ".parquet": _parquet}
_AT_PLACES: Mapping[str, Callable[[Path, OutputTable], Any]] = {".h5": _hdf5, ".hdf5": _hdf5, ".zarr": _zarr}

ENDINGS = (*_IN_FILES, *_AT_PLACES)
"""Kinds of files that are written piece by piece."""

_PACKAGES = {".parquet": "pyarrow", ".h5": "h5py", ".hdf5": "h5py", ".zarr": "zarr"}


def check_output(path: Path) -> None:
    """Check, before any work, that a result can be written there.

    Raises
    ------
    ValueError
        If the ending is unknown.
    ImportError
        If a library is missing.
    OSError
        If there is no such folder, or nothing may be written there.
    """
    from importlib.util import find_spec  # noqa: PLC0415 - rarely needed

    ending = path.suffix.lower()
    if ending not in ENDINGS:
        known = f"{', '.join(ENDINGS[:-1])} or {ENDINGS[-1]}"
        raise ValueError(f"results of long recordings are written to {known}; got '{printable(path.name)}'; rename it")
    package = _PACKAGES.get(ending)
    if package is not None and find_spec(package) is None:
        raise ImportError(
            f"files that end in {ending} need {package}, which is not installed; install it with: pip install 'tvident[io]', "
            "or write to .npy or .csv"
        )
    if ending != ".zarr":
        check_folder(path)
    elif not path.parent.is_dir():
        raise FileNotFoundError(f"there is no such folder: {printable(path.parent)}; make it first, or write elsewhere")
    elif path.exists() and not _is_zarr(path):
        raise FileExistsError(f"only a Zarr group is replaced; {printable(path)} is something else; give another name")


def _is_zarr(path: Path) -> bool:
    return path.is_dir() and any((path / one).exists() for one in ("zarr.json", ".zgroup", ".zarray"))


@contextmanager
def writer(path: Path, table: OutputTable) -> Iterator[Put]:
    """Give what takes rows, which are at `path` when all went well; nothing is there otherwise but what was."""
    ending = path.suffix.lower()
    if ending in _IN_FILES:
        with replaced(path) as file, _IN_FILES[ending](file, table) as put:
            yield put
        return
    beside = path.with_name(f".{path.name}.{os.urandom(4).hex()}{ending}")
    try:
        with _AT_PLACES[ending](beside, table) as put:
            yield put
        if path.is_dir():
            old = path.with_name(f".{path.name}.{os.urandom(4).hex()}.old")
            path.rename(old)
            beside.rename(path)
            shutil.rmtree(old, ignore_errors=True)
        else:
            beside.replace(path)
    except BaseException:
        shutil.rmtree(beside, ignore_errors=True) if beside.is_dir() else beside.unlink(missing_ok=True)
        raise
