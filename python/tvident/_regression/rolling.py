"""Least squares in every window of rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._huber import pseudo_values
from tvident._status import Status

MOST_REGRESSORS = 16
"""No problem may have more regressors than this."""


@dataclass(frozen=True, eq=False)
class RollingRegression:
    """The result of :func:`rolling_least_squares`; NaN where the status says INVALID.

    Attributes
    ----------
    params : ndarray of float64, shape (n, p) or (n, p, q)
        Parameters of the window around each row, in the unit of ``b`` over that of the regressor.
    stderr : ndarray of float64, same shape
        Their standard errors, for residuals that are independent and of one variance.
    rss : ndarray of float64, shape (n,) or (n, q)
        Residual sum of squares.
    condition : ndarray of float64, shape (n,)
        Condition number of the regressors in the window, each scaled to the same norm: √p·‖S⁻¹‖ in the Frobenius norm.
    status : ndarray of uint16, shape (n,)
        Flags of :class:`tvident.Status`.

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
    rss: npt.NDArray[np.float64]
    condition: npt.NDArray[np.float64]
    status: npt.NDArray[np.uint16]


# All but the data are options, as users call it.
def rolling_least_squares(
    A: npt.ArrayLike,
    b: npt.ArrayLike,
    window_length: int,
    *,
    weights: npt.ArrayLike | None = None,
    loss: Literal["squares", "huber"] = "squares",
    step: int = 1,
    workers: int | None = None,
    progress: arguments.Progress = None,
) -> RollingRegression:
    r"""Solve ``A x ≈ b`` by least squares in a window around every row.

    The window around row ``i`` holds the rows ``i - w//2 … i - w//2 + w - 1``. Rows are only appended to factors, and factors
    merged; no row is ever subtracted, so an outlier leaves with its row, and no digits are lost however long the record is.

    Parameters
    ----------
    A : array_like, shape (n, p)
        Regressors, at most 16; a single one may be given as shape (n,). Masked values are missing, as NaN is.
    b : array_like, shape (n,) or (n, q)
        Right-hand sides.
    window_length : int
        Rows in a window, more than ``p``.
    weights : array_like, shape (n,), optional
        Weight of every row, not negative: one over the variance of its noise, relative to the others. Rows of weight 0 are not used,
        whatever they hold, and a masked weight is 0. Weights of 1 change nothing, and a factor of all weights changes ``rss`` alone.
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
        ``params``, ``stderr``, ``rss``, ``condition`` and ``status``. Near the ends windows hold fewer rows (status EDGE), at least half
        of them. Windows with a value that is no finite number, or whose regressors are dependent, are NaN.

    Raises
    ------
    ValueError
        If lengths differ, the window is not longer than the number of regressors or longer than the record, there are too many
        regressors, or a weight is negative or no finite number.
    TypeError
        If an array is complex or holds no numbers.

    Notes
    -----
    Equations (3) and (4) of the paper are of this kind. Factors are updated by rotations without square roots. The cost for three
    regressors is some 30 ns a row and thread, whatever the window; it grows with the square of their number. With weights
    :math:`\sum w_i (b_i - A_i x)^2` is least, which is ``rss``, and rows of weight 0 do not count as rows.

    With ``loss="huber"`` residuals are clipped and least squares repeated until nothing changes, some 8 to 20 times. In the end clipped
    residuals are divided by the part of them that is not clipped: ``rss`` is the sum of their squares, and standard errors follow from it.

    See Also
    --------
    identify : the same with the rows made from an angle and a torque.

    References
    ----------
    W. M. Gentleman: Least squares computations by Givens transformations without square roots, Journal of the Institute of Mathematics
    and its Applications 12 (1973).
    P. J. Huber: Robust statistics, Wiley 1981: the loss, the algorithm with modified residuals, the standard errors.

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
    sides = arguments.real_array("b", b)
    if regressors.ndim != 2 or sides.ndim > 2:  # noqa: PLR2004 - a matrix has two axes
        raise ValueError(
            f"A must have shape (n, p) and b shape (n,) or (n, q); got {regressors.shape} and {sides.shape}; reshape them"
        )
    rows, count = regressors.shape
    if sides.shape[0] != rows:
        raise ValueError(
            f"A and b must have as many rows as each other; got {rows} and {sides.shape[0]}; cut one of them"
        )
    if count > MOST_REGRESSORS:
        raise ValueError(f"A must have at most {MOST_REGRESSORS} columns; got {count}; drop or combine some")
    length = arguments.whole_number("window_length", window_length, least=1)
    arguments.check_window("window_length", length, rows, least=count + 1)
    every = arguments.whole_number("step", step, least=1)
    weight = arguments.weights("weights", weights, (rows,))
    if weight is not None:
        root = np.sqrt(weight / weight.max())[:, None]
        regressors, weighted = (_weighted(one, root) for one in (regressors, sides.reshape(rows, -1)))
        sides = weighted.reshape(sides.shape)
    columns: npt.NDArray[np.number] = sides.reshape(rows, -1)
    threads = arguments.worker_count(workers)
    if arguments.one_of("loss", loss, ("squares", "huber")) == "huber":
        columns = _with_clipped_residuals(regressors, columns, weight, length, threads)
    with arguments.reporter(progress, "least squares") as report:
        found = _core.rolling_least_squares(
            regressors.T, columns.T, length, step=every, workers=threads, progress=report
        )
    if sides.ndim == 1:
        params, stderr, rss = found.params[:, 0].T, found.stderr[:, 0].T, found.rss[0]
    else:
        params, stderr, rss = np.moveaxis(found.params, -1, 0), np.moveaxis(found.stderr, -1, 0), found.rss.T
    if weight is None:
        return RollingRegression(params, stderr, rss, found.condition, found.status)
    freedom, used = _used(weight > 0, length, count, every)
    status = np.where(used, found.status, found.status | np.uint16(Status.INVALID | Status.RANK_DEFICIENT))
    over = (..., None) if stderr.ndim == 2 else (..., None, None)  # noqa: PLR2004 - one right-hand side
    rest = used if rss.ndim == 1 else used[:, None]
    return RollingRegression(
        np.where(used[over], params, np.nan),
        np.where(used[over], stderr * freedom[over], np.nan),
        np.where(rest, rss * weight.max(), np.nan),
        np.where(used, found.condition, np.nan),
        status.astype(np.uint16),
    )


def _with_clipped_residuals(
    regressors: npt.NDArray[np.number],
    columns: npt.NDArray[np.number],
    weight: npt.NDArray[np.float64] | None,
    length: int,
    workers: int | None,
) -> npt.NDArray[np.float64]:
    """Return right-hand sides whose least squares are those of Huber's loss."""

    def predicted(sides: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        params = _core.rolling_least_squares(regressors.T, sides.T, length, workers=workers).params
        return np.asarray(np.einsum("np,pqn->nq", regressors, params))

    rows, count = regressors.shape
    is_used = np.ones(rows, bool) if weight is None else weight > 0
    return pseudo_values(predicted, columns.astype(np.float64), is_used, length, count)


def _weighted(columns: npt.NDArray[np.number], root: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return columns whose rows are multiplied by the roots of their weights; what has none may be anything."""
    return np.where(root > 0, np.asarray(columns, dtype=np.float64), 0.0) * root


def _used(
    is_used: npt.NDArray[np.bool_], length: int, count: int, step: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Return by how much errors grow since rows are not used, and whether more of them are than there are regressors."""
    rows = np.arange(0, is_used.size, step)
    first, end = np.maximum(rows - length // 2, 0), np.minimum(rows - length // 2 + length, is_used.size)
    before = np.concatenate([[0], np.cumsum(is_used)])
    there = before[end] - before[first]
    enough = there > count
    return np.sqrt(np.maximum(end - first - count, 1) / np.where(enough, there - count, 1)), enough
