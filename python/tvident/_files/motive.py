"""Exports of OptiTrack's Motive: names of bodies, what is told of them and axes in lines of their own, units in the first line."""

from __future__ import annotations

import re

from tvident._files.cells import split
from tvident._files.channels import FileError
from tvident._units import with_unit

START = re.compile(r"Format Version,[\d.]+,")
"""How such a text begins."""

_MOST_ABOVE = 12
"""Lines in which names must stand."""

_TIMES = re.compile(r"Time \(Seconds\)", re.IGNORECASE)
_LENGTHS = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}


def plain_text(text: str) -> str:
    """Return a text in columns with one line of names: that of the body, what is told of it, and the axis, with its unit."""
    lines = text.split("\n")
    place = next((place for place, line in enumerate(lines[:_MOST_ABOVE]) if line.startswith("Frame,")), None)
    if place is None:
        raise FileError(
            "an export of Motive must have a line that begins with Frame above its numbers; export it again"
        )
    first = split(lines[0], ",")
    said = dict(zip(first[::2], first[1::2], strict=False))
    above = [split(line, ",") for line in lines[1:place] if line.strip(", \r")]
    axes = split(lines[place], ",")
    kinds, names = above[-1] if above else [], above[1] if len(above) > 1 else []
    length = _LENGTHS.get(said.get("Length Units", "").casefold(), "")
    angle = "" if said.get("Rotation Type", "").casefold() in {"", "quaternion"} else "deg"
    found = []
    for column, axis in enumerate(axes):
        name, kind = (cells[column] if column < len(cells) else "" for cells in (names, kinds))
        unit = {"position": length, "rotation": angle}.get(kind.casefold(), "")
        whole = ".".join(dict.fromkeys(filter(None, (name, kind, axis))))
        found.append("time [s]" if _TIMES.fullmatch(axis) else with_unit(whole, unit))
    header = ",".join(f'"{name}"' for name in found)
    # Empty lines above keep the numbers of lines in messages.
    return "\n" * place + "\n".join([header, *lines[place + 1 :]])
