"""Lines whose cells have names of their own, as microcontrollers print them: ``angle:1.5,torque:0.2``, ``t=0.001 a=1.5``."""

from __future__ import annotations

import re
from collections.abc import Sequence

from tvident._files.channels import Channels, Say
from tvident._files.json_text import samples_of
from tvident._files.names import printable

_NAME = r"[^\W\d][^:=,;|\t\n\"{}]{0,60}?"
_NAMED = (
    re.compile(rf" *({_NAME}) {{0,3}}[:=]([^,;|\t\n]*)(?:[,;|\t]+|$)"),
    re.compile(r" *([^\W\d][^:=,;|\s\"{}]{0,60}) {0,3}[:=] {0,3}([^,;|\s]+)(?:\s+|$)"),
)
"""A cell with its name: separated by signs, or by blanks. No part may end in several places of a run of blanks, however long it is."""

_LOOKED_AT = 6
"""Lines that tell. The first may be cut, where somebody began to listen."""

_VALUE = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|nan|inf|-inf", re.IGNORECASE)
"""What stands behind a name, once at least in a line."""


def _pairs(line: str, form: re.Pattern[str]) -> list[tuple[str, str]]:
    """Return the names and the values of a line; none where it has another form."""
    found, place = [], 0
    line = line.strip()
    while place < len(line):
        cell = form.match(line, place)
        if cell is None or cell.end() == place:
            return []
        found.append((cell[1].strip(), cell[2].strip()))
        place = cell.end()
    names = [name for name, _ in found]
    return found if len(set(names)) == len(names) else []


def form_of(start: str) -> re.Pattern[str] | None:
    """Return how the lines of a text name their cells; None where they do not: the same names stand in each of the first."""
    lines = [line for line in start.split("\n")[:-1] if line.strip()][1 : _LOOKED_AT + 1]
    if len(lines) < 2:  # noqa: PLR2004 - one line says one thing
        return None
    for form in _NAMED:
        each = [_pairs(line, form) for line in lines]
        names = [[name for name, _ in pairs] for pairs in each]
        if names[0] and all(one == names[0] for one in names) and all(any(map(_is_value, pairs)) for pairs in each):
            return form
    return None


def _is_value(pair: tuple[str, str]) -> bool:
    return _VALUE.fullmatch(pair[1]) is not None


def read_named_cells(text: str, form: re.Pattern[str], say: Say) -> Channels:
    """Return the channels of lines of such a form; what has another form is said."""
    rows: list[tuple[int, dict[str, str]]] = []
    others: list[tuple[int, str]] = []
    lines: Sequence[str] = text.split("\n")
    for place, line in enumerate(lines, 1):
        pairs = dict(_pairs(line, form))
        if len(rows) == 1 and pairs and pairs.keys() != rows[0][1].keys():
            # Somebody began to listen within the first line.
            others.append((rows[0][0], lines[rows[0][0] - 1].strip()))
            rows.clear()
        # A last line without an end may lack digits.
        if pairs and (place < len(lines) or not rows):
            rows.append((place, pairs))
        elif line.strip():
            others.append((place, line.strip()))
    if others:
        place, line = others[0]
        many = f"{len(others)} lines are" if len(others) > 1 else "1 line is"
        say(f"{many} not read, as line {place}: no names with values: '{printable(line, 40)}'")
    return samples_of(rows, say)
