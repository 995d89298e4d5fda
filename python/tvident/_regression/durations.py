"""Windows of a duration on irregular times: each holds other rows, and those that hold as many are solved together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._regression.windows import AskedWindows
from tvident._status import Status
from tvident._units import times_in_seconds

Array = npt.NDArray[np.float64]

_SAME = 1e-9
"""Rows that are less than this part of the duration beyond a window's border lie on it: rounding of times decides nothing."""

_CHUNK = 1 << 14
"""Rows whose windows are solved together, about: where the density of rows drifts they hold few different numbers of rows."""


@dataclass
class FoundInWindows:
    """Results of all windows, as the core has them."""

    params: Array
    stderr: Array
    residuals: Array
    rss: Array
    rsquared: Array
    condition: Array
    status: npt.NDArray[np.uint16]
    lags: int = 0


@dataclass(frozen=True)
class Spans:
    """Rows of the window of every row.

    Parameters
    ----------
    first, count : ndarray, shape (n,)
    flags : ndarray of uint16, shape (n,)
        EDGE where a window reaches beyond the record, INVALID where less than half of it lies within.
    """

    first: npt.NDArray[np.intp]
    count: npt.NDArray[np.intp]
    flags: npt.NDArray[np.uint16]
    at_least: int | None


def irregular_times(asked: AskedWindows, rows: int) -> Array | None:
    """Return times in seconds where a duration was asked for on times that are not uniform; None otherwise.

    Raises
    ------
    ValueError
        If times do not increase from row to row.
    """
    if asked.t is None or not isinstance(asked.window_length, str):
        return None
    try:
        asked.period(rows)
    except ValueError:
        times = np.ravel(np.asarray(arguments.times_of(times_in_seconds(asked.t)), dtype=np.float64))
        if times.size != rows or not np.isfinite(times).all():
            raise
        late = np.flatnonzero(np.diff(times) <= 0)
        if late.size:
            place = int(late[0]) + 1
            raise ValueError(
                f"t must increase from row to row; t[{place}] is {times[place]:.9g} after {times[place - 1]:.9g}; sort the rows by time, "
                "and keep one of each time"
            ) from None
        return times
    return None


def spans_given(asked: AskedWindows, times: Array, regressors: int) -> Spans:
    """Return which rows lie in the window of every row."""
    duration = arguments.seconds("window_length", str(asked.window_length))
    if asked.half_life is not None:
        raise ValueError(
            f"half_life must go with uniform times; got {asked.half_life!r} with steps of {np.diff(times).min():.3g} to "
            f"{np.diff(times).max():.3g} s; resample the rows, or leave it out"
        )
    if not duration <= times[-1] - times[0]:
        raise ValueError(
            f"window_length must be at most the time of the record, {times[-1] - times[0]:.6g} s; got {asked.window_length!r}; shorten it"
        )
    alignment = arguments.one_of("alignment", asked.alignment, ("centre", "trailing", "leading"))
    slack = _SAME * duration
    # Full windows of uniform times hold as many rows wherever they are aligned: one border belongs to them.
    begins = times + {"centre": -duration / 2 - slack, "trailing": -duration + slack, "leading": -slack}[alignment]
    first, end = np.searchsorted(times, begins), np.searchsorted(times, begins + duration)
    half = float(np.median(np.diff(times))) / 2
    within = np.minimum(begins + duration, times[-1] + half + slack) - np.maximum(begins, times[0] - half - slack)
    flags = np.where(within < duration * (1 - _SAME) - slack, np.uint16(Status.EDGE), np.uint16(0))
    at_least = None
    if asked.min_observations is not None:
        most = int((end - first).max())
        at_least = arguments.whole_number("min_observations", asked.min_observations)
        if not regressors < at_least <= most:
            raise ValueError(
                f"min_observations must be more than the {regressors} regressors and at most the {most} rows of the fullest window; "
                f"got {at_least}; use {regressors + 1} to {most}"
            )
    else:
        flags = np.where(2 * within < duration * (1 - _SAME), flags | np.uint16(Status.INVALID), flags)
    return Spans(first, end - first, flags.astype(np.uint16), at_least)


def check_uniform(times: Array, *, is_correlated: bool, is_robust: bool) -> None:
    """Check that nothing is asked for that needs uniform times."""
    for name, wrong, is_wrong in (("covariance", "'hac'", is_correlated), ("loss", "'huber'", is_robust)):
        if is_wrong:
            raise ValueError(
                f"{name}={wrong} must go with uniform times; got steps of {np.diff(times).min():.3g} to {np.diff(times).max():.3g} s; "
                f"resample the rows, or leave out {name}"
            )


def solved(
    spans: Spans,
    regressors: npt.NDArray[np.number],
    columns: npt.NDArray[np.number],
    weights: Array | None,
    solve: Callable[..., Any],
) -> FoundInWindows:
    """Solve every window; `solve` is the core's function with all that does not depend on windows."""
    (rows, p), q = regressors.shape, columns.shape[1]
    one, of_sides = np.full((p, q, rows), np.nan), np.full((q, rows), np.nan)
    found = FoundInWindows(
        params=one,
        stderr=one.copy(),
        residuals=of_sides,
        rss=of_sides.copy(),
        rsquared=of_sides.copy(),
        condition=np.full(rows, np.nan),
        status=spans.flags.copy(),
    )
    least = p + 1 if spans.at_least is None else spans.at_least
    there = (spans.flags & Status.INVALID == 0) & (spans.count >= least)
    few = Status.INVALID if spans.at_least is not None else Status.INVALID | Status.RANK_DEFICIENT
    invalid = spans.flags & Status.INVALID != 0
    found.status[~there] |= np.where(invalid, Status.INVALID, few)[~there].astype(np.uint16)
    size = max(_CHUNK, 8 * int(spans.count.max()))
    for begin in range(0, rows, size):
        chunk = np.arange(begin, min(rows, begin + size))
        chunk = chunk[there[chunk]]
        for count in np.unique(spans.count[chunk]).tolist():
            of = chunk[spans.count[chunk] == count]
            low, high = int(spans.first[of[0]]), int(spans.first[of[-1]]) + count
            part = solve(
                regressors[low:high].T,
                columns[low:high].T,
                {"rows": count, "alignment": "leading", "at_least": spans.at_least, "half_life": None},
                weights=None if weights is None else weights[low:high],
            )
            at = spans.first[of] - low
            for name in ("params", "stderr", "rss", "rsquared", "condition"):
                getattr(found, name)[..., of] = getattr(part, name)[..., at]
            found.status[of] |= part.status[at]
    used = np.ones(rows, bool) if weights is None else weights > 0
    finite = np.isfinite(regressors).all(axis=1)
    with np.errstate(all="ignore"):
        predicted = np.einsum("np,pqn->qn", np.where(finite[:, None], regressors, np.nan), found.params)
        found.residuals[:] = np.where(used, columns.T - predicted, np.nan)
    found.residuals[~np.isfinite(found.residuals)] = np.nan
    return found
