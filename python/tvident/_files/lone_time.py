"""What times are called in a line of its own, with separators behind it, as ControlDesk and its like write it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

from tvident._arguments import is_called_time
from tvident._units import ROTARY, is_convertible, is_unit, named_unit, unit_of


class Cells(Protocol):
    """A line above the numbers: its cells without empty ones at its end, and how many there were with these."""

    cells: list[str]
    width: int


AnyCells = TypeVar("AnyCells", bound=Cells)


def with_lone_time(above: Sequence[AnyCells]) -> list[AnyCells]:
    """Return lines above the numbers, in which a time that is alone in its line is the name of the first column.

    Below the names it stands where other lines have a key (``path;…``, ``unit;…``, ``time;;``), above them where they have no name.
    """
    lines = list(above)
    if len(lines) < 2:  # noqa: PLR2004 - a time and names
        return lines
    *others, last = lines
    if _is_lone(last) and all(len(line.cells) != 1 or line.width == 1 for line in others):
        for line in others:
            if len(line.cells) > 1:
                line.cells[0] = "" if all(map(is_unit, line.cells[1:])) else last.cells[0]
        return others
    if _is_lone(others[-1]) and len(last.cells) > 1 and not last.cells[0]:
        last.cells[0] = others[-1].cells[0]
        return [*others[:-1], last]
    return lines


def with_unit_of_times(above: Sequence[AnyCells], columns: int) -> list[AnyCells]:
    """Return lines above columns that blanks separate, in which units without one of the times stand below the other names.

    The times say their unit by their name (``mSec``), as dynamometers write them, or have none.
    """
    lines = list(above)
    if len(lines) < 2 or len(lines[-1].cells) != columns - 1 or len(lines[-2].cells) != columns:  # noqa: PLR2004 - names and units
        return lines
    units, first = lines[-1].cells, lines[-2].cells[0]
    is_time = is_called_time(named_unit(first)[0]) or is_convertible(ROTARY, "time", first)
    if is_time and sum(unit_of(cell) is not None for cell in units) * 2 > len(units):
        units.insert(0, "")
        lines[-1].width = max(lines[-1].width, columns)
    return lines


def _is_lone(line: Cells) -> bool:
    return len(line.cells) == 1 and line.width > 1 and is_called_time(named_unit(line.cells[0])[0])
