"""How messages show what was passed: in one short line, whatever it is."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Sequence

import numpy as np

_MOST = 80
"""Characters."""

_shortened = reprlib.Repr()
_shortened.maxstring = _shortened.maxother = _shortened.maxlong = _MOST


def shown(value: object) -> str:
    """Return a value in one line of at most some 80 characters."""
    if isinstance(value, np.number):
        value = value.item()
    try:
        text = _shortened.repr(value)
    except ValueError:
        # Python prints no whole number of more than 4300 digits.
        text = "a whole number of thousands of digits"
    text = " ".join(text.split())
    return text if len(text) <= _MOST else f"{text[: _MOST - 1]}…"


def listed(names: Sequence[str]) -> str:
    """Return names as they are read: one, another and a third."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def nearest(name: object, known: Iterable[str]) -> str:
    """Return the question for the known name that comes nearest; an empty string if none is near."""
    from difflib import get_close_matches  # noqa: PLC0415 - for mistakes alone

    near = get_close_matches(str(name), list(known), n=1)
    return f"did you mean {near[0]!r}?" if near else ""
