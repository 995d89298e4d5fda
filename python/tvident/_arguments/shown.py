"""How messages show what was passed, in one short line whatever it is, and numbers with their errors."""

from __future__ import annotations

import math
import reprlib

import numpy as np

_MOST = 80
"""Characters."""

_MOST_DIGITS = 8
"""After the point."""

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


def with_error(value: float, error: float) -> str:
    """Return a number with as many digits as its error deserves, and the error with two."""
    if not (math.isfinite(value) and math.isfinite(error)) or error <= 0:
        return f"{value:.5g}"
    digits = 1 - math.floor(math.log10(error))
    if 0 <= digits <= _MOST_DIGITS:
        return f"{value:.{digits}f} ± {error:.{digits}f}"
    return f"{value:.5g} ± {error:.2g}"
