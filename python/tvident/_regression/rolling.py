"""Least squares in every window of rows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._huber import pseudo_values
from tvident._regression.durations import check_uniform, irregular_times, solved, spans_given
from tvident._regression.windows import (
    Alignment,
    AskedWindows,
    RegressionWindows,
    lags_given,
    unit_of_weights,
    windows_given,
)

MOST_REGRESSORS = 16
"""No problem may have more regressors than this."""

_LOOKED_AT = 64
"""Values of a regressor that show whether it may be a constant; only then all of them are looked at."""


_SHOWN = 6
"""Parameters that a line of words shows."""


@dataclass(frozen=True, eq=False)
class RollingRegression:
    """The result of :func:`rolling_least_squares`; NaN where the status says INVALID.

    Attributes
    ----------
    params : ndarray of float64, shape (n, p) or (n, p, q)
        Parameters of the window of each row, in the unit of ``b`` over that of the regressor.
    stderr : ndarray of float64, same shape
        Their standard errors, for residuals that are independent and of one variance, or correlated with ``covariance="hac"``.
    residuals : ndarray of float64, shape (n,) or (n, q)
        What the window of each row leaves at that row, ``b[i] - A[i] @ params[i]``, in the unit of ``b``. NaN also at rows that are not
        used.
    rss : ndarray of float64, shape (n,) or (n, q)
        Residual sum of squares.
    rsquared : ndarray of float64, shape (n,) or (n, q)
        The part of the squares of ``b`` in the window that is explained, 0 to 1: of squares around the mean where a column of ``A`` is a
        constant in the whole record, around zero otherwise. Weights count in both.
    condition : ndarray of float64, shape (n,)
        Condition number of the regressors in the window, each scaled to the same norm: √p·‖S⁻¹‖ in the Frobenius norm.
    status : ndarray of uint16, shape (n,)
        Flags of :class:`tvident.Status`.
    lags : int or None
        With ``covariance="hac"``: over how many rows residuals are taken to be correlated.

    See Also
    --------
    rolling_least_squares : returns it.
    Status : what the flags mean.

    References
    ----------
    W. M. Gentleman: Least squares computations by Givens transformations without square roots, Journal of the Institute of Mathematics and
    its Applications 12 (1973).

    Examples
    --------
    >>> import numpy as np
    >>> from tvident import Status, rolling_least_squares
    >>> regression = rolling_least_squares(np.ones(100), np.arange(100.0), 11)
    >>> float(np.round(regression.params[50, 0], 6)), float(np.round(regression.rss[50], 6))
    (50.0, 110.0)
    >>> Status(int(regression.status[2]))
    <Status.EDGE: 2>
    """

    params: npt.NDArray[np.float64]
    stderr: npt.NDArray[np.float64]
    residuals: npt.NDArray[np.float64]
    rss: npt.NDArray[np.float64]
    rsquared: npt.NDArray[np.float64]
    condition: npt.NDArray[np.float64]
    status: npt.NDArray[np.uint16]
    lags: int | None = None

    def __repr__(self) -> str:
        good = np.isfinite(self.params).reshape(len(self.params), -1).all(axis=1)
        medians = np.median(self.params[good].reshape(int(good.sum()), -1), axis=0) if good.any() else np.empty(0)
        shown = [f"{one:.4g}" for one in medians[:_SHOWN]] + ["…"] * (len(medians) > _SHOWN)
        found = f", medians of params {', '.join(shown)}" if shown else ""
        return f"<RollingRegression of {good.size} rows, {good.sum()} with a window{found}>"


# All but the data are options, as users call it.
@arguments.called_as("rolling_least_squares(A, b, 200)")
def rolling_least_squares(
    A: npt.ArrayLike,
    b: npt.ArrayLike,
    window_length: int | str,
    *,
    alignment: Alignment = "centre",
    weights: npt.ArrayLike | None = None,
    half_life: float | str | None = None,
    min_observations: int | None = None,
    covariance: Literal["classic", "hac"] = "classic",
    lags: int | None = None,
    sample_rate: float | None = None,
    delta: float | None = None,
    t: npt.ArrayLike | None = None,
    loss: Literal["squares", "huber"] = "squares",
    step: int = 1,
    workers: int | None = None,
    progress: arguments.Progress = None,
) -> RollingRegression:
    r"""Solve ``A x ≈ b`` by least squares in a window around every row, or before or after it.

    Rows are only appended to factors, and factors merged; no row is ever subtracted, so an outlier leaves with its row, and no digits are
    lost however long the record is.

    Parameters
    ----------
    A : array_like, shape (n, p)
        Regressors, at most 16; a single one may be given as shape (n,). Masked values are missing, as NaN is.
    b : array_like, shape (n,) or (n, q)
        Right-hand sides.
    window_length : int or str
        Rows in a window, w, more than ``p``; or, where the time is given, a duration such as ``"2 s"``.
    alignment : {"centre", "trailing", "leading"}, optional
        Which rows the window of row ``i`` has: ``i - w//2 … i - w//2 + w - 1``, ``i - w + 1 … i`` (nothing of the future), or
        ``i … i + w - 1``. The numbers of a full window are the same, at another row.
    weights : array_like, shape (n,), optional
        Weight of every row, not negative: one over the variance of its noise, relative to the others. Rows of weight 0 are not used,
        whatever they hold, and a masked weight is 0. Weights of 1 change nothing, and a factor of all weights changes ``rss`` alone.
    half_life : float or str, optional
        Rows, or a duration, after which a row counts half as much, within the window: for the window of row ``i`` row ``k``
        has the weight ``2**(-|i - k| / half_life)``. It says nothing of noise: standard errors are those of residuals with one variance
        (times that of ``weights``). With alignment "trailing" or "leading".
    min_observations : int, optional
        Rows that a window must hold, more than ``p``. If it is given, rows with a missing value are left out, and windows near the ends or
        beside missing rows are solved as long as so many rows are left (status EDGE and GAP). By default windows must hold half of their
        rows near the ends, and a missing value makes all windows NaN that hold it.
    covariance : {"classic", "hac"}, optional
        ``"hac"``: standard errors know of residuals that are correlated from row to row and of changing variance (Newey and West), as those
        of overlapping or smoothed samples are; see Notes.
    lags : int, optional
        With ``covariance="hac"``: residuals farther apart than so many rows are independent. By default as the correlation of the
        record's residuals asks for, at most a quarter of the window.
    sample_rate, delta : float, optional
        Rows in a second, or seconds from row to row. One of these or ``t`` gives durations their meaning; numbers do not depend on it.
    t : array_like, shape (n,), optional
        Times of the rows, s, or dates. They give durations their meaning. Where they are not uniform, a window holds the rows within the
        duration, as many as there are. A row that rounding of times moves off a border lies on it.
    loss : {"squares", "huber"}, optional
        ``"huber"``: residuals beyond 1.345 standard deviations (found from medians of blocks as long as windows) count linearly, so that
        spikes in ``b`` move parameters by little, however large they are. Spikes in ``A`` are no residuals: make them NaN.
    step : int, optional
        Every how many rows a result is wanted.
    workers : int, optional
        Threads; by default ``TVIDENT_WORKERS`` or all processors that this process may use. The numbers do not depend on it.
    progress : bool or callable, optional
        Show a bar, or call a function with the rows done and all of them.

    Returns
    -------
    RollingRegression
        ``params``, ``stderr``, ``residuals``, ``rss``, ``rsquared``, ``condition`` and ``status``. Near the ends windows hold fewer rows
        (status EDGE). Windows with too few rows, a value that is no finite number, or dependent regressors are NaN.

    Raises
    ------
    ValueError
        If lengths differ, the window is not longer than the number of regressors or longer than the record, there are too many
        regressors, a weight is negative or no finite number, ``min_observations`` is not between ``p + 1`` and the window, ``half_life``
        leaves the weight of no more rows than ``p``, ``lags`` is not less than half of the window, ``t`` does not increase, or options
        exclude each other: ``half_life`` goes neither with "huber" nor with "hac", "hac" not with "huber", and none of them with times
        that are not uniform.
    TypeError
        If an array is complex or holds no numbers, or more than one of ``sample_rate``, ``delta`` and ``t`` is given.

    Notes
    -----
    Equations (3) and (4) of the paper are of this kind. Factors are updated by rotations without square roots. The cost for three
    regressors is some 30 ns a row and thread, whatever the window; it grows with the square of their number. With weights
    :math:`\sum w_i (b_i - A_i x)^2` is least, which is ``rss``, and rows of weight 0 do not count as rows.

    With a half-life, f the weights by age and w those of noise, :math:`\sum f_i w_i (b_i - A_i x)^2` is least. With :math:`N = \sum f w
    A^\top A` and :math:`M = \sum f^2 w A^\top A` the covariance of the parameters is :math:`\sigma^2 N^{-1} M N^{-1}`, and
    :math:`\sigma^2` is rss over :math:`\sum f - \mathrm{tr}\, N^{-1} M`. Every block of rows begins anew, so nothing drifts, however long
    the record is.

    With ``covariance="hac"`` the covariance is :math:`N^{-1} S N^{-1}`, where S sums :math:`A_i e_i e_k A_k^\\top (1 - |i - k| / B)` over
    rows less than B = ``lags`` + 1 apart, as sums over B neighbouring rows and then over the window: the cost does not grow with it. The
    residual e of a row is what the window around that row leaves there. What fits take of residuals is given back (a part
    :math:`(B + p - 1) / w`). By default B is Andrews', from the correlation of neighbours in the whole record, at the regressor that is
    correlated most, and what Bartlett's weights keep of such a process is known and the rest given back; with given ``lags`` it is not.
    Errors are then themselves uncertain by some :math:`\\sqrt{B / w}`. Windows too short for them have no standard error (NaN). The work
    is done at every row whatever ``step``.

    With ``loss="huber"`` residuals are clipped and least squares repeated until nothing changes, some 8 to 20 times. In the end clipped
    residuals are divided by the part of them that is not clipped: ``rss`` is the sum of their squares, standard errors follow from it,
    and ``rsquared`` is of what is left of ``b``. They are found with windows around every row, whatever the alignment.

    See Also
    --------
    identify : the same with the rows made from an angle and a torque.

    References
    ----------
    W. M. Gentleman: Least squares computations by Givens transformations without square roots, Journal of the Institute of Mathematics
    and its Applications 12 (1973).
    P. J. Huber: Robust statistics, Wiley 1981: the loss, the algorithm with modified residuals, the standard errors.
    W. K. Newey, K. D. West: A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix,
    Econometrica 55 (1987).
    D. W. K. Andrews: Heteroskedasticity and autocorrelation consistent covariance matrix estimation, Econometrica 59 (1991).

    Examples
    --------
    >>> import numpy as np
    >>> from tvident import rolling_least_squares
    >>> t = np.linspace(0, 1, 1000)
    >>> A = np.stack([np.sin(40 * t), np.cos(60 * t)], axis=1)
    >>> b = A @ [2.0, 3.0]
    >>> np.round(rolling_least_squares(A, b, 200).params[500], 6)
    array([2., 3.])
    """
    regressors = arguments.real_array("A", A)
    if regressors.ndim == 1:
        regressors = regressors[:, None]
    rhs = arguments.real_array("b", b)
    if regressors.ndim != 2 or rhs.ndim > 2:  # noqa: PLR2004 - a matrix has two axes
        raise ValueError(
            f"A must have shape (n, p) and b shape (n,) or (n, q); got {regressors.shape} and {rhs.shape}; reshape them"
        )
    rows, count = regressors.shape
    if rhs.shape[0] != rows:
        raise ValueError(
            f"A and b must have as many rows as each other; got {rows} and {rhs.shape[0]}; "
            f"{'pass A.T, a column for each regressor' if count == rhs.shape[0] else 'cut one of them'}"
        )
    if count > MOST_REGRESSORS:
        raise ValueError(f"A must have at most {MOST_REGRESSORS} columns; got {count}; drop or combine some")
    is_robust = arguments.one_of("loss", loss, ("squares", "huber")) == "huber"
    is_correlated = arguments.one_of("covariance", covariance, ("classic", "hac")) == "hac"
    asked = AskedWindows(window_length, alignment, half_life, min_observations, t, delta, sample_rate)
    times = irregular_times(asked, rows)
    if times is not None:
        spans = spans_given(asked, times, count)
        check_uniform(times, is_correlated=is_correlated, is_robust=is_robust)
        # Of what follows only what does not depend on the number of rows is used.
        asked = replace(asked, window_length=spans.most, t=None, min_observations=None)
    windows = windows_given(asked, rows, count)
    lag = lags_given(lags, windows, is_correlated=is_correlated, is_robust=is_robust)
    every = arguments.whole_number("step", step, least=1)
    weight = arguments.weights("weights", weights, (rows,))
    unit = 1.0 if weight is None else unit_of_weights(weight)
    with np.errstate(under="ignore"):
        relative = None if weight is None else weight / unit
    given: npt.NDArray[np.number] = rhs.reshape(rows, -1)
    columns = given
    threads = arguments.worker_count(workers)
    if is_robust:
        columns = _with_clipped_residuals(regressors, columns, relative, windows, threads)
    # Every row's residual is needed.
    stride = 1 if is_correlated or times is not None else every
    solve = partial(_core.rolling_least_squares, constant=_constant(regressors, relative), workers=threads)
    with arguments.reporter(progress, "least squares") as report:
        if times is not None:
            found = solved(spans, regressors, columns, relative, partial(solve, progress=report))
        else:
            found = solve(
                regressors.T,
                columns.T,
                windows.told(),
                weights=relative,
                correlated=is_correlated,
                lags=lag,
                step=stride,
                progress=report,
            )
    residuals = found.residuals
    if is_robust:
        with np.errstate(invalid="ignore"):  # infinite right-hand sides are no rows
            residuals = residuals + np.asarray(given - columns, dtype=np.float64)[::stride].T
    with np.errstate(over="ignore"):
        rss = found.rss if weight is None else found.rss * unit

    def some(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return what is wanted, windows first."""
        wanted = values if stride == every else values[..., ::every].copy()
        wanted = wanted[..., 0, :] if rhs.ndim == 1 and values.ndim > 1 else wanted
        return np.moveaxis(wanted, -1, 0)

    return RollingRegression(
        params=some(found.params),
        stderr=some(found.stderr),
        residuals=some(residuals),
        rss=some(rss),
        rsquared=some(found.rsquared),
        condition=some(found.condition),
        status=found.status if stride == every else found.status[::every].copy(),
        lags=found.lags if is_correlated else None,
    )


def _with_clipped_residuals(
    regressors: npt.NDArray[np.number],
    columns: npt.NDArray[np.number],
    weight: npt.NDArray[np.float64] | None,
    windows: RegressionWindows,
    workers: int | None,
) -> npt.NDArray[np.float64]:
    """Return right-hand sides whose least squares are those of Huber's loss."""
    rows, count = regressors.shape
    root = np.ones((rows, 1)) if weight is None else np.sqrt(weight)[:, None]
    is_used = root[:, 0] > 0
    safe = np.where(root > 0, root, 1.0)
    centred = windows.around_rows().told()

    def predicted(weighted: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        found = _core.rolling_least_squares(regressors.T, (weighted / safe).T, centred, weights=weight, workers=workers)
        return np.asarray(weighted - root * found.residuals.T)

    weighted = np.where(root > 0, np.asarray(columns, dtype=np.float64), 0.0) * root
    return pseudo_values(predicted, weighted, is_used, windows.rows, count) / safe


def _constant(regressors: npt.NDArray[np.number], weight: npt.NDArray[np.float64] | None) -> int | None:
    """Return which regressor is a constant in all rows that are used; None if none is."""
    used = slice(None) if weight is None else weight > 0
    for column, values in enumerate(regressors.T):
        every = max(1, values.size // _LOOKED_AT)
        some = values[::every] if weight is None else values[::every][weight[::every] > 0]
        if _is_constant(some, 0) and _is_constant(values[used], 1):
            return column
    return None


def _is_constant(values: npt.NDArray[np.number], least: int) -> bool:
    """Return whether values are the same number, but zero, as far as they are numbers, and at least so many are."""
    finite = values[np.isfinite(values)]
    return finite.size >= least and (not finite.size or bool(finite[0] != 0 and finite.min() == finite.max()))
