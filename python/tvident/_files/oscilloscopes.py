"""What oscilloscopes write above and beside their samples: names and units in lines with a key, times by a start and an increment."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Sequence
from typing import TextIO

from tvident._files.cells import number, split
from tvident._files.channels import Channels, FileError, Say
from tvident._files.names import printable
from tvident._units import is_unit, named_unit, unit_of, with_unit

_LABELS, _TRACES, _SOURCES = ("label", "labels"), ("tracename",), ("source",)
_UNITS, _UNIT_OF_TIMES = ("vertical units", "vunit"), ("horizontal units", "hunit")
"""Keys of lines that say something of every channel (Tektronix, Yokogawa, Siglent)."""

_COUNTED = re.compile(
    r"X,(?P<names>[^\n]*?),? {0,3}Start, {0,3}Increment[, ]*\r?\nSequence,(?P<rest>[^\n]*)\n", re.IGNORECASE
)
"""How a file of Rigol begins whose rows count samples."""

_BESIDE = re.compile(r'"?Record Length"?,[^,\n]*,,[^,\n]*,', re.IGNORECASE)
_BLOCK, _TIME, _SAMPLE = 6, 3, 4
"""How a file of an older Tektronix begins, the columns of a channel (key, value, nothing, time, sample, nothing), and two of these."""

_MOST_KEYS = 40
"""Lines beside which these keys stand."""

START = re.compile(f"(?:{_COUNTED.pattern})|(?:{_BESIDE.pattern})", re.IGNORECASE)
"""How texts begin that are read by what this file knows alone."""


def names_of_keys(lines: Sequence[Sequence[str]], most: int) -> list[str]:
    """Return the names of columns, with units and labels, of the cells of lines above them that begin with keys; none where they do not.

    A label stands behind the name of its channel, as in ``CH1.angle [V]``.
    """
    keyed = {cells[0].rstrip(": ").casefold(): list(cells[1:]) for cells in lines if cells}

    def said(keys: Sequence[str]) -> list[str] | None:
        return next((keyed[key] for key in keys if key in keyed), None)

    units, of_times, traces = said(_UNITS), said(_UNIT_OF_TIMES), said(_TRACES)
    if units is None or not of_times:
        return []
    names = ["", *traces] if traces is not None else list(lines[-1])
    sources = said(_SOURCES)
    if sources is not None and unit_of(names[0]) is not None:
        names = ["time", *sources]  # behind which Siglent writes units once more, in words
    labels = said(_LABELS) or []
    if len(names) != most or (traces is None and names[0].casefold() != "time"):
        return []
    if len(units) >= most or not all(map(is_unit, [*filter(None, units), of_times[0]])):
        return []
    found = [with_unit(names[0], of_times[0]) if names[0] else ""]
    for place, name in enumerate(names[1:]):
        label = labels[place] if place < len(labels) else ""
        unit = units[place] if place < len(units) and not named_unit(label)[1] else ""
        found.append(with_unit(f"{name}.{label}" if label else name, unit))
    return found


def read_scope(text: str, read: Callable[[TextIO, Say], Channels], say: Say) -> Channels:
    """Read a text that begins as ``START`` says, its columns by what reads those of any text."""
    counted = _COUNTED.match(text)
    return _beside_keys(text, read, say) if counted is None else _counted(text, counted, read, say)


def _counted(text: str, start: re.Match[str], read: Callable[[TextIO, Say], Channels], say: Say) -> Channels:
    """Read rows that count samples, whose times follow from a start and an increment in the header."""
    names = split(start["names"], ",")
    rest = split(start["rest"], ",")
    units, of_times = rest[: len(names)], [number(cell, comma=False) for cell in rest[len(names) :] if cell]
    if len(of_times) != 2 or not all(one is not None and math.isfinite(one) for one in of_times) or not of_times[1]:  # noqa: PLR2004 - the two
        raise FileError("line 2 must have the start and the increment of the times behind the units; copy it again")
    first, step = (float(one or 0.0) for one in of_times)
    called = ",".join(f'"{with_unit(name, unit)}"' for name, unit in zip(names, units, strict=True))
    width = len(names) + 1
    rows = [",".join(line.split(",")[:width]) for line in text[start.end() :].split("\n")]
    found = read(io.StringIO("\n".join(["", f"X,{called}", *rows])), say)
    say(f"X counts samples: its times are {first:g} s and {step:g} s more for each, as the header says")
    return {"time [s]": first + step * found.pop("X"), **found}


def _beside_keys(text: str, read: Callable[[TextIO, Say], Channels], say: Say) -> Channels:
    """Read times and samples that stand beside keys and values, of each channel in columns of its own."""
    rows = [split(line, ",") for line in text.split("\n")]
    channels = max(1, (len(rows[0]) + 1) // _BLOCK)
    names = []
    for block in range(0, _BLOCK * channels, _BLOCK):
        said = {row[block].casefold(): row[block + 1] for row in rows[:_MOST_KEYS] if len(row) > block + 1}
        of_times, unit = said.get("horizontal units", ""), said.get("vertical units", "")
        names += [with_unit("time", of_times), with_unit(said.get("source", "") or "samples", unit)]
    places = [block + place for block in range(0, _BLOCK * channels, _BLOCK) for place in (_TIME, _SAMPLE)]
    if channels > 1 and all(row[_TIME] == row[place] for row in rows if len(row) > places[-1] for place in places[::2]):
        # All were sampled together.
        places, names = [_TIME, *places[1::2]], [names[0], *names[1::2]]
    lines = [",".join(row[place] if place < len(row) else "" for place in places) if any(row) else "" for row in rows]
    header = ",".join(f'"{printable(name, 80)}"' for name in names)
    # The header has no line of its own, and numbers of lines in messages are one too large.
    return read(io.StringIO("\n".join([header, *lines])), say)
