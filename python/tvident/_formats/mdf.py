"""Signals of MDF files of version 3 and 4."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tvident._formats.groups import TIME, Group, named
from tvident._formats.told import Remark, cut, in_words

_OF_TIME, _OTHERS = 1, {2: "rad", 3: "m"}
"""Kinds of axes that are one of time, and the units of others."""


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every signal of numbers with its unit, and the times of each group of them; conversions of the file are applied."""
    from asammdf import MDF  # noqa: PLC0415 - an extra

    groups: list[Group] = []
    with MDF(path) as file:
        every: Any = file.groups
        for number, group in enumerate(every):
            master = file.masters_db.get(number)
            axis = TIME if master is None else _axis(group.channels[master])
            made = Group(_name(group, number), None, axis=axis)
            for index, channel in enumerate(group.channels):
                if index == master:
                    continue
                try:
                    # Invalid samples would be left out, and those behind them come earlier.
                    signal = file.get(group=number, index=index, ignore_invalidation_bits=True)
                except Exception as error:  # noqa: BLE001 - of one signal; the others may be whole
                    skipped.append(f"{cut(channel.name)} ({in_words(error)})")
                    continue
                if signal.samples.dtype.kind not in "biuf" or signal.samples.ndim != 1:
                    skipped.append(f"{cut(channel.name)} (no numbers)")
                    continue
                if made.time is None or len(made.time) != len(signal.timestamps):
                    made = made if made.time is None else Group(made.name, None, axis=axis)
                    made.time = signal.timestamps
                    groups.append(made)
                made.channels.append((signal.name, str(signal.unit or ""), _without_invalid(signal, skipped)))
    yield from named(groups, skipped)


def _without_invalid(signal: Any, skipped: list[str]) -> Any:
    """Return samples, NaN where the file says that they are none."""
    import numpy as np  # noqa: PLC0415 - within the limits

    if signal.invalidation_bits is None:
        return signal.samples
    invalid = np.asarray(signal.invalidation_bits, dtype=bool)
    if not invalid.any():
        return signal.samples
    skipped.append(
        Remark(
            f"channel {cut(signal.name)}: {np.count_nonzero(invalid)} samples that the file calls invalid are missing"
        )
    )
    return np.where(invalid, np.nan, signal.samples)


def _axis(master: Any) -> tuple[str, str]:
    """Return name and unit of what samples lie at: some lie at angles of a shaft, ways or numbers."""
    kind = getattr(master, "sync_type", _OF_TIME)
    if kind in {0, _OF_TIME}:
        return TIME
    return str(master.name or "abscissa"), str(master.unit or _OTHERS.get(kind, ""))


def _name(group: Any, number: int) -> str:
    return str(getattr(group.channel_group, "acq_name", "") or f"group{number}")
