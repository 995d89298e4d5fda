"""Channels of TDMS files of National Instruments."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from tvident._formats.groups import Group, named
from tvident._formats.told import cut

_UNITS = ("unit_string", "ni_unitdescription", "unit", "units", "y_unit_label", "unit_description")
"""Properties that hold a unit, in small letters."""

_UNSET = "1904-01-02"
"""A start before it was not set."""

_SAME_START = 1e-3
"""Parts of a sample period that two starts may differ by and still be one."""


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give every channel of numbers with its unit, and the times of those that know their sample period."""
    import numpy as np  # noqa: PLC0415 - within the limits
    from nptdms import TdmsFile  # noqa: PLC0415 - an extra

    file = TdmsFile.read(path)
    if file.file_status.incomplete_final_segment:
        skipped.append("what was cut off at the end of the file (channels may have different lengths)")
    starts = [one.properties["wf_start_time"] for group in file.groups() for one in group.channels() if _has_start(one)]
    groups: list[Group] = []
    for group in file.groups():
        for channel in group.channels():
            samples, properties = channel[:], channel.properties
            if samples.dtype.kind == "M":
                unit, samples = (
                    "s",
                    (samples - samples[0]) / np.timedelta64(1, "s") if samples.size else samples.astype(float),
                )
            elif samples.dtype.kind not in "biuf":
                skipped.append(f"{cut(channel.name)} (no numbers)")
                continue
            else:
                unit = _unit(properties)
            period, first = properties.get("wf_increment"), properties.get("wf_start_offset", 0.0)
            time = None
            if period and samples.size:
                later = (
                    (properties["wf_start_time"] - min(starts)) / np.timedelta64(1, "s") if _has_start(channel) else 0.0
                )
                later = later if later > _SAME_START * period else 0.0
                time = float(first) + later + float(period) * np.arange(samples.size)
            part = Group(group.name, time, [(channel.name, unit, samples)])
            before = next((one for one in groups if one.name == group.name and _same(one.time, time)), None)
            if before is None:
                groups.append(part)
            else:
                before.channels += part.channels
    yield from named(groups)


def _has_start(channel: Any) -> bool:
    import numpy as np  # noqa: PLC0415 - within the limits

    start = channel.properties.get("wf_start_time")
    # Text is no time, and the first instant of 1904 stands for none.
    is_set = isinstance(start, np.datetime64) and bool(start >= np.datetime64(_UNSET))
    return is_set and bool(channel.properties.get("wf_increment"))


def _unit(properties: Mapping[str, Any]) -> str:
    lower = {str(name).lower(): value for name, value in properties.items()}
    return next((str(lower[name]) for name in _UNITS if lower.get(name)), "")


def _same(time: Any, other: Any) -> bool:
    if time is None or other is None:
        return time is other
    return len(time) == len(other) and bool(abs(time - other).max() <= 0)
