"""PyNumDiff's Kalman filter and smoother, compiled: its search for the settings of `rtsdiff` takes some 1500 passes over a record.

A pass spends its time in calls of NumPy for matrices of two to four rows, one after another for every sample. Compiled, the same operations
in the same order take a tenth of the time and give the same numbers, so the search finds the same settings. PyNumDiff's own functions
still do whatever is not a series of numbers with one model for all its steps.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_TOLERANCE = 1e-10
"""Of what is compiled, over the largest derivative. Found: no difference at all."""


@functools.cache
def install() -> None:
    """Let PyNumDiff's `rtsdiff` run compiled in this process.

    Raises
    ------
    RuntimeError
        If it differs from PyNumDiff's own by more than 1e-10 with any of 18 settings.
    """
    from pynumdiff import kalman_smooth as module  # noqa: PLC0415 - optional

    rng = np.random.default_rng(0)
    samples = np.sin(np.linspace(0, 9, 300)) + 0.1 * rng.standard_normal(300)
    settings = list(itertools.product((1, 2, 3), (-8.0, 4.5, 12.0), (False, True)))

    def derivatives() -> Array:
        return np.stack([module.rtsdiff(samples, 0.01, *one)[1] for one in settings])

    own = derivatives()
    module.kalman_filter = _filter_instead_of(module.kalman_filter)
    module.rts_smooth = _smooth_instead_of(module.rts_smooth)
    difference = np.max(np.abs(derivatives() - own)) / np.max(np.abs(own))
    if not difference <= _TOLERANCE:
        message = (
            f"rtsdiff, compiled, must agree with PyNumDiff's own to {_TOLERANCE:g}; it differs by {difference:.1g}."
        )
        raise RuntimeError(message)


def _filter_instead_of(own: Callable[..., Any]) -> Callable[..., Any]:
    """Return a filter with the arguments of PyNumDiff's."""
    compiled = numba.njit(_filter)

    @functools.wraps(own)
    def kalman_filter(samples: Array, state: Array, *model: Array, **rest: Any) -> Any:
        covariance, step, added, measured, noise = model
        plain = samples.ndim == 1 and step.ndim == added.ndim == 2  # noqa: PLR2004 - a matrix
        if not plain or not np.array_equal(measured, np.eye(1, state.size)) or any(rest.values()):
            return own(samples, state, *model, **rest)
        arrays = map(np.ascontiguousarray, (samples, state, covariance, step, added))
        return compiled(*arrays, noise[0, 0])

    return kalman_filter


def _smooth_instead_of(own: Callable[..., Any]) -> Callable[..., Any]:
    """Return a smoother with the arguments of PyNumDiff's."""
    compiled = numba.njit(_smooth)

    @functools.wraps(own)
    def rts_smooth(step: Array, *filtered: Array, **rest: Any) -> Any:
        if step.ndim != 2 or rest != {"compute_P_smooth": False}:  # noqa: PLR2004 - a matrix
            return own(step, *filtered, **rest)
        return compiled(np.ascontiguousarray(step), *filtered)

    return rts_smooth


def _filter(
    samples: Array, state: Array, covariance: Array, step: Array, added: Array, noise: float
) -> tuple[Array, Array, Array, Array]:
    """Return states before and after each sample, and their covariances; the first state is measured."""
    count, size = samples.size, state.size
    before, after = np.empty((count, size)), np.empty((count, size))
    covariance_before, covariance_after = np.empty((count, size, size)), np.empty((count, size, size))
    for place in range(count):
        if place > 0:
            state = step @ state
            covariance = step @ covariance @ step.T + added
        before[place], covariance_before[place] = state, covariance
        if not np.isnan(samples[place]):
            gain = covariance[:, 0] * (1 / (covariance[0, 0] + noise))
            state = state + gain * (samples[place] - state[0])
            covariance = covariance - np.outer(gain, covariance[0])
        after[place], covariance_after[place] = state, covariance
    return before, after, covariance_before, covariance_after


def _smooth(step: Array, before: Array, after: Array, covariance_before: Array, covariance_after: Array) -> Array:
    """Return the states that all samples tell of (Rauch, Tung and Striebel)."""
    smooth, unit = after.copy(), np.eye(after.shape[1])
    for place in range(after.shape[0] - 2, -1, -1):
        gain = covariance_after[place] @ step.T @ np.linalg.solve(covariance_before[place + 1], unit)
        smooth[place] = after[place] + gain @ (smooth[place + 1] - before[place + 1])
    return smooth
