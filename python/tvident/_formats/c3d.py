"""Points and analog channels of C3D files of motion capture."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tvident._formats.groups import Group, named

_QUANTITIES = (
    ("ANGLES", "ANGLE_UNITS"),
    ("FORCES", "FORCE_UNITS"),
    ("MOMENTS", "MOMENT_UNITS"),
    ("POWERS", "POWER_UNITS"),
)
"""Parameters that list points which are none, but results of a model, and their unit."""

_INTEL, _MOST_FRAMES = b"\x54", 65_535
"""How numbers are written; what a header can say."""


def variables(path: str, skipped: list[str]) -> Iterator[tuple[str, Any]]:
    """Give the coordinates of every point, NaN where it was hidden, and every analog channel, with units."""
    import ezc3d  # noqa: PLC0415 - an extra
    import numpy as np  # noqa: PLC0415 - within the limits

    file = ezc3d.c3d(path)
    point, analog = file["parameters"]["POINT"], file["parameters"]["ANALOG"]
    units = {
        name: unit for listed, of in _QUANTITIES for name in _texts(point, listed) for unit in _texts(point, of)[:1]
    }
    length = (_texts(point, "UNITS") or [""])[0]
    samples = np.asarray(file["data"]["points"])
    groups = []
    promised = _frames(path)
    if promised is not None and promised > samples.shape[2]:
        skipped.append(f"the last {promised - samples.shape[2]} of {promised} frames (the file was cut)")
    rate = _number(point, "RATE")
    if samples.size and rate:
        made = Group("points", np.arange(samples.shape[2]) / rate)
        for index, name in enumerate(_labels(point, samples.shape[1], "point")):
            for axis, letter in enumerate("xyz"):
                made.channels.append((f"{name}.{letter}", units.get(name, length), samples[axis, index]))
        groups.append(made)
    signals = np.asarray(file["data"]["analogs"])
    rate = _number(analog, "RATE")
    if signals.size and rate:
        signals = signals.reshape(signals.shape[-2], signals.shape[-1])
        names, of = _labels(analog, len(signals), "analog"), _texts(analog, "UNITS")
        made = Group("analog", np.arange(signals.shape[1]) / rate)
        for index, name in enumerate(names):
            made.channels.append((name, of[index] if index < len(of) else "", signals[index]))
        groups.append(made)
    yield from named(groups)


def _frames(path: str) -> int | None:
    """Return how many frames the header says that there are: the library tells how many it found."""
    with open(path, "rb") as file:  # noqa: PTH123 - a path as text
        header = file.read(512)
        file.seek(512 * (max(header[0], 1) - 1) + 3)
        is_little_endian = file.read(1) == _INTEL
    first, last = (int.from_bytes(header[at : at + 2], "little") for at in (6, 8))
    return last - first + 1 if is_little_endian and last < _MOST_FRAMES else None


def _labels(parameters: Any, count: int, other: str) -> list[str]:
    names = _texts(parameters, "LABELS")
    return [names[index] if index < len(names) and names[index] else f"{other}{index}" for index in range(count)]


def _texts(parameters: Any, name: str) -> list[str]:
    values = parameters[name]["value"] if name in parameters else []
    return [str(one).strip() for one in values]


def _number(parameters: Any, name: str) -> float:
    values = parameters[name]["value"] if name in parameters else []
    return float(values[0]) if len(values) else 0.0
