"""Local polynomials of dask arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np

from tvident import _arguments as arguments
from tvident import _core
from tvident._choices import Criterion, Selection
from tvident._dask.blocks import blocks, imported, joined, rows, samples_of, stacked, weights_of
from tvident._derivatives import (
    HIGHEST_ORDER,
    SHORTEST_WINDOW,
    Incomplete,
    Part,
    check_weighted,
    filled,
    gaps_given,
    plan,
    quantisation_step,
)
from tvident._identify import Span

_REACH = 3
"""Windows that lie between a sample and the farthest that has a part in its estimate."""


@dataclass(frozen=True)
class DaskPolynomialFit:
    r"""Local polynomials of dask arrays; nothing is computed before it is asked for.

    Attributes
    ----------
    derivatives, stderr : dask.array.Array, shape (max_deriv + 1, \*, n)
    order : dask.array.Array of uint8, shape (\*, n)
    sigma : dask.array.Array, shape (\*, n)
    status : dask.array.Array of uint16, shape (\*, n)
    window_length : int

    See Also
    --------
    tvident.dask.fit_local_polynomials : returns it.
    tvident.LocalPolynomialFit : the same of arrays in memory, which says more of each.

    References
    ----------
    M. Rocklin: Dask: parallel computation with blocked algorithms and task scheduling, Proceedings of the 14th Python in Science Conference
    (2015).
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import dask.array as da
    >>> import tvident.dask
    >>> fit = tvident.dask.fit_local_polynomials(da.sin(da.linspace(0, 9, 3000, chunks=1000)), 101)
    >>> fit.order.shape
    (3000,)
    """

    derivatives: Any
    stderr: Any
    order: Any
    sigma: Any
    status: Any
    window_length: int


# Most of it says what it does; all but the data are options, as users call it.
def fit_local_polynomials(
    y: Any,
    window_length: int | str,
    *,
    delta: float | None = None,
    sample_rate: float | None = None,
    max_order: int = HIGHEST_ORDER,
    order: int | None = None,
    criterion: Criterion = "aicc",
    selection: Selection = "window",
    max_deriv: int = 2,
    step: int = 1,
    weights: Any = None,
    nan_policy: arguments.RowPolicy = "propagate",
    max_gap: int | str | None = None,
    min_observations: int | None = None,
    quantisation: float | None = None,
) -> DaskPolynomialFit:
    r"""Differentiate the samples of a dask array, with the bits that :func:`tvident.fit_local_polynomials` gives in memory.

    Parameters
    ----------
    y : dask.array.Array, shape (\*, n)
        Time is the last axis. Chunks may have any size; those shorter than three windows are worked on together. Masked values are
        missing, as NaN is.
    window_length : int or str
        Samples in a window, or a duration such as ``"0.2 s"``.
    weights : dask.array.Array, shape (\*, n) or (n,), optional
        One over the variance of the noise at every sample, relative to the others, and 0 where it is not to be used.
    delta, sample_rate, max_order, order, criterion, selection, max_deriv, step : optional
    nan_policy, max_gap, min_observations, quantisation : optional
        As in :func:`tvident.fit_local_polynomials`. With ``nan_policy="raise"`` a block that holds no number raises when it is computed.

    Returns
    -------
    DaskPolynomialFit
        Dask arrays, of which nothing is computed yet.

    Raises
    ------
    TypeError
        If `y` is no dask array, or holds no real numbers.
    ValueError
        If the window is even, shorter than 5 samples or longer than the record, or another option is impossible.
    ImportError
        If dask is missing: install ``tvident[dask]``.

    Notes
    -----
    Every block is one task on one thread: dask has as many threads as there is to do. Windows begin at places that depend on the number of
    a sample in the whole record alone, so the chunks of an array do not change the bits. A block reads three windows of its neighbours,
    or a window and the longest gap that windows reach across, where that is more. The cost is that of the call in memory, and some
    milliseconds a task.

    See Also
    --------
    tvident.fit_local_polynomials : of arrays in memory.
    tvident.dask.identify : parameters of the equation of motion.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import dask.array as da
    >>> import numpy as np
    >>> import tvident
    >>> import tvident.dask
    >>> y = np.sin(np.arange(5000) / 50) + 1e-3 * np.random.default_rng(0).standard_normal(5000)
    >>> fit = tvident.dask.fit_local_polynomials(da.from_array(y, chunks=1234), 101, sample_rate=1000)
    >>> whole = tvident.fit_local_polynomials(y, 101, sample_rate=1000)
    >>> bool(np.array_equal(fit.derivatives.compute(), whole.derivatives))
    True
    """
    dask, _ = imported()
    y = samples_of("y", y)
    seconds = arguments.sample_period(y.shape[-1], delta=delta, sample_rate=sample_rate)
    arguments.one_of("criterion", criterion, get_args(Criterion))
    arguments.one_of("selection", selection, get_args(Selection))
    if window_length == "auto":
        raise ValueError(
            "window_length must be samples or a duration where the record is in blocks; got 'auto'; have it chosen from a part in memory: "
            "tvident.fit_local_polynomials(part, 'auto').window_length"
        )
    length = arguments.window_length("window_length", window_length, seconds, odd=True)
    arguments.check_window("window_length", length, y.shape[-1], least=SHORTEST_WINDOW)
    every = arguments.whole_number("step", step, least=1)
    most = arguments.whole_number("max_deriv", max_deriv, least=0, most=HIGHEST_ORDER)
    arguments.check_power("max_deriv", most, seconds)
    fixed: dict[str, Any] = {
        "order": None if order is None else arguments.whole_number("order", order, least=0, most=HIGHEST_ORDER),
        "max_order": arguments.whole_number("max_order", max_order, least=0, most=HIGHEST_ORDER),
        "criterion": criterion,
        "selection": selection,
        "derivatives": tuple(range(most + 1)),
        "delta": seconds,
        "noise": True,
    }
    plan(length, **fixed)  # what is impossible is refused at once
    arguments.one_of("nan_policy", nan_policy, get_args(arguments.RowPolicy))
    weighted = weights is not None
    gaps = gaps_given(nan_policy, max_gap, min_observations, weighted=weighted, length=length, period=seconds)
    if weighted:
        check_weighted(automatic=False, weighted=True, selection=selection)
        weights = weights_of(weights, y.shape)
    samples, batch = y.shape[-1], y.shape[:-1]
    records = [y[place] for place in np.ndindex(*batch)]
    if quantisation is None:
        step_of_rounding = dask.delayed(min)([rounding(one) for one in records])
    else:
        step_of_rounding = quantisation_step(np.zeros(1), quantisation)
    asked = AskedOfBlocks(length, fixed, every, gaps, nan_policy == "raise")
    work, errors = dask.delayed(_block, pure=True), dask.delayed(_errors, pure=True)
    each = []
    for place, record in zip(np.ndindex(*batch), records, strict=True):
        found = blocks(record.chunks[-1], asked.reach)
        counts = [rows(block, every) for block in found]
        parts, stderr = [], []
        for block in found:
            held = max(block[0] - asked.reach, 0), min(block[1] + asked.reach, samples)
            weight = None if weights is None else weights[place][slice(*held)]
            given = record[slice(*held)], weight, (block, held, samples), asked, step_of_rounding
            parts.append(work(*given))
            stderr.append(errors(*given))
        one = {
            name: joined([part[name] for part in parts], counts, kind, lead)
            for name, (kind, lead) in {
                "derivatives": (float, (most + 1,)),
                "order": (np.uint8, ()),
                "sigma": (float, ()),
                "status": (np.uint16, ()),
            }.items()
        }
        each.append({**one, "stderr": joined(stderr, counts, float, (most + 1,))})
    together = {
        name: stacked([one[name] for one in each], batch, int(name in {"derivatives", "stderr"})) for name in each[0]
    }
    return DaskPolynomialFit(**together, window_length=length)


def rounding(record: Any) -> Any:
    """Return, delayed, the step to which the samples of a record were rounded."""
    dask, array = imported()
    spans = _core.parts_of_quantisation(record.shape[-1])
    looked_at = array.concatenate([record[slice(*span)] for span in spans])
    return dask.delayed(_rounding)(looked_at, spans, record.shape[-1])


def _rounding(samples: Any, spans: list[Span], of: int) -> float:
    return _core.quantisation_step(samples, parts=spans, of=of)


@dataclass(frozen=True)
class AskedOfBlocks:
    """What is done with every block.

    Parameters
    ----------
    length : int
        Samples in a window.
    fixed : Mapping
        What else its tables depend on.
    step : int
    gaps : Incomplete or None
        What is left out, before there are weights.
    raises : bool
        Whether nothing may be missing.
    """

    length: int
    fixed: Mapping[str, Any]
    step: int
    gaps: Incomplete | None
    raises: bool

    @property
    def reach(self) -> int:
        """Samples on either side of a block that have a part in its estimates."""
        beside_gaps = 0 if self.gaps is None else self.length + self.gaps.longest_gap
        return max(_REACH * self.length, beside_gaps)

    def plan(self, quantisation: float) -> _core.LocalPolynomials:
        """Return the tables for samples that were rounded to a step."""
        return plan(self.length, **self.fixed, quantisation=quantisation)


def _block(samples: Any, weights: Any, part: Part, asked: AskedOfBlocks, quantisation: float) -> dict[str, Any]:
    """Return the estimates of one block, on one thread: dask has others."""
    first, end = part[0]
    samples = np.ascontiguousarray(samples)
    core_plan, gaps = asked.plan(quantisation), _gaps(asked, weights)
    whole = samples if gaps is None else gaps.plain(samples)
    if asked.raises and not np.isfinite(whole[first - part[1][0] : end - part[1][0]]).all():
        raise ValueError(f"samples {first} to {end} must be finite; some are not; use nan_policy='omit' or 'propagate'")
    found = core_plan.estimate(whole, step=asked.step, part=part, workers=1)
    if gaps is not None:
        # Into the arrays of the estimates.
        filled(core_plan, found, samples, gaps, step=asked.step, workers=1, part=part)
    return {
        "derivatives": found.derivatives,
        "order": found.order,
        "sigma": found.sigma,
        "status": found.status,
    }


def _errors(samples: Any, weights: Any, part: Part, asked: AskedOfBlocks, quantisation: float) -> Any:
    """Return their standard errors."""
    samples = np.ascontiguousarray(samples)
    core_plan, gaps = asked.plan(quantisation), _gaps(asked, weights)
    if gaps is None:
        return core_plan.errors(samples, step=asked.step, part=part, workers=1)
    found = core_plan.estimate(gaps.plain(samples), step=asked.step, part=part, workers=1)
    return filled(core_plan, found, samples, gaps, step=asked.step, workers=1, part=part).errors()


def _gaps(asked: AskedOfBlocks, weights: Any) -> Incomplete | None:
    """Return what is left out of one block."""
    if asked.gaps is None or weights is None:
        return asked.gaps
    return replace(asked.gaps, weights=arguments.some_weights("weights", weights, weights.shape))
