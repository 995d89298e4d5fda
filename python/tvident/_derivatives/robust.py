"""Samples whose least squares in windows are those of Huber's loss: residuals of the value are clipped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._derivatives.found import Found
from tvident._derivatives.incomplete import Incomplete, filled
from tvident._derivatives.plans import SHORTEST_WINDOW
from tvident._huber import pseudo_values

Array = npt.NDArray[np.float64]

Value = Callable[[Array, Array | None], Array]
"""What windows say of the value at every sample of records, whose samples may have weights."""

ValueIn = Callable[[int], Value]
"""Gives that for windows of a length."""

_CHOICES = 2
"""Times that windows are chosen before residuals are clipped: spikes make the first choice too short."""

_USUAL_PARAMETERS = 5
"""Coefficients of a polynomial of order 4, for the correction of standard errors, which hardly depends on it."""


def robust(
    samples: npt.NDArray[Any],
    choose: Callable[..., Found] | None,
    value_in: ValueIn,
    length: int,
    *,
    omit: bool,
    weights: Array | None = None,
) -> npt.NDArray[Any]:
    """Return samples with clipped residuals, in windows of a length or in those that are chosen.

    Parameters
    ----------
    samples : ndarray, shape (*, n)
    choose : callable, optional
        Chooses windows.
    value_in : callable
    length : int
        Samples in a window, where it is not chosen.
    omit : bool
        Missing samples are left out of windows: each record has its own.
    weights : ndarray, shape (*, n), optional
    """
    for _ in range(_CHOICES if choose else 1):
        if choose is not None:
            found = choose(samples, max_deriv=0, step=samples.shape[-1], progress=None)
            length = int(np.median(np.asarray(found.window_length)))
        value = value_in(max(length, SHORTEST_WINDOW))
        samples = with_clipped_residuals(samples, value, length, omit=omit, weights=weights)
    return samples


def value_in(
    plan_of: Callable[..., _core.LocalPolynomials], without: Callable[[int], Incomplete | None], workers: int | None
) -> ValueIn:
    """Return what windows of a length say, of samples of which something may be left out.

    Parameters
    ----------
    plan_of : callable
        Gives the plan of windows of a length for derivatives up to `derivative`.
    without : callable
        Gives what is left out of windows of a length.
    workers : int, optional
    """

    def of_length(length: int) -> Value:
        core_plan, left_out = plan_of(length, derivative=0), without(length)

        def value(records: Array, weights: Array | None) -> Array:
            if left_out is None:
                return np.asarray(core_plan.estimate(records, step=1, workers=workers).derivatives[0])
            own = replace(left_out, weights=weights)
            whole = core_plan.estimate(own.plain(records), step=1, workers=workers)
            return np.asarray(filled(core_plan, whole, records, own, step=1, workers=workers).derivatives[0])

        return value

    return of_length


def with_clipped_residuals(
    samples: npt.NDArray[Any], value: Value, length: int, *, omit: bool, weights: Array | None = None
) -> Array:
    """Return samples whose least squares in windows of a length are those of Huber's loss.

    Residuals are compared times the roots of their weights, which makes their noise the same.
    """
    records = samples.reshape(-1, samples.shape[-1]).astype(np.float64)

    def clipped(some: Array, used: npt.NDArray[np.bool_], weight: Array | None = None) -> Array:
        roots = np.ones(1) if weight is None else np.sqrt(np.where(weight > 0, weight, 1.0))

        def solve(rhs: Array) -> Array:
            return np.asarray((value(rhs.T / roots, weight) * roots).T)

        return np.asarray(pseudo_values(solve, (some * roots).T, used, length, _USUAL_PARAMETERS).T / roots)

    if weights is not None:
        own = np.broadcast_to(weights, samples.shape).reshape(records.shape)
        # What has no weight may hold anything.
        records = np.where(own > 0, records, np.nan)
        each = [
            clipped(record[None], np.isfinite(record) & (one > 0), one[None])
            for record, one in zip(records, own, strict=True)
        ]
        return np.concatenate(each).reshape(samples.shape)
    if omit and not np.isfinite(records).all():
        each = [clipped(record[None], np.isfinite(record)) for record in records]
        return np.concatenate(each).reshape(samples.shape)
    return clipped(records, np.ones(records.shape[-1], bool)).reshape(samples.shape)
