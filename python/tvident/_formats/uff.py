"""Functions of time in universal files (dataset 58)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tvident._formats.groups import TIME, Group, axis_of, named
from tvident._formats.told import Remark, cut, in_words

_FUNCTION, _TIME_RESPONSE = 58, 1
_LAST_LINE = 200
"""Bytes that hold the last line, and blanks behind it."""

_DIRECTIONS = {
    sign * (3 * turns + place): f"{'+' if sign > 0 else '-'}{'r' * turns}{letter}"
    for sign in (1, -1)
    for turns in (0, 1)
    for place, letter in enumerate("xyz", start=1)
}
"""Translations along axes, and rotations about them."""

_UNKNOWN, _TIME = 0, 17
"""What an abscissa is."""


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
        try:
            one = file.read_sets(index)
        except Exception as error:  # noqa: BLE001 - of one dataset; the others may be whole
            skipped.append(f"dataset {index} ({in_words(error)})")
            continue
        name, axis = _name(one, index), _axis(one)
        is_of_time = int(one.get("func_type", _TIME_RESPONSE)) in {0, _TIME_RESPONSE} and axis[0] == TIME[0]
        if not is_of_time or np.iscomplexobj(one["data"]):
            skipped.append(f"{cut(name)} (no function of time)")
            continue
        samples = np.asarray(one["data"])
        times: Any = np.asarray(one["x"])
        # The library takes what it finds up to the next mark.
        count = int(one.get("num_pts") or samples.size)
        if samples.size < count:
            skipped.append(f"{cut(name)} (it holds {samples.size} of {count} samples: it is damaged)")
            continue
        if not (np.diff(times[:2]) > 0).all():
            skipped.append(Remark(f"channel {cut(name)}: its times do not increase, so it has none"))
            times = None
        unit = str(one.get("ordinate_axis_units_lab") or "").strip()
        unit = "" if unit.upper() == "NONE" else unit
        groups.append(
            Group(f"set{index}", None if times is None else times[:count], [(name, unit, samples[:count])], axis)
        )
    yield from named(groups, skipped)


def _axis(one: Any) -> tuple[str, str]:
    """Return name and unit of the abscissa: general functions may be of a frequency, or of anything."""
    label, unit = (str(one.get(f"abscissa_axis{of}_lab") or "").strip() for of in ("", "_units"))
    unit = "" if unit.upper() == "NONE" else unit
    if int(one.get("abscissa_spec_data_type") or _UNKNOWN) == _TIME:
        return axis_of("", unit)
    return axis_of("" if label.upper() == "NONE" else label, unit)


def _name(one: Any, index: int) -> str:
    given = str(one.get("id1") or "").strip()
    if given and given != "NONE":
        return given
    node, direction = one.get("rsp_node"), one.get("rsp_dir")
    return f"node{node}{_DIRECTIONS.get(direction, '')}" if node else f"set{index}"
