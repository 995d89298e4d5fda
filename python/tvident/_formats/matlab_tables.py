"""Tables and timetables in MATLAB files, which are objects there."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tvident._formats.told import cut, in_words

_HEADER, _PLACE, _VERSION, _HDF5 = 128, slice(116, 124), slice(124, 126), b"\x00\x02"
"""Bytes of the header, those that say where objects begin, and the version, of which 7.3 is one."""


def has_objects(path: str) -> bool:
    """Return whether a file holds objects, among which tables are."""
    with open(path, "rb") as file:  # noqa: PTH123 - a path as text
        header = file.read(_HEADER)
    if header[_VERSION] == _HDF5:
        import h5py  # noqa: PLC0415 - within the limits

        with h5py.File(path, "r") as file:
            return "#subsystem#" in file
    return header.startswith(b"MATLAB 5.0") and bool(header[_PLACE].strip(b" \0"))


def tables(path: str, skipped: list[str]) -> dict[str, dict[str, Any]]:
    """Return the columns of every table by the name of its variable, with units, and the times of timetables."""
    try:
        from matio import load_from_mat  # noqa: PLC0415 - an extra
    except ImportError:
        skipped.append("tables and timetables (they need mat-io; install it with: pip install 'tvident[io]')")
        return {}
    try:
        variables = load_from_mat(path, add_table_attrs=True)
    except Exception as error:  # noqa: BLE001 - of any kind; plain variables are read without it
        skipped.append(f"tables and timetables ({in_words(error)})")
        return {}
    return {
        name: dict(_columns(name, table, skipped))
        for name, table in variables.items()
        if hasattr(table, "columns") and hasattr(table, "index")
    }


def _columns(variable: str, table: Any, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    import numpy as np  # noqa: PLC0415 - within the limits

    index = table.index
    if index.dtype.kind in "mM" and len(index):
        start = index[0] if index.dtype.kind == "M" else np.timedelta64(0, "s")
        yield f"{index.name or 'Time'} [s]", np.asarray((index - start) / np.timedelta64(1, "s"))
    units = table.attrs.get("VariableUnits") or table.attrs.get("varUnits") or []
    for place, name in enumerate(table.columns):
        values = table[name]
        if getattr(values.dtype, "kind", "O") not in "biuf":
            skipped.append(f"{cut(f'{variable}.{name}')} (no numbers)")
            continue
        unit = str(units[place]) if place < len(units) else ""
        yield (f"{name} [{unit}]" if unit else str(name)), np.asarray(values)
