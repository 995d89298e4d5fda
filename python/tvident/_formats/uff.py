"""Functions of time in universal files (dataset 58)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tvident._formats.groups import Group, named
from tvident._formats.told import cut

_FUNCTION, _TIME_RESPONSE = 58, 1
_LAST_LINE = 200
"""Bytes that hold the last line, and blanks behind it."""

_DIRECTIONS = {1: "+x", -1: "-x", 2: "+y", -2: "-y", 3: "+z", -3: "-z"}


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every response in time, called by its first line of identification or by its place, with the unit of its ordinate."""
    import numpy as np  # noqa: PLC0415 - within the limits
    import pyuff  # noqa: PLC0415 - an extra

    file = pyuff.UFF(path)
    kinds = [int(kind) for kind in np.ravel(file.get_set_types())]
    if not kinds:
        raise ValueError("it holds no dataset")
    with open(path, "rb") as raw:  # noqa: PTH123 - a path as text
        raw.seek(max(0, raw.seek(0, 2) - _LAST_LINE))
        if not raw.read().rstrip().endswith(b"-1"):
            skipped.append("the last dataset (it has no end: the file was cut)")
    groups: list[Group] = []
    for index, kind in enumerate(kinds):
        if kind != _FUNCTION:
            skipped.append(f"dataset {index} (of type {kind})")
            continue
        one = file.read_sets(index)
        name = _name(one, index)
        if int(one.get("func_type", _TIME_RESPONSE)) not in {0, _TIME_RESPONSE} or np.iscomplexobj(one["data"]):
            skipped.append(f"{cut(name)} (no function of time)")
            continue
        unit = str(one.get("ordinate_axis_units_lab") or "").strip()
        groups.append(
            Group(
                f"set{index}", np.asarray(one["x"]), [(name, "" if unit == "NONE" else unit, np.asarray(one["data"]))]
            )
        )
    yield from named(groups)


def _name(one: Any, index: int) -> str:
    given = str(one.get("id1") or "").strip()
    if given and given != "NONE":
        return given
    node, direction = one.get("rsp_node"), one.get("rsp_dir")
    return f"node{node}{_DIRECTIONS.get(direction, '')}" if node else f"set{index}"
