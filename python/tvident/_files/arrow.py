"""Columns of Parquet and Arrow files."""

from __future__ import annotations

from itertools import chain
from itertools import count as count_from
from pathlib import Path
from typing import Any

import numpy as np

from tvident._files.arrow_names import NO_NAME, flat_columns, named_field, units_of_table
from tvident._files.channels import Channels, FileError, Say, check_count
from tvident._files.names import listed, printable
from tvident._units import named_unit, with_ending, with_unit


def read_arrow(path: Path, say: Say) -> Channels:
    """Read a Parquet, Feather or Arrow file; the unit of a column may be in its metadata."""
    try:
        import pyarrow as pa  # noqa: PLC0415 - an extra
        from pyarrow import ipc, parquet  # noqa: PLC0415 - likewise
    except ImportError:
        raise FileError("Parquet and Arrow files need pyarrow; install it with: pip install 'tvident[io]'") from None
    try:
        if path.suffix.lower() == ".parquet":
            table = parquet.read_table(path, page_checksum_verification=True)
        else:
            with pa.memory_map(str(path)) as file:
                try:
                    table = ipc.open_file(file).read_all()
                except pa.ArrowInvalid:
                    file.seek(0)
                    table = ipc.open_stream(file).read_all()
    except (pa.ArrowException, OSError, ValueError, EOFError) as error:
        raise FileError(f"it must be whole; pyarrow says: {printable(error, 200)}; copy it again") from None
    check_count(table.num_columns)
    channels: Channels = {}
    skipped: list[str] = []
    names: set[str] = set()
    units = units_of_table(table.schema.metadata)
    for field, column in flat_columns(pa, table):
        name, unit = named_field(field, units)
        values = _numbers(pa, column)
        if values is None:
            skipped.append(f"{name} ({field.type})")
            continue
        if pa.types.is_timestamp(field.type):
            say(f"column '{printable(name, 40)}' holds times: read as seconds since {column[0]}")
        if pa.types.is_timestamp(field.type) or pa.types.is_duration(field.type):
            unit = "s"
            name = "time" if name == NO_NAME and not {"time", "time [s]"} & channels.keys() else name
        name = _of_its_own(name, names, say)
        channels[name if named_unit(name)[1] else with_unit(name, unit)] = values
    if skipped:
        say(f"not read: {listed(skipped)}; channels are numbers")
    return channels


def _of_its_own(name: str, others: set[str], say: Say) -> str:
    """Return a name that no other has, and keep it: structures beside columns may have parts that are called as these are."""
    unique = next(
        one for one in chain([name], (with_ending(name, f"_{count}") for count in count_from(2))) if one not in others
    )
    if unique != name:
        say(
            f"two columns are called '{printable(name, 40)}', one of them part of a structure: the later one is "
            f"'{printable(unique, 40)}'"
        )
    others.add(unique)
    return unique


def _numbers(pa: Any, column: Any) -> Any:
    """Return a column as an array, NaN where nothing is; None where it holds no numbers."""
    kind = column.type
    if pa.types.is_dictionary(kind):
        column = column.cast(kind.value_type)
        kind = column.type
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind):
        whole = column.cast(pa.int64())
        per_second = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[kind.unit]
        found = np.asarray(whole.to_numpy() if not whole.null_count else whole.cast(pa.float64()).to_numpy())
        first = found[0] if pa.types.is_timestamp(kind) and found.size else 0
        return (found - first) / per_second
    if pa.types.is_boolean(kind):
        return np.asarray(column.to_numpy().astype(float)) if column.null_count else np.asarray(column.to_numpy())
    if pa.types.is_decimal(kind):
        column = column.cast(pa.float64())
    elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind)):
        return None
    return np.asarray(column.to_numpy())
