"""Windows of a duration on irregular times: each holds other rows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._regression.windows import AskedWindows
from tvident._status import Status
from tvident._units import times_in_seconds

Array = npt.NDArray[np.float64]

_SAME = 1e-9
"""Rows that are less than this part of the duration beyond a window's border lie on it: rounding of times decides nothing."""


@dataclass(frozen=True)
class Spans:
    """Rows of the window of every row.

    Parameters
    ----------
    first, end : ndarray, shape (n,)
        The first row, and the one after the last.
    flags : ndarray of uint16, shape (n,)
        EDGE where a window reaches beyond the record, INVALID where less than half of it lies within.
    """

    first: npt.NDArray[np.uintp]
    end: npt.NDArray[np.uintp]
    flags: npt.NDArray[np.uint16]
    at_least: int | None

    @property
    def count(self) -> npt.NDArray[np.uintp]:
        """How many rows each window holds."""
        return self.end - self.first


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
        # From the first row on: seconds since 1970 have no digits left for what a border is told by.
        since: Array = times - times[0]
        return since
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
    first, end = _core.rows_within(times, begins, duration)
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
    return Spans(first, end, flags.astype(np.uint16), at_least)


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
    solve: Callable[..., _core.RollingRegressions],
) -> _core.RollingRegressions:
    """Solve every window; `solve` is the core's function with all that does not depend on windows."""
    p, count = regressors.shape[1], spans.count
    found = solve(
        regressors.T,
        columns.T,
        {"rows": max(p + 1, int(count.max())), "alignment": "leading", "at_least": spans.at_least, "half_life": None},
        weights=weights,
        spans=(spans.first, spans.end),
    )
    status = found.status
    status |= spans.flags
    least = p + 1 if spans.at_least is None else spans.at_least
    out = np.flatnonzero((spans.flags & Status.INVALID != 0) | (count < least))
    few = Status.INVALID if spans.at_least is not None else Status.INVALID | Status.RANK_DEFICIENT
    invalid = spans.flags[out] & Status.INVALID != 0
    status[out] = spans.flags[out] | np.where(invalid, np.uint16(Status.INVALID), np.uint16(few))
    for values in (found.params, found.stderr, found.residuals, found.rss, found.rsquared, found.condition):
        values[..., out] = np.nan
    return found
