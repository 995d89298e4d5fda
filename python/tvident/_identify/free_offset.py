"""Whether an offset that is free in every window is worth what it costs, found by trying."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tvident._advice import FREE_OFFSET
from tvident._results import Identification, Words, unflagged

_MOST_LOST = 0.1
"""The part of the trusted samples that a better prediction may cost."""


def without_worse_offset(words: Words, result: Identification, again: Callable[[], Identification]) -> Words:
    """Return words without the advice of an offset that is free in every window, if less of the record can be trusted with it.

    Such an offset follows whatever moves rows in common, and takes from the others what tells the stiffness from it.

    Parameters
    ----------
    words : Words
        Of the result.
    result : Identification
    again : callable
        Identifies the same record with that offset.
    """
    rest = tuple(line for line in words.advice if not line.startswith(FREE_OFFSET))
    if len(rest) == len(words.advice):
        return words
    try:
        found = again()
    except ValueError:
        # What is there of the record does not determine it.
        return replace(words, advice=rest)
    is_worse = unflagged(found).mean() < (1 - _MOST_LOST) * unflagged(result).mean()
    return replace(words, advice=rest) if is_worse else words
