"""Local polynomials of dask arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from tvident import _arguments as arguments
from tvident import _core
from tvident._choices import Criterion, Selection
from tvident._dask.blocks import blocks, imported, joined, rows, samples_of, stacked
from tvident._derivatives import HIGHEST_ORDER, SHORTEST_WINDOW, plan, quantisation_step
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
    delta, sample_rate, max_order, order, criterion, selection, max_deriv, step, quantisation : optional
        As in :func:`tvident.fit_local_polynomials`.

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
    a sample in the whole record alone, so the chunks of an array do not change the bits. A block reads three windows of its neighbours.
    The cost is that of the call in memory, and some milliseconds a task.

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
    samples, batch = y.shape[-1], y.shape[:-1]
    records = [y[place] for place in np.ndindex(*batch)]
    if quantisation is None:
        step_of_rounding = dask.delayed(min)([rounding(one) for one in records])
    else:
        step_of_rounding = quantisation_step(np.zeros(1), quantisation)
    work, errors = dask.delayed(_block, pure=True), dask.delayed(_errors, pure=True)
    each = []
    for record in records:
        found = blocks(record.chunks[-1], _REACH * length)
        counts = [rows(block, every) for block in found]
        parts, stderr = [], []
        for block in found:
            held = max(block[0] - _REACH * length, 0), min(block[1] + _REACH * length, samples)
            asked = record[slice(*held)], (block, held, samples), every, (length, fixed), step_of_rounding
            parts.append(work(*asked))
            stderr.append(errors(*asked))
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


Asked = tuple[Span, Span, int]
"""The samples that are wanted, those that are held, and how many the record has."""


def _block(
    samples: Any, part: Asked, step: int, tables: tuple[int, Mapping[str, Any]], quantisation: float
) -> dict[str, Any]:
    """Return the estimates of one block, on one thread: dask has others."""
    length, fixed = tables
    core_plan = plan(length, **fixed, quantisation=quantisation)
    found = core_plan.estimate(np.ascontiguousarray(samples), step=step, part=part, workers=1)
    return {
        "derivatives": found.derivatives,
        "order": found.order,
        "sigma": found.sigma,
        "status": found.status,
    }


def _errors(samples: Any, part: Asked, step: int, tables: tuple[int, Mapping[str, Any]], quantisation: float) -> Any:
    """Return their standard errors."""
    length, fixed = tables
    core_plan = plan(length, **fixed, quantisation=quantisation)
    return core_plan.errors(np.ascontiguousarray(samples), step=step, part=part, workers=1)
