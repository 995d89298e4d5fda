"""What AcqKnowledge (BIOPAC) writes above its samples: the period, a name and a unit of each channel in lines of their own, their count."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from typing import TextIO

import numpy as np

from tvident._files.cells import split
from tvident._files.channels import Channels, FileError, Say
from tvident._files.names import printable
from tvident._units import factor_between, with_unit

START = re.compile(
    r"[^\n]{0,300}\n\s*(?P<period>[\d.]{1,20})\s(?P<unit>[mu]?sec)/sample\s*\n(?P<count>\d{1,3}) channels?\s*\n",
    re.IGNORECASE,
)
"""How such a text begins: what it is called, then these two lines."""

_UNITS = {"min": "min", "sec": "s", "millisec": "ms", "msec": "ms", "hr": "h", "hours": "h"}
"""What times are called, by their unit."""


def read_acqknowledge(text: str, read: Callable[[TextIO, Say], Channels], say: Say) -> Channels:
    """Read a text that begins as ``START`` says, its columns by what reads those of any text."""
    start = START.match(text)
    assert start is not None  # noqa: S101 - whoever calls has asked
    count = int(start["count"])
    lines = text[start.end() :].split("\n")
    above = lines[: 2 * count + 2]
    if len(above) < 2 * count + 2:
        raise FileError(
            f"below '{count} channels' must stand a name and a unit of each; the file ends before; copy it again"
        )
    named = [with_unit(above[2 * place].strip(), above[2 * place + 1].strip()) for place in range(count)]
    between = "\t" if "\t" in above[-2] else ","
    called = [cell for cell in split(above[-2], between) if cell]
    has_times = bool(called) and called[0].casefold() in _UNITS
    if len(called) != count + has_times:
        raise FileError(
            f"the line above the samples must name each of {count} channels; it has '{printable(above[-2], 40)}'; copy it again"
        )
    names = [with_unit("time", _UNITS[called[0].casefold()]), *named] if has_times else named
    lengths = _lengths(split(above[-1], between), count, len(lines) - len(above))
    header = between.join('"' + one.replace('"', "'").replace(between, " ") + '"' for one in names)
    skipped = text.count("\n", 0, start.end()) + 2 * count
    # Empty lines above keep the numbers of lines in messages.
    body = ["", header] if lengths else [header, above[-1]]
    found = read(io.StringIO("\n" * skipped + "\n".join([*body, *lines[2 * count + 2 :]])), say)
    samples = next((values.size for values in found.values()), 0)
    if lengths and lengths != {samples}:
        said = ", ".join(map(str, sorted(lengths)))
        say(f"it says that there are {said} samples of each channel, and has {samples}")
    if has_times:
        return found
    period = float(start["period"]) * factor_between(start["unit"].lower().replace("sec", "s"), "s", name="the period")
    return {"time [s]": np.arange(samples) * period, **found}


def _lengths(cells: list[str], count: int, rows: int) -> set[int]:
    """Return how many samples of each channel a line says that there are; nothing where it is one of samples."""
    there = [cell for cell in cells if cell]
    if len(there) != count or not all(cell.isdecimal() for cell in there):
        return set()
    lengths = {int(cell) for cell in there}
    # Nothing stands above times. Samples may be whole numbers, but hardly that many.
    return lengths if not cells[0] or min(lengths) > rows // 2 else set()
