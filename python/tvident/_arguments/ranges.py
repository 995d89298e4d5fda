"""Percentiles of a long record: numbers that are all alike, as those of a constant, are not sorted."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def percentiles(values: npt.NDArray[np.floating], *shares: float) -> list[float]:
    """Return percentiles of finite numbers, of which 50 is the median; NaN where there is no number."""
    if not values.size:
        return [float("nan")] * len(shares)
    least = values.min()
    if least == values.max():
        return [float(least)] * len(shares)
    return [float(one) for one in np.percentile(values, shares)]
