"""Errors of the angle's second derivative by this library's ways to choose window and order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import tvident
from accuracy import errors

Values = dict[str, Any]

_WINDOWS = (25, 41, 61, 101, 151, 201, 301, 401)
_ORDERS = range(2, 16)


def chosen(**options: Any) -> Callable[[tvident.Recording], Values]:
    """Return a method that differentiates with the given arguments of :func:`tvident.fit_local_polynomials`."""
    return lambda recording: _judged(recording, **options)


def best_fixed(recording: tvident.Recording) -> Values:
    """Differentiate with every window and order of a grid and keep the best."""
    candidates = [_judged(recording, window_length=m, order=n) for m in _WINDOWS for n in _ORDERS]
    return min(candidates, key=lambda values: values["acceleration"])


def best_order(recording: tvident.Recording) -> Values:
    """Differentiate with every order in a window of 101 samples and keep the best."""
    candidates = [_judged(recording, window_length=101, order=n) for n in _ORDERS]
    return min(candidates, key=lambda values: values["acceleration"])


def _judged(recording: tvident.Recording, **options: Any) -> Values:
    """Differentiate and compare with the truth; where that is refused, say why."""
    try:
        fit = tvident.fit_local_polynomials(
            recording.angle, sample_rate=recording.sample_rate, max_deriv=2, workers=1, **options
        )
    except (TypeError, ValueError, NotImplementedError) as refusal:
        return {"unavailable": str(refusal)}
    return {"acceleration": errors.of_acceleration(fit.derivatives[2], recording), "settings": options}
