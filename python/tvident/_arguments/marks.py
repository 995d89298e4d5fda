"""Numbers that mark values as missing: -9999, 1e20, the largest of a type."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

_NINES: Final = [float("9" * digits) for digits in range(2, 8)]
_MARKS: Final = np.unique(
    np.array(
        [
            *_NINES,
            *(one + part for one in _NINES for part in (0.25, 0.9, 0.99, 0.999)),
            *(10.0**power for power in range(10, 39)),
            *(9.9 * 10.0**power for power in (34, 35, 36, 37)),
            9.969209968386869e36,  # netCDF
            *(2.0**power for power in (15, 16, 31, 32, 63)),
            *(2.0**power - 1 for power in (15, 16, 31, 32)),
            *(float(np.finfo(kind).max) for kind in (np.float32, np.float64)),
        ]
    )
)
"""Sizes of numbers that programs write where nothing was measured: -9999, -999.25, 1e20, 32767, the largest of a type."""

_NO_MARKS: Final = (99.0, 99.9, 99.99, 99.25, 99.999)
"""Numbers that are measured more often than they are marks; -99 is one."""

_ROUND: Final = frozenset(10.0**power for power in range(2, 10))
"""What is measured at a limit, though 999.999 is close to 1000."""

_FAR = 1.0
"""By how many times the range of all other values a mark is beyond them."""

CLOSE_TO_MARK = 1e-6
"""Relative: numbers with 7 digits, or of 32 bits, are no others."""

_LARGEST_PART = 0.9
"""Of the samples of a channel, from which on marks are what was measured."""

_LARGER = 1.5
"""By how many times a mark is larger than others of its sign: 32768 is the zero of a sensor that stands at 33000."""

_LEVELS, _LOOKED_AT = 3, 10_000
"""Numbers beside a mark that are the levels of a drive or a switch, and samples that tell mostly that there are more."""

_MOST = 6
"""Marks of a channel."""

_FEWEST = 8
"""Other values, below which nothing is far from them."""


@np.errstate(over="ignore")
def marks_in(values: npt.NDArray[np.number]) -> list[tuple[float, int]]:
    """Return numbers that may mark missing values, far from all others of a channel, and how often each occurs."""
    if values.ndim != 1 or values.dtype.kind not in "iuf" or values.size < _FEWEST:
        return []
    are_finite = np.isfinite(values)
    finite = values if are_finite.all() else values[are_finite]
    if finite.size < _FEWEST:
        return []
    marks, others = _ends(finite)
    while marks:
        if others.size < max(_FEWEST, (1 - _LARGEST_PART) * finite.size):
            return []
        low, high = float(others.min()), float(others.max())
        far = [one for one in marks if _is_far(one, low, high)]
        if len(far) == len(marks):
            has_levels = np.unique(others[:_LOOKED_AT]).size <= _LEVELS and np.unique(others).size <= _LEVELS
            return [] if has_levels else [(one, int(np.count_nonzero(finite == one))) for one in sorted(far)]
        marks, others = far, finite[~np.isin(finite, far)]
    return []


def _ends(finite: npt.NDArray[np.number]) -> tuple[list[float], npt.NDArray[np.number]]:
    """Return the least and greatest numbers that are marks, one behind the other, and all others."""
    marks: list[float] = []
    others = finite
    while others.size and len(marks) < _MOST:
        new = [one for one in {float(others.min()), float(others.max())} if _is_mark(one)]
        if not new:
            break
        marks += new
        others = finite[~np.isin(finite, marks)]
    return marks, others


def _is_far(mark: float, low: float, high: float) -> bool:
    """Return whether a number is farther from all others than these from each other, and no neighbour of theirs for its size."""
    beyond = low - mark if mark < low else mark - high
    is_neighbour = mark * (low if mark < low else high) > 0 and abs(mark) < _LARGER * max(abs(low), abs(high))
    return beyond > _FAR * (high - low) and high > low and not is_neighbour


def _is_mark(value: float) -> bool:
    """Return whether programs write a number where nothing was measured."""
    return (
        value not in _NO_MARKS
        and abs(value) not in _ROUND
        and bool(np.isclose(_MARKS, abs(value), rtol=CLOSE_TO_MARK, atol=0).any())
    )
