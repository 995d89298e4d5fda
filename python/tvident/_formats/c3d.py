"""Points and analog channels of C3D files of motion capture."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tvident._formats.groups import Group, named
from tvident._formats.told import Remark

_QUANTITIES = (
    ("ANGLES", "ANGLE_UNITS"),
    ("FORCES", "FORCE_UNITS"),
    ("MOMENTS", "MOMENT_UNITS"),
    ("POWERS", "POWER_UNITS"),
)
"""Parameters that list points which are none, but results of a model, and their unit."""

_INTEL, _MOST_FRAMES = b"\x54", 65_535
"""How numbers are written; what a header can say."""

_BLOCK = 512
"""Bytes."""


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the coordinates of every point, NaN where it was hidden, and every analog channel, with units."""
    import ezc3d  # noqa: PLC0415 - an extra
    import numpy as np  # noqa: PLC0415 - within the limits

    promised = _frames(path)
    file = ezc3d.c3d(path)
    point, analog = file["parameters"]["POINT"], file["parameters"]["ANALOG"]
    # What a model found is in no unit of length, whether or not the file says in which.
    units = {name: (*_texts(point, of), "")[0] for listed, of in _QUANTITIES for name in _texts(point, listed)}
    length = (_texts(point, "UNITS") or [""])[0]
    samples = np.asarray(file["data"]["points"])
    groups = []
    if promised is not None and promised > samples.shape[2]:
        skipped.append(f"the last {promised - samples.shape[2]} of {promised} frames (the file was cut)")
    rate = _number(point, "RATE")
    if samples.size:
        made = Group("points", _times(samples.shape[2], rate, "points", skipped))
        for index, name in enumerate(_labels(point, samples.shape[1], "point")):
            for axis, letter in enumerate("xyz"):
                made.channels.append((f"{name}.{letter}", units.get(name, length), samples[axis, index]))
        groups.append(made)
    signals = np.asarray(file["data"]["analogs"])
    rate = _number(analog, "RATE")
    if signals.size:
        signals = signals.reshape(signals.shape[-2], signals.shape[-1])
        names, of = _labels(analog, len(signals), "analog"), _texts(analog, "UNITS")
        made = Group("analog", _times(signals.shape[1], rate, "analog channels", skipped))
        for index, name in enumerate(names):
            made.channels.append((name, of[index] if index < len(of) else "", signals[index]))
        groups.append(made)
    yield from named(groups, skipped)


def _times(samples: int, rate: float, what: str, skipped: list[str]) -> Any:
    import numpy as np  # noqa: PLC0415 - within the limits

    if 0 < rate < np.inf:
        return np.arange(samples) / rate
    skipped.append(Remark(f"the rate of the {what} is {rate:g}, so they have no times"))
    return None


def _frames(path: str) -> int | None:
    """Return how many frames the header says that there are: the library tells how many it found.

    Raises
    ------
    ValueError
        If the file ends before its data begin, where the library would never end.
    """
    with open(path, "rb") as file:  # noqa: PTH123 - a path as text
        header = file.read(_BLOCK)
        file.seek(_BLOCK * (max(header[0], 1) - 1) + 3)
        is_little_endian = file.read(1) == _INTEL
        size = file.seek(0, 2)
    if is_little_endian and size <= _BLOCK * (int.from_bytes(header[16:18], "little") - 1):
        raise ValueError("it ends before its data begin")
    first, last = (int.from_bytes(header[at : at + 2], "little") for at in (6, 8))
    return last - first + 1 if is_little_endian and last < _MOST_FRAMES else None


def _labels(parameters: Any, count: int, other: str) -> list[str]:
    names = _texts(parameters, "LABELS")
    return [names[index] if index < len(names) and names[index] else f"{other}{index}" for index in range(count)]


def _texts(parameters: Any, name: str) -> list[str]:
    """Return the texts of a parameter; what are more than 255 goes on in others, as LABELS2."""
    found: list[str] = []
    more = 1
    full = name
    while full in parameters:
        found += [str(one).strip() for one in parameters[full]["value"]]
        more += 1
        full = f"{name}{more}"
    return found


def _number(parameters: Any, name: str) -> float:
    values = parameters[name]["value"] if name in parameters else []
    return float(values[0]) if len(values) else 0.0
