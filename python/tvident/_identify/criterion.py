"""The criterion that equations of motion are compared by: Akaike's, with the effective number of overlapping rows."""

from __future__ import annotations

import math

import numpy as np

from tvident import _core


def effective_observations(samples: int, window_length: int, exponent: int) -> float:
    """Return how many independent observations overlapping rows are worth: samples over the sum of their squared autocorrelations.

    White noise of the torque makes rows whose autocorrelation is that of the test function. The logarithm of their mean square then
    scatters as that of so many independent ones (Bartlett), and a regressor that is not needed, with the rows' spectrum, lowers it by
    one over this number.
    """
    x = np.linspace(-1, 1, window_length)
    function = (1 - x**2) ** exponent
    autocorrelation = np.correlate(function, function, mode="full")
    return float(samples / np.sum((autocorrelation / autocorrelation.max()) ** 2))


def aicc(mean_square: float, observations: float, parameters: float) -> float:
    """Return the corrected Akaike information criterion; infinite where there are not more observations than parameters."""
    k = parameters + 1  # and the variance
    if not 0 < mean_square < math.inf or observations <= k + 1:
        return math.inf
    return observations * math.log(mean_square) + 2 * k * observations / (observations - k - 1)


def criterion_of(found: _core.Identification, samples: int, more: int, *, linear: bool) -> float:
    """Return the criterion of what was found in a record of so many samples, with so many parameters more than the core knows of.

    The rows of the strong form are worth as many observations as its polynomials have coefficients: fewer than there are, if the noise
    is that of the torque.
    """
    residuals = found.residual_std[np.isfinite(found.residual_std)]
    if not residuals.size:
        return math.inf
    if found.exponent is None:
        orders = found.order[found.order > 0]
        observations = samples * (float(np.median(orders)) + 1 if orders.size else 1.0) / found.window_length
    else:
        observations = effective_observations(samples, found.window_length, found.exponent)
    windows = samples / max(1, found.regression_window) * (2 if linear else 1)
    parameters = sum(1.0 if one.kind == "constant" else windows for one in found.unknowns)
    return aicc(float(np.mean(residuals**2)), observations, parameters + more)
