"""Numbers and words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from numbers import Integral, Real
from typing import Any

import numpy as np

from tvident._arguments.measured import measured
from tvident._arguments.shown import shown

_BEYOND_COUNTING = 1 << 63
"""No whole number this large fits into the core's."""

_NO_NUMBERS = (bool, np.timedelta64)
"""What Python, or NumPy, takes for whole numbers."""

LARGEST = 1e70
"""Fourth powers of larger values, which variances of products are made of, leave the range of doubles."""


def whole_number(name: str, value: object, *, least: int | None = None, most: int | None = None) -> int:
    """Return a whole number, within limits if there are any."""
    # Most are Python's own, which are asked for first: abstract classes are slow to answer.
    if type(value) is not int and (not isinstance(value, Integral) or isinstance(value, _NO_NUMBERS)):
        number = _float(value)
        whole = number is not None and number.is_integer()
        cure = f"pass {shown(int(number))}" if whole and number is not None else "pass an integer"
        raise TypeError(f"{name} must be a whole number; got {shown(value)}; {cure}")
    number = int(value)
    if least is not None and number < least:
        raise ValueError(f"{name} must be at least {least}; got {shown(number)}; pass {least} or more")
    if most is not None and number > most:
        raise ValueError(f"{name} must be at most {most}; got {shown(number)}; pass {most} or less")
    if abs(number) >= _BEYOND_COUNTING:
        raise ValueError(f"{name} must be less than 2^63; got {shown(number)}; pass a smaller number")
    return number


def positive_number(name: str, value: object, *, most: float | None = None) -> float:
    """Return a finite number above zero, of at most a given size."""
    number = real_number(name, value)
    if not (math.isfinite(number) and number > 0):
        raise ValueError(f"{name} must be positive and finite; got {shown(value)}; pass a number above zero")
    if most is not None and number > most:
        raise ValueError(f"{name} must be at most {most:g}; got {number:g}; pass {most:g} or less")
    return number


def finite_number(name: str, value: object, *, least: float | None = None, most: float | None = None) -> float:
    """Return a finite number, within limits if there are any."""
    number = real_number(name, value)
    if not math.isfinite(number):
        raise ValueError(f"{name} must be finite; got {shown(value)}; pass a number")
    if least is not None and number < least:
        raise ValueError(f"{name} must be at least {least:g}; got {shown(value)}; pass {least:g} or more")
    if most is not None and number > most:
        raise ValueError(f"{name} must be at most {most:g}; got {shown(value)}; pass {most:g} or less")
    return number


def real_number(name: str, value: object) -> float:
    """Return a real number; infinite where it is too large for a double."""
    number = _float(value)
    if number is None:
        number = measured(name, value)
    if number is None:
        raise TypeError(f"{name} must be a number; got {shown(value)}; pass a float")
    return number


def _float(value: object) -> float | None:
    """Return a real number as a double, or None for what is none."""
    if type(value) is float:
        return value
    if type(value) is np.ndarray and value.size == 1 and value.dtype.kind in "iuf":
        value = value.reshape(-1)[0]  # as MATLAB and HDF5 hold single numbers
    if not isinstance(value, Real) or isinstance(value, _NO_NUMBERS):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf if value == abs(value) else -math.inf


def is_several(value: object) -> bool:
    """Return whether something holds several values: no text, and no single number in an array."""
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return isinstance(value, Iterable) and not isinstance(value, str | bytes)


def mapping(name: str, value: object, example: str) -> Mapping[Any, Any]:
    """Return a mapping; refuse what is none, with an example of what would be right."""
    if not isinstance(value, Mapping):
        raise TypeError(f"{name} must be a mapping; got {shown(value)}; write {example}, say")
    return value


def one_of(name: str, value: object, choices: tuple[str, ...]) -> str:
    """Return one of several words."""
    if not isinstance(value, str) or value not in choices:
        *most, last = (repr(choice) for choice in choices)
        raise ValueError(f"{name} must be {', '.join(most)} or {last}; got {shown(value)}; use one of these")
    return str(value)


def flag(name: str, value: object) -> bool:
    """Return True or False, Python's or NumPy's."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be True or False; got {shown(value)}; pass one of them")
    return bool(value)


def is_word(value: object, word: str) -> bool:
    """Return whether a value is this word; arrays, which compare element by element, are no word."""
    return isinstance(value, str) and value == word
