"""A last line of text within which writing stopped: what it lacks."""

from __future__ import annotations

import re
from collections.abc import Sequence

from tvident._files.cells import number
from tvident._files.names import printable

_FEWEST = 20
"""Lines that a last one is compared with at least."""

_BEGUN = re.compile(r"[-+]?[\d.,]*(?:[eEdD][-+]?\d*)?", re.ASCII)
"""What may be the beginning of a number."""


def what_lacks(cells: Sequence[str], above: Sequence[Sequence[str]], *, is_time: bool) -> str:
    """Return in words what the last line of a text has less of than all above it; nothing where it lacks nothing.

    Parameters
    ----------
    cells : sequence of str
        Of the last line, which has no end.
    above : sequence of sequence of str
        Of lines before it, all of one length.
    is_time : bool
        Whether the last column holds times of a clock.
    """
    if len(above) < _FEWEST or len(cells) > len(above[0]):
        return ""
    width = len(above[0])
    if len(cells) < width:
        return f"{len(cells)} of {width} cells"
    last, others = cells[-1], [row[-1] for row in above]
    if last and not is_time and number(last, comma=True) is None:
        return f"'{printable(last, 40)}' for its last number" if _BEGUN.fullmatch(last) else ""
    if not last and all(others):
        return "nothing in its last cell, as no other"
    fewest = min(map(_behind_the_sign, others))
    are_whole = not max(map(_behind_the_sign, others))
    if _behind_the_sign(last) < fewest or (are_whole and len(last) < min(map(len, others))):
        return f"fewer digits in its last cell, '{printable(last, 40)}', than all others"
    return ""


def _behind_the_sign(cell: str) -> int:
    """Return how many characters stand behind the decimal sign of a number."""
    return len(cell) - 1 - max(cell.rfind("."), cell.rfind(",")) if "." in cell or "," in cell else 0
