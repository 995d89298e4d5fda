"""Signals of MDF files of version 3 and 4."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tvident._formats.groups import Group, named
from tvident._formats.told import cut, in_words


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every signal of numbers with its unit, and the times of each group of them; conversions of the file are applied."""
    from asammdf import MDF  # noqa: PLC0415 - an extra

    groups: list[Group] = []
    with MDF(path) as file:
        every: Any = file.groups
        for number, group in enumerate(every):
            master = file.masters_db.get(number)
            made = Group(_name(group, number), None)
            for index, channel in enumerate(group.channels):
                if index == master:
                    continue
                try:
                    signal = file.get(group=number, index=index, ignore_invalidation_bits=False)
                except Exception as error:  # noqa: BLE001 - of one signal; the others may be whole
                    skipped.append(f"{cut(channel.name)} ({in_words(error)})")
                    continue
                if signal.samples.dtype.kind not in "biuf" or signal.samples.ndim != 1:
                    skipped.append(f"{cut(channel.name)} (no numbers)")
                    continue
                if made.time is None or len(made.time) != len(signal.timestamps):
                    made = made if made.time is None else Group(made.name, None)
                    made.time = signal.timestamps
                    groups.append(made)
                made.channels.append((signal.name, str(signal.unit or ""), signal.samples))
    yield from named(groups)


def _name(group: Any, number: int) -> str:
    return str(getattr(group.channel_group, "acq_name", "") or f"group{number}")
