"""Channels that were sampled together, with one axis of time for each group of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

_CLOSE = 1e-9
"""Seconds that times of two groups may differ by and still be the same."""


@dataclass
class Group:
    """Channels of one axis of time.

    Parameters
    ----------
    name : str
    time : ndarray, shape (n,), or None
        Seconds, where the file has them.
    channels : list of (name, unit, samples)
    """

    name: str
    time: Any
    channels: list[tuple[str, str, Any]] = field(default_factory=list)


def named(groups: Sequence[Group]) -> Iterator[tuple[str, Any]]:
    """Give all channels with names that differ and their units; several groups put their names before those of their channels."""
    merged: list[Group] = []
    for group in groups:
        if not group.channels:
            continue
        same = next((one for one in merged if _are_one(one.time, group.time)), None)
        names: set[str] = set() if same is None else {name for name, _, _ in same.channels}
        if same is None or names.intersection(name for name, _, _ in group.channels):
            merged.append(group)
        else:
            same.channels += group.channels
    used: dict[str, int] = {}
    for group in merged:
        prefix = f"{group.name}." if len(merged) > 1 else ""
        times = [] if group.time is None else [("time", "s", group.time)]
        for name, unit, samples in [*times, *group.channels]:
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
