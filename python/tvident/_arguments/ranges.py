"""Percentiles of a long record: few of its numbers are sorted, and none where all are alike, as those of a constant."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.floating]

_FEW = 1 << 17
"""Numbers that are sorted at once."""

_LOOKED_AT = 1 << 13
"""Numbers that tell between which ones a percentile lies."""

_BESIDE = 64
"""Of those, how many places beside its own a percentile is looked for."""

_MANY = 4
"""Times as many where numbers repeat: NumPy sorts such records in less time."""

_BLOCK = 1 << 15
"""Numbers that are compared together: they stay in the cache."""


def told_once(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return one number in place of all samples where it stands in memory once, as that of a constant does."""
    return values if values.ndim == 0 or values.strides[-1] else values[..., :1]


def finite(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the finite numbers of an array; without a copy where only the ends of a record have none."""
    there = np.isfinite(values)
    if values.ndim == 1 and there.any():
        inner = slice(int(there.argmax()), there.size - int(there[::-1].argmax()))
        if there[inner].all():
            return np.asarray(values[inner])
    return np.asarray(values[there])


def percentiles(values: Numbers, *shares: float) -> list[float]:
    """Return percentiles of finite numbers, of which 50 is the median; NaN where there is no number."""
    if not values.size:
        return [float("nan")] * len(shares)
    least, most = values.min(), values.max()
    if least == most:
        return [float(least)] * len(shares)
    found: list[float | None] = [None]
    if values.size > _FEW and values.dtype == np.float64 and values.ndim == 1:
        some = np.sort(values[:: values.size // _LOOKED_AT])
        found = [_percentile(values, some, share) for share in shares]
    if None in found:
        return [float(one) for one in np.percentile(values, shares)]
    return [float(one) for one in found if one is not None]


def _percentile(values: Numbers, some: Numbers, share: float) -> float | None:
    """Return one percentile, which is looked for between two of some numbers in order; None where it is not there, or many are."""
    place = share / 100 * (values.size - 1)
    rank = min(math.floor(place), values.size - 2)
    near = share / 100 * (some.size - 1)
    low, high = some[max(0, math.floor(near) - _BESIDE)], some[min(some.size - 1, math.ceil(near) + _BESIDE)]
    first, last = np.searchsorted(some, low), np.searchsorted(some, high, "right")
    if last - first > _MANY * _BESIDE:
        return None
    below, between = 0, []
    for start in range(0, values.size, _BLOCK):
        block = values[start : start + _BLOCK]
        beyond = block < low
        below += int(np.count_nonzero(beyond))
        between.append(block[~beyond & (block <= high)])
    found = np.concatenate(between)
    here = rank - below
    if not 0 <= here < found.size - 1:  # some are not as all are
        return None
    one, other = np.partition(found, (here, here + 1))[here : here + 2]
    part = place - rank
    # As NumPy has it, to the last bit.
    return float(one + (other - one) * part if part < 0.5 else other - (other - one) * (1 - part))  # noqa: PLR2004 - nearer to the other
