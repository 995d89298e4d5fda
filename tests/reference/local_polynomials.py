"""Local polynomials in one window: equations (2), (8) and (9)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

Array = npt.NDArray[np.float64]


@dataclass
class Window:
    """Every order's fit of one window."""

    derivatives: Array
    """(derivative, order, position): all derivatives wanted at every position of the window."""
    gains: Array
    """Standard errors of the same for noise of one."""
    rss: Array
    """Residual sum of squares by order."""

    def scores(self, criterion: str = "aicc") -> Array:
        """Give the criterion of every order: (8) with (9); infinite where it cannot be judged."""
        m = self.gains.shape[2]
        scores = np.full(self.rss.size, np.inf)
        for n, rss in enumerate(self.rss):
            k = n + 2 if criterion == "aicc-textbook" else n + 1
            if m - k - 1 <= 0:
                continue
            correction = 2 * k * (k + 1) / (m - k - 1)
            penalty = {"aic": 2 * k, "bic": k * np.log(m)}.get(criterion, 2 * k + correction)
            variance = rss / (m - 1)  # (9)
            scores[n] = (m * np.log(variance) if variance > 0 else -np.inf) + penalty  # (8)
        return scores


def orthonormal(m: int, highest: int) -> tuple[Array, Any]:
    """Give the thin QR of a Legendre Vandermonde matrix on m samples."""
    x = np.linspace(-1, 1, m) if m > 1 else np.zeros(1)
    q, r = np.linalg.qr(legendre.legvander(x, highest))
    return q, r


def fit_window(samples: npt.ArrayLike, delta: float, highest: int, max_deriv: int) -> Window:
    """Fit (2) to one window for every order up to the highest."""
    y = np.asarray(samples, dtype=np.float64)
    m = y.size
    highest = min(highest, m - 1)
    level = y[m // 2]
    x = np.linspace(-1, 1, m) if m > 1 else np.zeros(1)
    q, r = orthonormal(m, highest)
    inverse = np.linalg.inv(r)
    scale = 1.0 if m == 1 else 2 / ((m - 1) * delta)
    coefficients = q.T @ (y - level)
    derivatives = np.zeros((max_deriv + 1, highest + 1, m))
    gains = np.zeros_like(derivatives)
    for d in range(max_deriv + 1):
        table = np.zeros((m, highest + 1))
        for j in range(highest + 1):
            unit = np.zeros(highest + 1)
            unit[j] = 1
            table[:, j] = legendre.legval(x, legendre.legder(unit, d))
        table = table @ inverse * scale**d
        derivatives[d] = np.cumsum(table * coefficients, axis=1).T
        gains[d] = np.sqrt(np.cumsum(table**2, axis=1)).T
    derivatives[0] += level
    residuals = y - derivatives[0]
    return Window(derivatives, gains, np.sum(residuals**2, axis=1))


def pooled_scores(windows: list[Window], reach: int) -> Array:
    """Give the criterion of every order summed over each window's neighbours, as far as there are any."""
    scores = np.array([window.scores() for window in windows])
    return np.array([scores[max(0, i - reach) : i + reach + 1].sum(axis=0) for i in range(len(windows))])


def akaike_weights(scores: Array) -> Array:
    """Give every order's weight by its criterion."""
    weights = np.exp(-(scores - scores.min()) / 2)
    return np.asarray(weights / weights.sum())


def pooled_weights(sums: Array, neighbours: int, length: int) -> Array:
    """Give every order's weight by the criterion summed over neighbours: their mean, times the windows of their own that they amount to."""
    samples = np.convolve(np.ones(neighbours), np.ones(length))
    worth = samples.sum() ** 2 / (length * (samples**2).sum())
    return akaike_weights(sums * worth / neighbours)


def errors_around(window: Window, weights: Array, value: Array) -> Array:
    """Give standard errors of values at the centre that know what the orders disagree by."""
    half = window.gains.shape[2] // 2
    estimates, gains = window.derivatives[:, :, half], window.gains[:, :, half]
    freedom = window.gains.shape[2] - np.arange(weights.size) - 1
    sigma = np.sqrt(window.rss / np.maximum(freedom, 1))
    return np.asarray(np.sqrt((sigma * gains) ** 2 + (estimates - value[:, None]) ** 2) @ weights)


def akaike_average(window: Window) -> tuple[Array, Array, Array]:
    """Give Akaike's weights, the weighted average of all orders at the centre, and its standard error."""
    weights = akaike_weights(window.scores())
    average = window.derivatives[:, :, window.gains.shape[2] // 2] @ weights
    return weights, average, errors_around(window, weights, average)
