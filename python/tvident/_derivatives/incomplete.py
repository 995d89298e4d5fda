"""Samples that are missing or have weights: windows that hold any are fitted on what is there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._status import Status

Array = npt.NDArray[np.float64]

Part = tuple[tuple[int, int], tuple[int, int], int]
"""Of a record: the samples that are wanted, those that are held, and how many it has."""

_FEWEST = 3
"""Samples that leave a choice of order."""


@dataclass(frozen=True)
class Incomplete:
    r"""What is left out, and what windows must hold.

    Parameters
    ----------
    omit : bool
        Samples that are no numbers are left out.
    weights : ndarray, shape (\*, n), optional
    longest_gap : int
        Samples; windows do not reach across longer gaps.
    least : int
        Samples that a window must hold.
    every : int, optional
        Of the estimates that lack samples every how many are wanted; others stay as they are.
    """

    omit: bool
    weights: Array | None
    longest_gap: int
    least: int
    every: int = 1

    def plain(self, samples: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return samples whose windows are not to be fitted if they hold what is no number."""
        return samples if self.weights is None else np.where(self.weights > 0, samples, 0)


@dataclass
class Filled:
    """Estimates of all windows, and the standard errors of those that lack samples."""

    derivatives: Array
    order: npt.NDArray[np.uint8]
    status: npt.NDArray[np.uint16]
    sigma: Array
    errors: Callable[[], Array]


def gaps_given(
    nan_policy: str,
    max_gap: int | str | None,
    min_observations: int | None,
    *,
    weighted: bool,
    length: int,
    period: float,
    weights: Array | None = None,
) -> Incomplete | None:
    """Return what is left out, as it was asked for; None where windows are to be whole. Weights may come later."""
    if not leaves_out(nan_policy, max_gap, min_observations, weighted=weighted):
        return None
    longest = longest_gap(max_gap, period)
    least = (length + 1) // 2
    if min_observations is not None:
        least = least_given(min_observations, length)
    return Incomplete(nan_policy == "omit", weights, length // 2 if longest is None else longest, least)


def leaves_out(nan_policy: str, max_gap: int | str | None, min_observations: int | None, *, weighted: bool) -> bool:
    """Return whether samples may be left out; refuse what is said of gaps where they may not."""
    if nan_policy == "omit" or weighted:
        return True
    for name, value in (("max_gap", max_gap), ("min_observations", min_observations)):
        if value is not None:
            raise ValueError(
                f"{name} must go with nan_policy='omit' or weights; got {arguments.shown(value)} with {nan_policy!r}; give one of them, "
                f"or no {name}"
            )
    return False


def least_given(min_observations: int, most: int | None) -> int:
    """Return the samples that a window must hold, which it has at most so many of."""
    return arguments.whole_number("min_observations", min_observations, least=_FEWEST, most=most)


def weights_along(weights: npt.ArrayLike, shape: tuple[int, ...], axis: int) -> Array | None:
    """Return the weight of every sample of records of a shape, time last; weights are one for all records, or of each."""
    is_one = arguments.any_array("weights", weights).ndim == 1
    given = arguments.weights("weights", weights, (shape[axis],) if is_one else shape)
    if given is None:
        return None
    leading = [extent for place, extent in enumerate(shape) if place != axis % len(shape)]
    last = given if is_one else np.moveaxis(given, axis, -1)
    return np.broadcast_to(last, (*leading, shape[axis]))


def longest_gap(max_gap: int | str | None, period: float) -> int | None:
    """Return the samples of the longest gap that is asked for; None where that is half a window."""
    return None if max_gap is None else arguments.window_length("max_gap", max_gap, period, odd=False)


def left_out(length: int, longest_gap: int | None) -> Incomplete:
    """Return what is left out of windows of a length where nothing was asked for but the gaps that they may reach across."""
    longest = length // 2 if longest_gap is None else longest_gap
    return Incomplete(omit=True, weights=None, longest_gap=longest, least=(length + 1) // 2)


def check_weighted(*, automatic: bool, weighted: bool, selection: str) -> None:
    """Check what does not go with weights, of which every window has polynomials of its own, or with a least number of samples."""
    wrong = [
        ("window_length", "a length", "'auto'", automatic),
        ("selection", "'window'", repr(selection), weighted and selection != "window"),
    ]
    for name, right, got, is_wrong in wrong:
        if is_wrong:
            raise ValueError(
                f"{name} must be {right} where samples have weights or windows a least number of them (weights=, min_observations=); got "
                f"{got}; give {right}, or repair the samples first"
            )


def filled(
    core_plan: _core.LocalPolynomials,
    estimates: _core.LocalEstimates,
    samples: npt.NDArray[Any],
    incomplete: Incomplete,
    *,
    step: int,
    workers: int | None,
    part: Part | None = None,
) -> Filled:
    """Return estimates with those of windows that lack samples, or whose samples have weights: of a record, or of a part of one."""
    derivatives, order, status, sigma = estimates.derivatives, estimates.order, estimates.status, estimates.sigma
    leading = samples.shape[:-1]
    # Of the samples that are held, that of the first estimate.
    first = 0 if part is None else -(-part[0][0] // step) * step - part[1][0]
    errors: list[tuple[Any, Array]] = []
    for index in np.ndindex(leading):
        weight = None if incomplete.weights is None else incomplete.weights[index]
        lost = status[index] & Status.INVALID != 0
        wanted = lost if weight is None else np.ones_like(lost) if incomplete.omit else ~lost
        places = np.flatnonzero(wanted[:: incomplete.every]) * incomplete.every
        if not places.size:
            continue
        found = core_plan.estimate_incomplete(
            np.ascontiguousarray(samples[index]),
            (places * step + first).tolist(),
            incomplete.longest_gap,
            incomplete.least,
            weights=None if weight is None else np.ascontiguousarray(weight),
            workers=workers,
        )
        derivatives[(slice(None), *index, places)] = found.derivatives
        order[(*index, places)], status[(*index, places)] = found.order, found.status
        sigma[(*index, places)] = found.sigma
        # A polynomial of a lower order has no such derivative: zero without an error is no estimate of it.
        unknown = np.arange(derivatives.shape[0])[:, None] > found.order
        errors.append(((slice(None), *index, places), np.where(unknown, np.nan, found.stderr)))

    def standard_errors() -> Array:
        computed = core_plan.errors(incomplete.plain(samples), step=step, part=part, workers=workers)
        for place, values in errors:
            computed[place] = values
        return computed

    return Filled(derivatives, order, status, sigma, standard_errors)
