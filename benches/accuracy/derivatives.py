"""Errors of the angle's derivatives by this library's ways to choose window and order, and what their standard errors say."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import tvident
from accuracy import errors

Values = dict[str, Any]

_WINDOWS = (25, 41, 61, 101, 151, 201, 301, 401)
_ORDERS = range(2, 16)

DERIVATIVES = ("true_angle", "true_velocity", "true_acceleration")
"""The truth of every derivative, from the 0th."""


def chosen(**options: Any) -> Callable[[tvident.Recording], Values]:
    """Return a method that differentiates with the given arguments of :func:`tvident.fit_local_polynomials`."""
    return lambda recording: _judged(recording, with_errors=True, **options)


def best_fixed(recording: tvident.Recording) -> Values:
    """Differentiate with every window and order of a grid and keep the best."""
    candidates = [_judged(recording, window_length=m, order=n) for m in _WINDOWS for n in _ORDERS]
    return min(candidates, key=lambda values: values["acceleration"])


def best_order(recording: tvident.Recording) -> Values:
    """Differentiate with every order in a window of 101 samples and keep the best."""
    candidates = [_judged(recording, window_length=101, order=n) for n in _ORDERS]
    return min(candidates, key=lambda values: values["acceleration"])


def _judged(recording: tvident.Recording, *, with_errors: bool = False, **options: Any) -> Values:
    """Differentiate and compare with the truth; where that is refused, say why."""
    try:
        fit = tvident.fit_local_polynomials(
            recording.angle, sample_rate=recording.sample_rate, max_deriv=2, workers=1, **options
        )
    except (TypeError, ValueError, NotImplementedError) as refusal:
        return {"unavailable": str(refusal)}
    values: Values = {"acceleration": errors.of_acceleration(fit.derivatives[2], recording), "settings": options}
    return values | _standard_errors(fit, recording) if with_errors else values


def _standard_errors(fit: tvident.LocalPolynomialFit, recording: tvident.Recording) -> Values:
    """Return, for every derivative, how often nominal 95 % intervals hold the truth, and the error over the standard error."""
    inside = errors.interior(recording.time.size)
    covered, ratio = [], []
    for found, deviation, name in zip(fit.derivatives, fit.stderr, DERIVATIVES, strict=True):
        error = (found - getattr(recording, name))[inside]
        covered.append(errors.coverage(error, deviation[inside]))
        ratio.append(float(np.sqrt(np.nanmean(error**2) / np.nanmean(deviation[inside] ** 2))))
    return {"covered": covered, "error_over_stderr": ratio}
