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
"""Rows that are less than this part of the duration beyond a window's border lie on it, and those that rounding of times moves there."""

_DOUBLE = np.dtype(np.float64)


@dataclass(frozen=True)
class Spans:
    """The windows of all rows.

    Parameters
    ----------
    rows : RowSpans
        Which rows they hold.
    near, flags : ndarray
        Windows that reach beyond the record. EDGE where less than its duration lies within, INVALID where less than half does.
    at_least : int or None
        How many rows they must hold.
    """

    rows: _core.RowSpans
    near: npt.NDArray[np.uintp]
    flags: npt.NDArray[np.uint16]
    at_least: int | None

    @property
    def most(self) -> int:
        """Rows in the fullest window."""
        return self.rows.most_and_fewest()[0]


def irregular_times(asked: AskedWindows, rows: int) -> _core.RowTimes | None:
    """Return times in seconds where a duration was asked for on times that are not uniform; None otherwise.

    Raises
    ------
    ValueError
        If times do not increase from row to row.
    """
    if asked.t is None or not isinstance(asked.window_length, str):
        return None
    is_alone = asked.delta is None and asked.sample_rate is None
    # Most times tell at once.
    at_once = arguments.irregular_at_sight(asked.t, rows) if is_alone else None
    if at_once is not None:
        return at_once
    try:
        asked.period(rows)
    except ValueError:
        times = np.ravel(np.asarray(arguments.times_of(times_in_seconds(asked.t)), dtype=np.float64))
        if times.size != rows or not np.isfinite(times).all():
            raise
        arguments.check_no_counts(times)
        late = np.flatnonzero(np.diff(times) <= 0)
        if late.size:
            place = int(late[0]) + 1
            raise ValueError(
                f"t must increase from row to row; t[{place}] is {times[place]:.9g} after {times[place - 1]:.9g}; sort the rows by time, "
                "and keep one of each time"
            ) from None
        seen = _core.RowTimes(times)
        if not seen.increase():
            raise
        return seen
    return None


def spans_given(asked: AskedWindows, times: _core.RowTimes, regressors: int) -> Spans:
    """Return which rows lie in the window of every row."""
    duration, length = arguments.seconds("window_length", str(asked.window_length)), times.length()
    if asked.half_life is not None:
        raise ValueError(
            f"half_life must go with uniform times; got {asked.half_life!r} with {_steps_of(times)}; resample the rows, or leave it out"
        )
    if not duration <= length:
        raise ValueError(
            f"window_length must be at most the time of the record, {length:.6g} s; got {asked.window_length!r}; shorten it"
        )
    alignment = arguments.one_of("alignment", asked.alignment, ("centre", "trailing", "leading"))
    # A window holds its own row, and no neighbour for the sake of rounding.
    rounding = min(_rounding(asked.t, times), times.steps()[0] / 2, duration / 2)
    slack = max(_SAME * duration, rounding)
    # Full windows of uniform times hold as many rows wherever they are aligned: one border belongs to them.
    begin = {"centre": -duration / 2 - slack, "trailing": -duration + slack, "leading": -slack}[alignment]
    rows = _core.RowSpans(times, begin, duration)
    most = rows.most_and_fewest()[0]
    if most <= regressors:
        raise ValueError(
            f"window_length must hold more rows than the {regressors} regressors; got {asked.window_length!r}, and {most} rows in the "
            "fullest window; lengthen it"
        )
    near, within = rows.near_ends(times.usual_step() / 2 + slack)
    full = duration * (1 - _SAME) - slack
    flags = np.where(within < full, np.uint16(Status.EDGE), np.uint16(0))
    at_least = None
    if asked.min_observations is not None:
        at_least = arguments.whole_number("min_observations", asked.min_observations)
        if not regressors < at_least <= most:
            raise ValueError(
                f"min_observations must be more than the {regressors} regressors and at most the {most} rows of the fullest window; "
                f"got {at_least}; use {regressors + 1} to {most}"
            )
    else:
        flags = np.where(2 * within < full - slack, flags | np.uint16(Status.INVALID), flags)
    return Spans(rows, near, flags.astype(np.uint16), at_least)


def _rounding(t: npt.ArrayLike | None, times: _core.RowTimes) -> float:
    """Return how far times may be rounded, in the type that they were given in."""
    kind = getattr(t, "dtype", _DOUBLE)
    is_coarser = isinstance(kind, np.dtype) and kind.kind == "f" and kind.itemsize < _DOUBLE.itemsize
    return arguments.rounding(kind if is_coarser else _DOUBLE) * times.largest()


def _steps_of(times: _core.RowTimes) -> str:
    """Return words for steps that differ."""
    shortest, longest = times.steps()
    return f"steps of {shortest:.3g} to {longest:.3g} s"


def check_uniform(times: _core.RowTimes, *, is_correlated: bool, is_robust: bool) -> None:
    """Check that nothing is asked for that needs uniform times."""
    for name, wrong, is_wrong in (("covariance", "'hac'", is_correlated), ("loss", "'huber'", is_robust)):
        if is_wrong:
            raise ValueError(
                f"{name}={wrong} must go with uniform times; got {_steps_of(times)}; resample the rows, or leave out {name}"
            )


def solved(
    spans: Spans,
    regressors: npt.NDArray[np.number],
    columns: npt.NDArray[np.number],
    weights: Array | None,
    solve: Callable[..., _core.RollingRegressions],
) -> _core.RollingRegressions:
    """Solve every window; `solve` is the core's function with all that does not depend on windows."""
    p = regressors.shape[1]
    found = solve(
        regressors.T,
        columns.T,
        {"rows": spans.most, "alignment": "leading", "at_least": spans.at_least, "half_life": None},
        weights=weights,
        spans=spans.rows,
    )
    status = found.status
    status[spans.near] |= spans.flags
    few = spans.rows.fewer_than(p + 1 if spans.at_least is None else spans.at_least)
    code = Status.INVALID if spans.at_least is not None else Status.INVALID | Status.RANK_DEFICIENT
    status[few] = status[few] & np.uint16(Status.EDGE | Status.GAP) | np.uint16(code)
    invalid = spans.flags & Status.INVALID != 0
    status[spans.near[invalid]] = spans.flags[invalid]
    out = np.union1d(few, spans.near[invalid])
    if out.size:
        for values in (found.params, found.stderr, found.residuals, found.rss, found.rsquared, found.condition):
            values[..., out] = np.nan
    return found
