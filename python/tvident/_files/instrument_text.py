"""Text with a header that says how it is written: LabVIEW's measurements (.lvm), OpenSim's motions and storages (.mot, .sto)."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np

from tvident._files.channels import Channels, FileError, Say
from tvident._files.names import printable
from tvident._files.rows import Numbers
from tvident._files.text import read_columns, read_text, read_whole
from tvident._units import with_unit

_END = re.compile(r"^\*\*\*End_of_Header\*\*\*[^\n]*\n", re.MULTILINE)

_X = "X_Value"

_BY_COMMAS = re.compile(r"^Separator,", re.MULTILINE)

_HEADER_LINES = 100

_LENGTHS = re.compile(r".*_(t[xyz]|p[xyz])|pelvis_t[xyz]")
_FORCES = re.compile(r".*_v[xyz]|(.*_)?force")
_TORQUES = re.compile(r".*_m[xyz]|(.*_)?(moment|torque_?[xyz]?)")
_STATE = re.compile(r"/jointset/(?:.*/)?(?P<name>[^/]+)/(?P<kind>value|speed)")
"""A state of OpenSim 4: the value and the speed of a coordinate; degrees are those of coordinates alone."""


def read_labview(path: Path, say: Say) -> Channels:
    """Read a measurement of LabVIEW: its segments one after the other, with units and, where no column has them, times."""
    with path.open("rb") as file:
        is_labview = b"LabVIEW Measurement" in file.read(64)
    if not is_labview:
        return read_text(path, say)
    text = read_whole(path)
    ends = [found.end() for found in _END.finditer(text)]
    if len(ends) < 2:  # noqa: PLR2004 - the file's and a segment's
        raise FileError("a measurement of LabVIEW must have two headers before its numbers; copy it again")
    segments: list[Channels] = []
    for header, start, end in zip(ends, ends[1:], [*ends[2:], None], strict=False):
        # Its numbers reach to the header of the next.
        stop = len(text) if end is None else text.rfind("\nChannels", start, end) + 1
        segments.append(_segment(text, (header, start, stop), say if not segments else _nothing))
    if any(list(one) != list(segments[0]) for one in segments):
        raise FileError(
            "the segments of a measurement must have the same channels; these differ; write each to a file of its own"
        )
    if len(segments) > 1:
        say(f"{len(segments)} segments are read one after the other")
    return {name: np.concatenate([one[name] for one in segments]) for name in segments[0]}


def _nothing(_: str) -> None:
    """Say what the first segment said once."""


def _segment(text: str, places: tuple[int, int, int], say: Say) -> Channels:
    header, start, stop = places
    between = "," if _BY_COMMAS.search(text, 0, header) else "\t"
    lines = text[header:start].split("\n")
    keys = {line.split(between)[0]: line.rstrip(f"\n{between} ").split(between)[1:] for line in lines}
    # Empty lines above keep the numbers of lines in messages.
    found = read_columns(
        io.StringIO("\n" * text.count("\n", 0, start) + _with_every_cell(text[start:stop], between)), say
    )
    _check_rows(keys.get("Samples", []), next((values.size for values in found.values()), 0))
    units = keys.get("Y_Unit_Label", [])
    if sum(name.startswith(_X) for name in found) > 1:
        units = units[::2]  # each stands above the times of its channel
    channels: Channels = {}
    of_channels = 0
    for column, (name, values) in enumerate(found.items()):
        is_empty = not np.isfinite(values).any()
        # Without times the first column is empty, and some leave out its name.
        if name.startswith(_X) or (column == 0 and is_empty):
            is_time = keys.get("X_Dimension", ["Time"])[:1] == ["Time"]
            channels[with_unit(name if name.startswith(_X) else _X, "s" if is_time else "")] = (
                _times(keys, values.size) if is_empty else values
            )
        elif name != "Comment" or not is_empty:
            channels[with_unit(name, units[of_channels] if of_channels < len(units) else "")] = values
            of_channels += 1
    return channels


def _with_every_cell(text: str, between: str) -> str:
    """Return a segment whose lines have the cells that its names say: the first may have no name, and few lines have a comment."""
    names, newline, rows = text.partition("\n")
    cells = names.rstrip("\r").split(between)
    while cells and not cells[-1].strip():
        cells.pop()
    if len(cells) < 2 or "Comment" not in cells[-1]:  # noqa: PLR2004 - a channel and its comments
        return text
    if not cells[0].strip():
        cells[0] = _X
    width = len(cells)
    lines = [line.rstrip("\r") for line in rows.split("\n")]
    counts = {line.count(between) + 1 for line in lines if line.strip()}
    if counts != {width}:
        lines = [line + between if line.count(between) + 2 == width else line for line in lines]
    return between.join(cells) + newline + "\n".join(lines)


def _check_rows(said: list[str], rows: int) -> None:
    """Refuse a segment that has lost rows; where one header serves all that was written later, there are more than it says."""
    most = max((int(one) for one in said if one.strip().isdecimal()), default=0)
    if rows < most:
        raise FileError(
            f"the header must say how much follows; it says Samples {most}, and there are {rows}; copy it again, or, where the "
            f"recording broke off, write Samples {rows} there"
        )


def _times(keys: dict[str, list[str]], count: int) -> Numbers:
    try:
        first, step = (float(keys[key][0].replace(",", ".")) for key in ("X0", "Delta_X"))
    except (KeyError, IndexError, ValueError):
        raise FileError(
            "a measurement without a column of times must have X0 and Delta_X in its header; copy it again"
        ) from None
    return np.asarray(first + step * np.arange(count))


def read_opensim(path: Path, say: Say) -> Channels:
    """Read a motion or a storage of OpenSim, with the units that its header and its names stand for."""
    channels = read_text(path, say)
    with path.open(encoding="latin-1") as file:
        header = [file.readline(1000).strip() for _ in range(_HEADER_LINES)]
    if "endheader" not in header:
        return channels
    pairs = (line.replace(" ", "").partition("=") for line in header[: header.index("endheader")])
    keys = {key.lower(): value for key, sign, value in pairs if sign}
    rows = next(iter(channels.values())).size
    for key, found in (("nrows", rows), ("ncolumns", len(channels))):
        if keys.get(key, str(found)) != str(found):
            raise FileError(
                f"the header must say how much follows; it says {key}={printable(keys[key], 20)}, and there are {found}; copy it again, "
                "or, where the recording broke off, write what there is"
            )
    degrees = keys.get("indegrees", "").lower() == "yes"
    return {with_unit(name, _unit(name, degrees=degrees)): values for name, values in channels.items()}


def _unit(name: str, *, degrees: bool) -> str:
    if name == "time":
        return "s"
    if name.startswith("/"):
        return _unit_of_state(name, degrees=degrees)
    for names, unit in ((_LENGTHS, "m"), (_FORCES, "N"), (_TORQUES, "N m")):
        if names.fullmatch(name):
            return unit
    return "deg" if degrees else ""


def _unit_of_state(name: str, *, degrees: bool) -> str:
    """Return the unit of a value in a model's tree; empty if the header does not say it."""
    state = _STATE.fullmatch(name)
    if state is None:
        last = name.replace("/", "_")
        return next((unit for names, unit in ((_FORCES, "N"), (_TORQUES, "N m")) if names.fullmatch(last)), "")
    base = "m" if _LENGTHS.fullmatch(state["name"]) else "deg" if degrees else ""
    return f"{base}/s" if base and state["kind"] == "speed" else base
