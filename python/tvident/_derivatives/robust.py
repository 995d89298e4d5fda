"""Samples whose least squares in windows are those of Huber's loss: residuals of the value are clipped."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._derivatives.found import Found
from tvident._derivatives.incomplete import Incomplete, filled
from tvident._derivatives.plans import SHORTEST_WINDOW
from tvident._huber import pseudo_values

Array = npt.NDArray[np.float64]

ValueIn = Callable[[int], Callable[[Array], Array]]
"""Gives, for windows of a length, what they say of the value at every sample of records."""

_CHOICES = 2
"""Times that windows are chosen before residuals are clipped: spikes make the first choice too short."""

_USUAL_PARAMETERS = 5
"""Coefficients of a polynomial of order 4, for the correction of standard errors, which hardly depends on it."""


def robust(
    samples: npt.NDArray[Any], choose: Callable[..., Found] | None, value_in: ValueIn, length: int, *, omit: bool
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
    """
    for _ in range(_CHOICES if choose else 1):
        if choose is not None:
            value = choose(samples, max_deriv=0, step=samples.shape[-1], progress=None)
            length = int(np.median(np.asarray(value.window_length)))
        samples = with_clipped_residuals(samples, value_in(max(length, SHORTEST_WINDOW)), length, omit=omit)
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

    def of_length(length: int) -> Callable[[Array], Array]:
        core_plan, left_out = plan_of(length, derivative=0), without(length)

        def value(records: Array) -> Array:
            whole = core_plan.estimate(records, step=1, workers=workers)
            if left_out is None:
                return np.asarray(whole.derivatives[0])
            return np.asarray(filled(core_plan, whole, records, left_out, step=1, workers=workers).derivatives[0])

        return value

    return of_length


def with_clipped_residuals(
    samples: npt.NDArray[Any], value: Callable[[Array], Array], length: int, *, omit: bool
) -> Array:
    """Return samples whose least squares in windows of a length are those of Huber's loss."""
    records = samples.reshape(-1, samples.shape[-1]).astype(np.float64)

    def clipped(some: Array, used: npt.NDArray[np.bool_]) -> Array:
        def solve(rhs: Array) -> Array:
            return np.asarray(value(np.ascontiguousarray(rhs.T)).T)

        return np.asarray(pseudo_values(solve, some.T, used, length, _USUAL_PARAMETERS).T)

    if omit and not np.isfinite(records).all():
        each = [clipped(record[None], np.isfinite(record)) for record in records]
        return np.concatenate(each).reshape(samples.shape)
    return clipped(records, np.ones(records.shape[-1], bool)).reshape(samples.shape)
