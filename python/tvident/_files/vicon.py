"""What Vicon's Nexus writes above its samples: what they are of, their rate, devices or markers above names, units below."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from typing import TextIO

import numpy as np

from tvident._files.channels import Channels, FileError, Say
from tvident._files.names import printable
from tvident._units import with_unit

_KINDS = "Devices|Joints|Model Outputs|Segments|Trajectories|Events"
START = re.compile(rf"(?P<kind>{_KINDS})[,;\t]*\r?\n(?P<rate>\d{{1,7}}(?:\.\d+)?)[,;\t]*\r?\n", re.IGNORECASE)
"""How such a text begins: what is in it, and how often it was measured."""

_FRAME, _PART = "Frame", "Sub Frame"


def read_vicon(text: str, read: Callable[[TextIO, Say], Channels], say: Say) -> Channels:
    """Read a text that begins as ``START`` says, its columns by what reads those of any text.

    Where several blocks follow each other the first that has frames is read, and the others are named. Frames tell the times.
    """
    blocks = [match for match in START.finditer(text) if match.start() == 0 or text[match.start() - 1] == "\n"]
    ends = [*(one.start() for one in blocks[1:]), len(text)]
    for place, (block, end) in enumerate(zip(blocks, ends, strict=True)):
        if block["kind"].casefold() == "events":
            continue
        others = [f"{one['kind']} at {one['rate']} Hz" for number, one in enumerate(blocks) if number != place]
        if others:
            say(
                f"it holds several tables, of which '{block['kind']}' is read; not read: {', '.join(others)}; export each to a file"
            )
        # Empty lines above keep the numbers of lines in messages.
        above = text.count("\n", 0, block.end())
        found = read(io.StringIO("\n" * above + text[block.end() : end].rstrip() + "\n"), say)
        return _timed(found, float(block["rate"]), say)
    raise FileError("it holds events alone, and no samples; export devices or model outputs")


def _timed(found: Channels, rate: float, say: Say) -> Channels:
    """Return channels with times before frames and their parts."""
    if not rate > 0:
        raise FileError(f"line 2 must have the samples per second; it has {rate:g}; export it again")
    frame, part = found.get(_FRAME), found.get(_PART)
    if frame is None or part is None or not frame.size:
        count = next((values.size for values in found.values()), 0)
        return {with_unit("time", "s"): np.arange(count) / rate, **found}
    parts = np.nanmax(part) + 1
    place = frame * parts + part
    told = np.flatnonzero(np.isfinite(place))
    if not told.size:
        raise FileError("no row has a frame; export it again")
    times = (place - place[told[0]] + told[0]) / rate
    lost = np.flatnonzero(np.diff(place) != 1)
    if lost.size:
        line = printable(f"frame {frame[lost[0] + 1]:g}")
        say(f"frames do not follow each other, first before {line}: times are those of the frames")
    return {with_unit("time", "s"): times, **found}
