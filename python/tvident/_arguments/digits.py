"""Numbers as they are read: with the digits that their error leaves, and their error with two."""

from __future__ import annotations

import math

_LARGE, _SMALL = 1e6, 1e-4
"""Numbers beyond these have a power of ten."""


def with_error(value: float, error: float) -> str:
    """Return a value and its error with digits that go together: 0.012295 ± 0.000011."""
    if not math.isfinite(value):
        return "none"
    if not (math.isfinite(error) and error > 0):
        return f"{value:.5g}"
    places = decimals(error)
    size = max(abs(value), error)
    if _SMALL <= size < _LARGE:
        return f"{_fixed(round(value, places), places)} ± {round(error, places):.{max(0, places)}f}"
    power = math.floor(math.log10(size))
    digits = max(0, places + power)
    return f"({_fixed(value / 10.0**power, digits)} ± {error / 10.0**power:.{digits}f})e{power}"


def _fixed(value: float, digits: int) -> str:
    """Return a number with so many digits behind the point, without a sign where they are zeros."""
    return f"{value:z.{max(0, digits)}f}"


def decimals(error: float) -> int:
    """Return how many digits behind the point an error has, of which two are told."""
    return 1 - math.floor(math.log10(float(f"{error:.1e}")))


def to_digits_of(value: float, error: float) -> str:
    """Return a value alone, with the digits that its error leaves."""
    if not math.isfinite(value):
        return "none"
    if not (math.isfinite(error) and error > 0) or not _SMALL <= max(abs(value), error) < _LARGE:
        return f"{value:.5g}"
    places = decimals(error)
    return _fixed(round(value, places), places)


_MOST_DIGITS = 6
"""Behind the point of a percentage."""


def percent(share: float) -> str:
    """Return a share of 1 in percent with two digits of what it leaves: 99.9964 is far from 100."""
    value = 100 * share
    left = min(abs(100 - value), abs(value))
    digits = min(_MOST_DIGITS, max(0, 1 - math.floor(math.log10(left)))) if 0 < left < math.inf else 0
    least = 10.0**-_MOST_DIGITS
    if 0 < left < least / 2:
        return f"over {100 - least:.{_MOST_DIGITS}f} %" if value > 1 else f"under {least:.{_MOST_DIGITS}f} %"
    return f"{value:.{digits}f} %"


def explained_in_words(share: float) -> str:
    """Return how much of 1 is explained, as a sentence has it: what predicts worse than a constant explains nothing, by however much."""
    return "nothing" if share < 0 else percent(share)


def own_digits(error: float) -> str:
    """Return an error with two digits."""
    if not math.isfinite(error):
        return "none"
    if not _SMALL <= error < _LARGE:
        return f"{error:.1e}".replace("e-0", "e-").replace("e+0", "e+") if error else "0"
    places = decimals(error)
    return f"{round(error, places):.{max(0, places)}f}"


def ordinal(count: float) -> str:
    """Return a whole number as the place of one among others: 2nd, 5th."""
    number = round(count)
    ending = "th" if number % 100 in {11, 12, 13} else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"
