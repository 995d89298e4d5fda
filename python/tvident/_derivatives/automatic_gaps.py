"""Windows chosen for records in which samples are missing: gaps are bridged to choose windows, and left out of the estimates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._derivatives.found import CHOSEN, Found, together
from tvident._derivatives.incomplete import Incomplete, filled, left_out
from tvident._derivatives.plans import sliding_window
from tvident._status import Status

Numbers = npt.NDArray[np.float64]

Choose = Callable[..., Found]
"""Chooses windows and orders for records, and estimates; windows that hold a missing sample are left out."""

PlanOf = Callable[..., _core.LocalPolynomials]
"""Gives the plan of windows of a length, with orders up to `highest`, for derivatives up to `derivative`."""

_FIRST, _ROUNDS = 17, 4
"""Samples of the windows that first bridge gaps, of at most half of them, and how often longer windows may bridge longer ones."""

_OF_GAPS = Status.INVALID | Status.GAP | Status.EDGE | Status.EXACT
"""Flags that do not speak of a choice of order."""


# What users give to fit_local_polynomials comes here as it is.
def choose_beside_gaps(
    choose: Choose,
    plan_of: PlanOf,
    longest_gap: int | None,
    samples: npt.NDArray[np.number],
    *,
    max_deriv: int,
    step: int,
    progress: Callable[[int, int], object] | None,
    workers: int | None,
) -> Found:
    """Choose window and order for every record and derivative, and estimate beside and in gaps of at most half a window, or as given."""
    if np.isfinite(samples).all():
        return choose(samples, max_deriv=max_deriv, step=step, progress=progress)
    records = np.asarray(samples, np.float64).reshape(-1, samples.shape[-1])
    choose_one = partial(choose, max_deriv=max_deriv, step=1, progress=None)
    each = []
    for done, record in enumerate(records):
        each.append(_of_record(choose_one, plan_of, longest_gap, record, workers, step))
        if progress is not None:
            progress(done + 1, len(records))
    return together(each, samples.shape[:-1], step, by_record=CHOSEN)


def _of_record(
    choose: Callable[[Numbers], Found],
    plan_of: PlanOf,
    longest_gap: int | None,
    record: Numbers,
    workers: int | None,
    step: int,
) -> Found:
    """Return what is found of one record; beside gaps at every so many samples alone."""
    there = np.isfinite(record)
    if there.all() or not there.any():
        return choose(record)
    length, found = _FIRST, choose(record)
    for _ in range(_ROUNDS):
        bridged = _bridged(record, plan_of(length, derivative=0), left_out(length, longest_gap), workers)
        found = choose(bridged)
        longer = sliding_window(int(np.ravel(found.window_length)[0]), record.size)
        if longer <= length:
            break
        length = longer
    errors = np.array(found.errors())
    lengths = [sliding_window(length, record.size) for length in np.asarray(found.window_length).tolist()]
    for derivative, (own, order) in enumerate(zip(lengths, found.settings["order"], strict=True)):
        plan = plan_of(own, highest=order, derivative=derivative)
        without = replace(left_out(own, longest_gap), every=step)
        beside = filled(plan, plan.estimate(record, workers=workers), record, without, step=1, workers=workers)
        # Windows are averaged with others of up to twice the length.
        near = _near(~there, own)
        found.derivatives[derivative, near] = beside.derivatives[derivative, near]
        errors[derivative, near] = beside.errors()[derivative, near]
        found.order[near] = beside.order[near]
        found.status[near] = beside.status[near] & np.uint16(_OF_GAPS)
    found.status[np.isnan(found.derivatives).any(axis=0)] |= np.uint16(Status.INVALID)
    return replace(found, errors=lambda: errors)


def _bridged(record: Numbers, plan: _core.LocalPolynomials, without: Incomplete, workers: int | None) -> Numbers:
    """Return a record with what windows say of missing samples as well as the samples would, and noise such as theirs.

    The noise of the record is estimated from it, too.
    """
    missing = np.flatnonzero(~np.isfinite(record))
    found = plan.estimate_incomplete(record, missing.tolist(), without.longest_gap, without.least, workers=workers)
    noise = np.random.default_rng(missing.size).standard_normal(missing.size)
    bridged = record.copy()
    bridged[missing] = found.derivatives[0] + found.sigma * noise
    told = found.stderr[0] <= found.sigma
    bridged[missing[~told]] = np.nan
    return bridged


def _near(missing: npt.NDArray[np.bool_], reach: int) -> npt.NDArray[np.bool_]:
    """Return which samples have a missing one at most so many away."""
    before = np.concatenate([np.zeros(reach + 1, np.intp), np.cumsum(missing), np.full(reach, missing.sum())])
    return np.asarray(before[2 * reach + 1 :] > before[: missing.size])
