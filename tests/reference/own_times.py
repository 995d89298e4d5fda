"""Local polynomials at the samples' own times, slowly: every order by its own least squares, in Legendre polynomials of the window."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

Array = npt.NDArray[np.float64]


def window_of(times: Array, sample: int, length: float) -> npt.NDArray[np.intp]:
    """Give the samples of the window around a sample: so many, or those of so many seconds, within the record."""
    if isinstance(length, int):
        first = min(max(sample - length // 2, 0), times.size - length)
        return np.arange(first, first + length)
    middle = max(min(times[sample], times[-1] - length / 2), times[0] + length / 2)
    return np.flatnonzero((times >= middle - length / 2) & (times <= middle + length / 2))


def fit(times: Array, samples: Array, at: float, derivatives: int, highest: int) -> tuple[Array, Array, Array, Array]:
    """Give for every order the derivatives at a time, their variances over the noise's, the residual sum of squares, and AICc."""
    count = times.size
    middle, half = (times[0] + times[-1]) / 2, (times[-1] - times[0]) / 2
    x, place = (times - middle) / half, (at - middle) / half
    values, gains, residuals, scores = [], [], [], []
    for order in range(highest + 1):
        k = order + 1
        if count - k - 1 <= 0:
            break
        design = legendre.legvander(x, order)
        found, *_ = np.linalg.lstsq(design, samples, rcond=None)
        left = samples - design @ found
        covariance = np.linalg.inv(design.T @ design)
        rows = [
            [legendre.legval(place, legendre.legder(unit, d)) / half**d if d <= order else 0.0 for unit in np.eye(k)]
            for d in range(derivatives + 1)
        ]
        values.append([np.dot(row, found) for row in rows])
        gains.append([np.dot(row, covariance @ row) for row in rows])
        rss = float(left @ left)
        residuals.append(rss)
        scores.append(count * np.log(rss / (count - 1)) + 2 * k + 2 * k * (k + 1) / (count - k - 1))
    return np.array(values), np.array(gains), np.array(residuals), np.array(scores)
