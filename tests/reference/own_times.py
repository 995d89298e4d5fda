"""Local polynomials at the samples' own times, slowly: every order by its own least squares, in Legendre polynomials of the window."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

Array = npt.NDArray[np.float64]


def window_of(times: Array, sample: int, length: float) -> npt.NDArray[np.intp]:
    """Give the samples of the window around a sample: so many, or those of so many seconds, within the record."""
    if isinstance(length, int):
        first = max(min(max(sample - length // 2, 0), times.size - length), 0)
        return np.arange(first, min(first + length, times.size))
    middle = max(min(times[sample], times[-1] - length / 2), times[0] + length / 2)
    after = (times >= middle - length / 2) | (middle <= times[0] + length / 2)
    before = (times <= middle + length / 2) | (middle >= times[-1] - length / 2)
    return np.flatnonzero(after & before)


def parts_of(times: Array, there: npt.NDArray[np.bool_], longest: float) -> list[npt.NDArray[np.intp]]:
    """Give the numbers of the samples that are there, between steps of time that are longer."""
    parts: list[list[int]] = []
    for sample in np.flatnonzero(there).tolist():
        if not parts or times[sample] - times[parts[-1][-1]] > longest:
            parts.append([])
        parts[-1].append(sample)
    return [np.array(part) for part in parts]


def fit(
    times: Array, samples: Array, at: float, derivatives: int, highest: int, weights: Array | None = None
) -> tuple[Array, Array, Array, Array]:
    """Give for every order the derivatives at a time, their variances over the noise's, the residual sum of squares, and AICc."""
    roots = np.ones(times.size) if weights is None else np.sqrt(weights)
    count = times.size
    middle, half = (times[0] + times[-1]) / 2, (times[-1] - times[0]) / 2
    x, place = (times - middle) / half, (at - middle) / half
    values, gains, residuals, scores = [], [], [], []
    for order in range(highest + 1):
        k = order + 1
        if count - k - 1 <= 0:
            break
        design = legendre.legvander(x, order) * roots[:, np.newaxis]
        found, *_ = np.linalg.lstsq(design, samples * roots, rcond=None)
        left = samples * roots - design @ found
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
