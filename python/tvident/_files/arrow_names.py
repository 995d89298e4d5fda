"""What columns of Parquet and Arrow files are called, and in which units: metadata of the table and of pandas, columns in columns."""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator, Mapping
from typing import Any

from tvident._files.channels import WIDEST_LIST

_UNITS = ("units", "unit")
_PANDAS = b"PANDAS_ATTRS"
"""Where pandas keeps the attributes of a table."""

NO_NAME = "__index_level_0__"
"""What pandas calls an index without a name."""


def units_of_table(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    """Return units by the names of columns, as an entry ``units`` of the table's metadata has them, or attributes of pandas."""
    if not metadata:
        return {}
    said = _said(metadata)
    attributes = _json(metadata.get(_PANDAS, b""))
    found: dict[str, str] = {}
    for name in reversed(_UNITS):
        for one in (_json(said.get(name, b"")), attributes.get(name)):
            if isinstance(one, Mapping):
                found |= {str(key): unit for key, unit in one.items() if isinstance(unit, str)}
    return found


def _said(metadata: Mapping[bytes, bytes]) -> dict[str, bytes]:
    """Return what metadata say, by keys in small letters."""
    return {key.decode(errors="replace").lower(): text for key, text in metadata.items()}


def _json(text: bytes) -> dict[str, Any]:
    try:
        found = json.loads(text)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def joined_levels(name: str) -> str:
    """Return the name of a column that pandas called by several levels, joined by dots: ``('elbow', 'angle [deg]')``."""
    if not name.startswith("("):
        return name
    try:
        levels = ast.literal_eval(name)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return name
    is_of_words = isinstance(levels, tuple) and bool(levels) and all(isinstance(one, str) for one in levels)
    return ".".join(filter(None, levels)) if is_of_words else name


def named_field(field: Any, units: Mapping[str, str]) -> tuple[str, str]:
    """Return what a column is called and its unit: that of its own metadata, or else of the table's."""
    name = joined_levels(field.name)
    said = _said(field.metadata or {})
    own = (said.get("unit") or said.get("units") or b"").decode(errors="replace")
    group = field.name.rpartition(".")[0]
    return name, own or units.get(field.name) or units.get(name) or units.get(group) or ""


def flat_columns(pa: Any, table: Any) -> Iterator[tuple[Any, Any]]:
    """Give fields and columns, those in structures and lists of one length with a name of their own: ``joint.q``, ``q.0``."""
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    for field, column in zip(table.schema, table.columns, strict=True):
        width = _width(pa, column)
        if not width:
            yield field, column
            continue
        flat = column.combine_chunks().flatten()
        for place in range(width):
            values = flat.take(pa.array(range(place, len(flat), width), pa.int64()))
            yield pa.field(f"{field.name}.{place}", flat.type, metadata=field.metadata), pa.chunked_array([values])


def _width(pa: Any, column: Any) -> int:
    """Return how many numbers each list of a column holds; none where they differ, are missing, or the column holds none."""
    kind = column.type
    is_list = pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)
    if not is_list or column.null_count or not len(column):
        return 0
    if not (pa.types.is_floating(kind.value_type) or pa.types.is_integer(kind.value_type)):
        return 0
    import pyarrow.compute as pc  # noqa: PLC0415 - an extra

    widths = pc.unique(pc.list_value_length(column)).to_pylist()
    return int(widths[0]) if len(widths) == 1 and 0 < widths[0] <= WIDEST_LIST else 0
