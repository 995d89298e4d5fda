"""Numbers and words."""

from __future__ import annotations

import math
from numbers import Integral, Real

# No whole number this large fits into the core's.
_BEYOND_COUNTING = 1 << 63


def whole_number(name: str, value: object, *, least: int | None = None) -> int:
    """Return a whole number, of at least a given size."""
    if not isinstance(value, Integral) or isinstance(value, bool):
        whole = isinstance(value, Real) and math.isfinite(value) and float(value).is_integer()
        cure = f"pass {int(float(value))}" if whole else "pass an integer"  # type: ignore[arg-type]
        raise TypeError(f"{name} must be a whole number; got {value!r}; {cure}")
    if least is not None and value < least:
        raise ValueError(f"{name} must be at least {least}; got {value}; pass {least} or more")
    number = int(value)
    if number >= _BEYOND_COUNTING:
        raise ValueError(f"{name} must be less than 2^63; got {number}; pass a smaller number")
    return number


def positive_number(name: str, value: object) -> float:
    """Return a finite number above zero."""
    if not isinstance(value, Real) or isinstance(value, bool):
        raise TypeError(f"{name} must be a number; got {value!r}; pass a float")
    number = float(value)
    if not (math.isfinite(number) and number > 0):
        raise ValueError(f"{name} must be positive and finite; got {number}; pass a number above zero")
    return number


def finite_number(name: str, value: object) -> float:
    """Return a finite number."""
    if not isinstance(value, Real) or isinstance(value, bool):
        raise TypeError(f"{name} must be a number; got {value!r}; pass a float")
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{name} must be finite; got {number}; pass a number")
    return number


def one_of(name: str, value: object, choices: tuple[str, ...]) -> str:
    """Return one of several words."""
    if value not in choices:
        *most, last = (repr(choice) for choice in choices)
        raise ValueError(f"{name} must be {', '.join(most)} or {last}; got {value!r}; use one of these")
    return str(value)
