"""Streams of XDF files of the Lab Streaming Layer."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator, Mapping
from typing import Any

from tvident._formats.groups import Group, named
from tvident._formats.told import Logged, Remark, cut

_DAMAGED = ("corruption", "chunk length", "zero-length")
"""Words of the library about a part of the file that it left out."""

_OF_ITSELF = ("Segments and clock-segments differ",)
"""What it says of nothing that a user could see."""

_STREAM = re.compile(r"Stream (\d+)\b")


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the channels of every stream of numbers; clocks are corrected and jitter of the stamps is removed, as the library does it."""
    import numpy as np  # noqa: PLC0415 - within the limits
    import pyxdf  # noqa: PLC0415 - an extra

    told = Logged()
    logging.getLogger("pyxdf").addHandler(told)
    streams, _ = pyxdf.load_xdf(path, synchronize_clocks=True, dejitter_timestamps=True, verbose=False)
    names = {str(stream["info"]["stream_id"]): str(stream["info"]["name"][0]) for stream in streams}
    skipped += _in_words(told, names)
    groups: list[Group] = []
    uncorrected: list[str] = []
    for stream in streams:
        info = stream["info"]
        name, series = str(info["name"][0]), stream["time_series"]
        if not isinstance(series, np.ndarray) or series.dtype.kind not in "biuf" or not series.size:
            skipped.append(f"{cut(name)} (no {'numbers' if len(series) else 'samples'})")
            continue
        columns = series.reshape(len(series), -1).T
        described = _described(info)
        labels = [
            described[index] if index < len(described) and described[index][0] else (str(index), "")
            for index in range(len(columns))
        ]
        channels = [(label, unit, values) for (label, unit), values in zip(labels, columns, strict=True)]
        groups.append(Group(name, np.asarray(stream["time_stamps"], dtype=float), channels))
        uncorrected += [] if len(stream["clock_times"]) else [cut(name)]
    if uncorrected and len(groups) > 1:
        skipped.append(
            Remark(
                f"stream {', '.join(uncorrected)}: the file has no corrections of its clock; beside other streams its times are right only "
                "if one computer sent all"
            )
        )
    first = min((group.time[0] for group in groups if len(group.time)), default=0.0)
    for group in groups:
        # Stamps count from the start of a computer.
        group.time = group.time - first
    yield from named(groups, skipped)


def _in_words(told: Logged, names: Mapping[str, str]) -> Iterator[str]:
    """Give what the library warned of, with the names of streams: a damaged file is read up to the damage."""
    for message in told.messages:
        if any(word in message for word in _DAMAGED):
            yield f"a part of the file (damaged, or cut: {cut(message)})"
        elif not any(word in message for word in _OF_ITSELF):
            yield Remark(_STREAM.sub(lambda found: f"stream {names.get(found[1], found[1])}", cut(message)))


def _described(info: Any) -> list[tuple[str, str]]:
    """Return labels and units of channels, where the stream describes them."""
    try:
        channels = info["desc"][0]["channels"][0]["channel"]
    except (KeyError, IndexError, TypeError):
        return []
    return [tuple(str((one.get(key) or [""])[0] or "") for key in ("label", "unit")) for one in channels]  # type: ignore[misc]
