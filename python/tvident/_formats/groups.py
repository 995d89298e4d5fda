"""Channels that were sampled together, with one axis of time for each group of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from tvident import _arguments as arguments
from tvident._formats.told import cut
from tvident._units import UnitError, factor_between, without_brackets

_CLOSE = 1e-9
"""Seconds that times of two groups may differ by and still be the same."""

TIME = ("time", "s")


@dataclass
class Group:
    """Channels of one axis of time.

    Parameters
    ----------
    name : str
    time : ndarray, shape (n,), or None
        Times, where the file has them, or what it has samples at in their place.
    channels : list of (name, unit, samples)
    axis : (str, str)
        What `time` is called, and its unit.
    """

    name: str
    time: Any
    channels: list[tuple[str, str, Any]] = field(default_factory=list)
    axis: tuple[str, str] = TIME


def axis_of(name: str, unit: str) -> tuple[str, str]:
    """Return name and unit of what samples lie at: ``time`` where the unit is one of time, or nothing says that it is not."""
    name, unit = name.strip(), without_brackets(unit)
    if not unit:
        return TIME if not name or arguments.is_called_time(name) else (name, "")
    try:
        return TIME if factor_between(unit, "s", name=name) == 1 else (TIME[0], unit)
    except UnitError:
        return name or "abscissa", unit


def named(groups: Sequence[Group], skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give all channels with names that differ and their units; several groups put their names before those of their channels."""
    merged: list[Group] = []
    for group in groups:
        skipped += [f"{cut(name)} (no samples)" for name, _, samples in group.channels if not samples.size]
        group.channels = [one for one in group.channels if one[2].size]
        if not group.channels:
            continue
        same = next((one for one in merged if one.axis == group.axis and _are_one(one.time, group.time)), None)
        names: set[str] = set() if same is None else {name for name, _, _ in same.channels}
        if same is None or names.intersection(name for name, _, _ in group.channels):
            merged.append(group)
        else:
            same.channels += group.channels
    used: dict[str, int] = {}
    for group in merged:
        prefix = f"{group.name}." if len(merged) > 1 else ""
        times = [] if group.time is None else [(*group.axis, group.time)]
        for name, said, samples in [*times, *group.channels]:
            unit = without_brackets(said)
            full = prefix + (name or "channel")
            used[full] = used.get(full, 0) + 1
            if used[full] > 1:
                full = f"{full}_{used[full]}"
            yield (f"{full} [{unit}]" if unit else full), samples


def _are_one(time: Any, other: Any) -> bool:
    """Return whether two axes of time are the same."""
    if time is None or other is None or len(time) != len(other):
        return False
    return not len(time) or bool(abs(time - other).max() <= _CLOSE)
