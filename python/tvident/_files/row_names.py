"""Rows that begin with a name of their own, above which no name of a column stands: what R and pandas may write."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

from tvident._arguments import is_called_time
from tvident._files.cells import Separator, number, split
from tvident._units import named_unit

_COMPARED = 20
"""Rows that are looked at: a footer may stand below more."""

_FEWEST = 3
"""Rows whose numbers count them by no chance."""

_COUNTER = re.compile(
    r"#|n|i|k|nr\.?|no\.?|num(ber)?|row|line|scan|point|cycle|(sample|frame|data)?[ _]*(index|idx|count(er)?|number|no\.?|nr\.?)|samples?"
    r"|frames?|zeile|punkt|messpunkt|bild|ligne|image",
    re.IGNORECASE,
)
"""What a column of such numbers is called itself."""


def have_row_names(names: Sequence[str], lines: Sequence[str], separator: Separator) -> bool:
    """Return whether every row has one cell more than there are names, the first of which is its own name or number.

    Names of rows are in quotes, and numbers are not; or they count the rows from 0 or 1, which no name stands for.
    """
    present = [line for line in lines[:_COMPARED] if line.strip()]
    rows = [split(line, separator) for line in present]
    if not names or any(number(name, comma=True) is not None for name in names):
        return False
    if not rows or any(len(row) != len(names) + 1 for row in rows):
        return False
    are_quoted = all(line.lstrip().startswith('"') and line.count('"') == 2 for line in present)  # noqa: PLR2004 - around one cell
    return are_quoted or (_are_counted(rows, separator) and _are_others(named_unit(names[0])[0], rows))


def _are_counted(rows: Sequence[Sequence[str]], separator: Separator) -> bool:
    """Return whether the first cells of rows count them, and no comma may be a decimal sign."""
    counted = [int(row[0]) if row[0].isdecimal() else -1 for row in rows]
    by_one = all(after - one == 1 for one, after in pairwise(counted))
    is_clear = separator != "," or any("." in cell for row in rows for cell in row[1:])
    return len(rows) >= _FEWEST and counted[0] in {0, 1} and by_one and is_clear


def _are_others(name: str, rows: Sequence[Sequence[str]]) -> bool:
    """Return whether the first name is none of what counts the rows: times are so where the second cells increase."""
    return not _COUNTER.fullmatch(name) and (not is_called_time(name) or _increase([row[1] for row in rows]))


def _increase(cells: Sequence[str]) -> bool:
    """Return whether each cell holds a number, or a time, beyond the one before."""
    values = [number(cell, comma=True) for cell in cells]
    return all(one is None or after is None or after > one for one, after in pairwise(values))
