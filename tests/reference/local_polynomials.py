"""Local polynomials: equations (2), (8) and (9), in one window at every position, and in all windows of a record at their centres."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from numpy.polynomial import legendre

Array = npt.NDArray[np.float64]


@lru_cache(maxsize=2)
def tables(m: int, highest: int, max_deriv: int) -> Array:
    """Give the derivatives of the orthonormal polynomials on m samples: (derivative, position, degree), per half a window.

    They come from the thin QR of a Legendre Vandermonde matrix, and are made once for windows of one length.
    """
    x = np.linspace(-1, 1, m) if m > 1 else np.zeros(1)
    _, r = np.linalg.qr(legendre.legvander(x, highest))
    inverse = np.linalg.inv(r)
    units = np.eye(highest + 1)
    found = np.array([legendre.legval(x, legendre.legder(units, d)).T @ inverse for d in range(max_deriv + 1)])
    found.flags.writeable = False
    return found


def scaled_tables(m: int, delta: float, highest: int, max_deriv: int) -> Array:
    """Give the same per second."""
    scale = 1.0 if m == 1 else 2 / ((m - 1) * delta)
    return np.asarray(tables(m, highest, max_deriv) * (scale ** np.arange(max_deriv + 1))[:, None, None])


def criterion_of(rss: Array, m: int, criterion: str) -> Array:
    """Give the criterion by order, the last axis: (8) with (9); infinite where it cannot be judged."""
    scores = np.full(rss.shape, np.inf)
    for n in range(rss.shape[-1]):
        k = n + 2 if criterion == "aicc-textbook" else n + 1
        if m - k - 1 <= 0:
            continue
        correction = 2 * k * (k + 1) / (m - k - 1)
        penalty = {"aic": 2 * k, "bic": k * np.log(m)}.get(criterion, 2 * k + correction)
        variance = rss[..., n] / (m - 1)  # (9)
        with np.errstate(divide="ignore"):
            scores[..., n] = m * np.log(variance) + penalty  # (8)
    return scores


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
        """Give the criterion of every order."""
        return criterion_of(self.rss, self.gains.shape[2], criterion)


@dataclass
class Windows:
    """Every order's fit of every full window of a record, at its centre."""

    derivatives: Array
    """(window, derivative, order)."""
    gains: Array
    """(derivative, order): standard errors of the same for noise of one."""
    rss: Array
    """(window, order): residual sums of squares."""
    length: int
    """Samples of a window."""

    def scores(self, criterion: str = "aicc") -> Array:
        """Give the criterion of every window and order."""
        return criterion_of(self.rss, self.length, criterion)


def fit_window(samples: npt.ArrayLike, delta: float, highest: int, max_deriv: int) -> Window:
    """Fit (2) to one window for every order up to the highest."""
    y = np.asarray(samples, dtype=np.float64)
    m = y.size
    table = scaled_tables(m, delta, min(highest, m - 1), max_deriv)
    level = y[m // 2]
    coefficients = table[0].T @ (y - level)
    derivatives = np.cumsum(table * coefficients, axis=2).transpose(0, 2, 1)
    derivatives[0] += level
    gains = np.sqrt(np.cumsum(table**2, axis=2)).transpose(0, 2, 1)
    return Window(derivatives, gains, np.sum((y - derivatives[0]) ** 2, axis=1))


def fit_windows(y: Array, half: int, delta: float, highest: int, max_deriv: int) -> Windows:
    """Fit (2) to every full window of a record for every order up to the highest."""
    m = 2 * half + 1
    table = scaled_tables(m, delta, min(highest, m - 1), max_deriv)
    levels = y[half : y.size - half, None]
    samples = sliding_window_view(y, m) - levels
    coefficients = samples @ table[0]
    derivatives = np.cumsum(table[:, half] * coefficients[:, None], axis=2)
    derivatives[:, 0] += levels
    gains = np.sqrt(np.cumsum(table[:, half] ** 2, axis=1))
    rss = np.empty(coefficients.shape)
    residuals = samples.copy()
    for n in range(rss.shape[1]):
        # What an order leaves of the samples, one polynomial after another: a sum of squares, not a difference of two.
        residuals -= coefficients[:, n, None] * table[0, :, n]
        rss[:, n] = np.einsum("ij,ij->i", residuals, residuals)
    return Windows(derivatives, gains, rss, m)


def pooled_scores(windows: Windows, reach: int) -> Array:
    """Give the criterion of every order summed over each window's neighbours, as far as there are any."""
    scores = windows.scores()
    return np.array([scores[max(0, i - reach) : i + reach + 1].sum(axis=0) for i in range(len(scores))])


def akaike_weights(scores: Array) -> Array:
    """Give every order's weight by its criterion, the last axis."""
    weights = np.exp(-(scores - scores.min(axis=-1, keepdims=True)) / 2)
    return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


def pooled_weights(sums: Array, neighbours: npt.NDArray[np.int64], length: int) -> Array:
    """Give every order's weight by the criterion summed over neighbours: their mean, times the windows of their own that they amount to."""
    worth = {}
    for count in np.unique(neighbours):
        samples = np.convolve(np.ones(count), np.ones(length))
        worth[count] = samples.sum() ** 2 / (length * (samples**2).sum())
    return akaike_weights(sums * (np.array([worth[count] for count in neighbours]) / neighbours)[:, None])


def errors_around(windows: Windows, weights: Array, values: Array) -> Array:
    """Give standard errors of values at the centres, (window, derivative), that know what the orders disagree by."""
    freedom = windows.length - np.arange(weights.shape[1]) - 1
    sigma = np.sqrt(windows.rss / np.maximum(freedom, 1))
    squares = (sigma[:, None] * windows.gains) ** 2 + (windows.derivatives - values[:, :, None]) ** 2
    return np.asarray(np.einsum("idn,in->id", np.sqrt(squares), weights))


def akaike_average(windows: Windows) -> tuple[Array, Array, Array]:
    """Give Akaike's weights, the weighted averages of all orders at the centres, and their standard errors."""
    weights = akaike_weights(windows.scores())
    averages = np.einsum("idn,in->id", windows.derivatives, weights)
    return weights, averages, errors_around(windows, weights, averages)
