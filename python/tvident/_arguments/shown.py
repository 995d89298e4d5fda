"""How messages show what was passed: in one short line, whatever it is."""

from __future__ import annotations

import reprlib

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
