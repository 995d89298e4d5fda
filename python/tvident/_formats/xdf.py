"""Streams of XDF files of the Lab Streaming Layer."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Any

from tvident._formats.groups import Group, named
from tvident._formats.told import cut


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the channels of every stream of numbers; clocks are corrected and jitter of the stamps is removed, as the library does it."""
    import numpy as np  # noqa: PLC0415 - within the limits
    import pyxdf  # noqa: PLC0415 - an extra

    logging.getLogger("pyxdf").addHandler(_ToldOfStream(skipped))
    streams, _ = pyxdf.load_xdf(path, synchronize_clocks=True, dejitter_timestamps=True, verbose=False)
    groups: list[Group] = []
    for stream in streams:
        info = stream["info"]
        name, series = str(info["name"][0]), stream["time_series"]
        if not isinstance(series, np.ndarray) or series.dtype.kind not in "biuf" or not series.size:
            skipped.append(f"{cut(name)} (no numbers)")
            continue
        columns = series.reshape(len(series), -1).T
        described = _described(info)
        labels = [
            described[index] if index < len(described) and described[index][0] else (str(index), "")
            for index in range(len(columns))
        ]
        channels = [(label, unit, values) for (label, unit), values in zip(labels, columns, strict=True)]
        groups.append(Group(name, np.asarray(stream["time_stamps"], dtype=float), channels))
    first = min((group.time[0] for group in groups if len(group.time)), default=0.0)
    for group in groups:
        # Stamps count from the start of a computer.
        group.time = group.time - first
    yield from named(groups)


class _ToldOfStream(logging.Handler):
    """Takes in what the library warns of: a damaged file is read up to the damage."""

    def __init__(self, skipped: list[str]) -> None:
        super().__init__(logging.WARNING)
        self._skipped = skipped

    def emit(self, record: logging.LogRecord) -> None:
        self._skipped.append(cut(record.getMessage()))


def _described(info: Any) -> list[tuple[str, str]]:
    """Return labels and units of channels, where the stream describes them."""
    try:
        channels = info["desc"][0]["channels"][0]["channel"]
    except (KeyError, IndexError, TypeError):
        return []
    return [tuple(str((one.get(key) or [""])[0] or "") for key in ("label", "unit")) for one in channels]  # type: ignore[misc]
