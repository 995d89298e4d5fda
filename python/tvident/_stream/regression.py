"""Least squares in windows of rows that come piece by piece."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._identify import MOST_OF_FIRST
from tvident._regression import (
    MOST_REGRESSORS,
    Alignment,
    RegressionWindows,
    half_life_given,
    lags_given,
    least_given,
    unit_of_weights,
)
from tvident._stream.pieces import Stream, not_weighted_alike, span_of


@dataclass(frozen=True, eq=False, slots=True)
class StreamedRegression:
    """What a :class:`RollingStream` gives for some rows, each with one element of every array.

    Attributes
    ----------
    row : ndarray of int64, shape (k,)
        Numbers of the rows that the windows belong to: at their centres, or as the alignment says.
    params, stderr : ndarray of float64, shape (k, p) or (k, p, q)
    rss : ndarray of float64, shape (k,) or (k, q)
    condition : ndarray of float64, shape (k,)
    status : ndarray of uint16, shape (k,)
        As in :class:`tvident.RollingRegression`.
    """

    row: npt.NDArray[np.int64]
    params: npt.NDArray[np.float64]
    stderr: npt.NDArray[np.float64]
    rss: npt.NDArray[np.float64]
    condition: npt.NDArray[np.float64]
    status: npt.NDArray[np.uint16]

    def __repr__(self) -> str:
        return f"<StreamedRegression at {span_of(self.row, 'rows', 'row')}>"


@arguments.called_as("RollingStream(200)")
class RollingStream(Stream[StreamedRegression]):
    """Solve least squares in windows of rows as they come: :func:`rolling_least_squares`, piece by piece.

    Pieces may hold one row or millions. The numbers are those of one call with all rows, bit for bit (to rounding where a column of ``A``
    other than the first is a constant, which a call with all rows takes first), however the stream is cut; the
    window of a row is given with the row :attr:`delay` rows later. Memory does not grow with what has come.

    Parameters
    ----------
    window_length : int
        Rows in a window, more than there are regressors.
    alignment : {"centre", "trailing", "leading"}, optional
        Where in its window the row is that it belongs to, as in :func:`rolling_least_squares`. Trailing windows, which end with their row,
        are given at once.
    half_life : float, optional
        Rows after which a row weighs half, away from the one that a window belongs to, with trailing or leading windows: as in
        :func:`rolling_least_squares`. By default all rows of a window weigh the same.
    min_observations : int, optional
        Rows without a missing value that a window must hold, more than there are regressors: missing rows are left out, and the status of
        their windows says GAP. By default a missing row makes its windows NaN, and near the ends half of the rows suffice.
    covariance : {"classic", "hac"}, optional
        ``"hac"``: standard errors know of residuals that are correlated from row to row, as in :func:`rolling_least_squares`. They need the
        residuals of neighbouring windows: results come two windows later.
    lags : int, optional
        With ``covariance="hac"``, which needs it in a stream: residuals farther apart than so many rows are independent. What an earlier
        recording asked for is in ``reg.lags``.
    step : int, optional
        Every how many rows a result is wanted.

    Attributes
    ----------
    delay : int
        Rows from one to its window: the rows of a window after the one it belongs to. None of trailing windows, half a window of centred
        ones, all but one of leading ones; with ``covariance="hac"`` two windows more.
    rows : int
        Rows that have come so far.

    Raises
    ------
    ValueError
        If a length is not positive, an alignment has another name, ``min_observations`` is more than a window has, ``half_life`` goes
        with centred windows or "hac", or that has no ``lags``, or as many as half of a window.
    TypeError
        If a number is not whole.

    See Also
    --------
    rolling_least_squares : the same for a whole record.
    IdentificationStream : the same with the rows made from an angle and a torque.

    Notes
    -----
    A row that comes alone costs one merge of two factors and one solution, whatever the window; the first row after every
    `window_length` rows costs that many appends more. Many rows at a time are solved side by side, as in a batch. A stream pickles with
    the rows of at most two windows, and goes on where it was. With ``covariance="hac"`` windows are solved once every `window_length`
    rows, together with their neighbours: rows that come alone cost what they do otherwise on average, the last of each `window_length` all
    of it, and many rows at a time some six times as much. A stream keeps the rows of some seven windows.

    References
    ----------
    W. M. Gentleman: Least squares computations by Givens transformations without square roots, Journal of the Institute of Mathematics
    and its Applications 12 (1973).

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> A = np.random.default_rng(0).standard_normal((500, 2))
    >>> b = A @ [2.0, 3.0]
    >>> stream = tvident.RollingStream(50)
    >>> stream.push(A[:400], b[:400]).params.shape
    (376, 2)
    >>> stream.push(A[400], b[400]).params.round(6)
    array([[2., 3.]])

    Windows that end with the newest row, of at least 20 rows that are not missing:

    >>> stream = tvident.RollingStream(50, alignment="trailing", min_observations=20)
    >>> stream.delay
    0
    >>> b[30:40] = np.nan
    >>> stream.push(A[:100], b[:100]).params[[10, 49]].round(6)
    array([[nan, nan],
           [ 2.,  3.]])

    Rows with the weights of their noise, which come with them:

    >>> stream = tvident.RollingStream(50, alignment="trailing")
    >>> stream.push(A[100:200], b[100:200], weights=np.ones(100)).params[-1].round(6)
    array([2., 3.])
    """

    def __init__(
        self,
        window_length: int,
        *,
        alignment: Alignment = "centre",
        half_life: float | None = None,
        min_observations: int | None = None,
        covariance: Literal["classic", "hac"] = "classic",
        lags: int | None = None,
        step: int = 1,
    ) -> None:
        length = arguments.whole_number("window_length", window_length, least=1)
        where = arguments.one_of("alignment", alignment, get_args(Alignment))
        # What depends on the number of regressors is checked when that comes, with the first rows.
        least = least_given(min_observations, length, 0)
        rows = None if half_life is None else arguments.positive_number("half_life", half_life)
        self._windows = RegressionWindows(length, where, least, half_life_given(rows, 1.0, where, length, 0))
        is_correlated = arguments.one_of("covariance", covariance, ("classic", "hac")) == "hac"
        self._lags = lags_given(lags, self._windows, is_correlated=is_correlated, is_robust=False)
        if is_correlated and self._lags is None:
            raise ValueError(
                "lags must be given where covariance='hac' in a stream; got none, which needs the whole record; give those of an earlier "
                "recording: rolling_least_squares(…, covariance='hac').lags"
            )
        self._step = arguments.whole_number("step", step, least=1)
        self._shape: tuple[int, int] | None = None
        self._one_rhs = True
        self._weighted = False
        self._unit = 0.0
        self._stream = self._begun(None)

    @property
    def delay(self) -> int:
        """Rows from one to its window.

        See Also
        --------
        push : gives windows that late.
        """
        return self._windows.after + (0 if self._lags is None else 2 * self._windows.rows)

    @property
    def rows(self) -> int:
        """Rows that have come so far: an int.

        See Also
        --------
        delay : how far behind results are.
        """
        return 0 if self._stream is None else self._stream.rows

    def push(self, A: npt.ArrayLike, b: npt.ArrayLike, *, weights: npt.ArrayLike | None = None) -> StreamedRegression:
        """Take the next rows, and give the windows that they complete.

        Parameters
        ----------
        A : array_like, shape (m, p), or (p,) beside a single number
            Regressors of the next rows; shape (m,) beside as many numbers is one regressor.
        b : array_like, shape (m,) or (m, q), or a single number
            Right-hand sides.
        weights : array_like, shape (m,), or a single number, optional
            Weight of every row, as in :func:`rolling_least_squares`: not negative, and rows of weight 0 are not used. Rows of a stream all
            have weights, or none has.

        Returns
        -------
        StreamedRegression
            Windows of the next rows up to :attr:`delay` before the last one that has come.

        Raises
        ------
        ValueError
            If the stream has ended, lengths differ, there are other columns than before, not fewer than ``min_observations``, or as many as
            the rows of which ``half_life`` leaves the weight, a weight is negative, no finite number or 1e100 times the
            first ones, or only some rows have weights.
        TypeError
            If an array is complex or holds no numbers.

        See Also
        --------
        finish : what is left at the end.
        rolling_least_squares : the same numbers of all rows at once.

        References
        ----------
        Equation (4) of docs/mathematics.md; W. M. Gentleman: Least squares computations by Givens transformations without square roots,
        Journal of the Institute of Mathematics and its Applications 12 (1973).
        """
        self._check_open()
        rhs = arguments.any_array("b", b)
        regressors = arguments.any_array("A", A)
        if rhs.ndim == 0:
            regressors, rhs = regressors.reshape(1, -1), rhs.reshape(1)
        elif regressors.ndim == 1:
            regressors = regressors[:, None]
        if regressors.ndim != 2 or rhs.ndim > 2:  # noqa: PLR2004 - a matrix has two axes
            raise ValueError(
                f"A must have shape (m, p) and b shape (m,) or (m, q); got {regressors.shape} and {rhs.shape}; reshape them"
            )
        if rhs.shape[0] != regressors.shape[0]:
            raise ValueError(
                f"A and b must have as many rows as each other; got {regressors.shape[0]} and {rhs.shape[0]}; push them together"
            )
        weight = None if weights is None else arguments.some_weights("weights", weights, rhs.shape[:1])
        if self._stream is not None and (weight is not None) != self._weighted:
            raise not_weighted_alike("rows", have=weight is not None)
        shape = self._shape or _shape_of(regressors, rhs)
        if self._stream is None:
            windows = self._windows
            least_given(windows.at_least, windows.rows, shape[0])
            half_life_given(windows.half_life, 1.0, windows.alignment, windows.rows, shape[0])
        # Nothing stays of rows that are refused.
        relative = None if weight is None else self._relative(weight)
        if self._stream is None:
            self._shape, self._one_rhs = shape, rhs.ndim == 1
            self._weighted = weight is not None
            self._stream = self._begun(None)
        columns = rhs[:, np.newaxis] if rhs.ndim == 1 else rhs
        return self._given(self._stream.push(regressors.T, columns.T, relative))

    def _relative(self, weights: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return weights over the unit of the first that are not zero."""
        largest, unit = float(weights.max(initial=0.0)), self._unit
        if unit == 0.0 and largest > 0.0:
            unit = unit_of_weights(weights)
        if largest > MOST_OF_FIRST * unit:
            raise ValueError(
                f"weights of a stream must be at most {MOST_OF_FIRST:.0e} times the first that are not 0; got {largest:.3g} after weights "
                f"near {unit:.3g}; give all of them in one unit"
            )
        self._unit = unit
        with np.errstate(under="ignore"):
            return weights / (unit or 1.0)

    def _check_end(self) -> None:
        """Check that rows have come."""
        if self._stream is None:
            raise ValueError("a stream must have rows before it ends; got none; push some")

    def _begun(self, state: Any) -> _core.RollingStream | None:
        """Return the stream, which begins with the first rows."""
        return (
            None
            if self._shape is None
            else _core.RollingStream(
                self._windows.told(),
                *self._shape,
                weighted=self._weighted,
                lags=self._lags,
                step=self._step,
                state=state,
            )
        )

    def _given(self, settled: _core.StreamedRegressions) -> StreamedRegression:
        first, found = settled.first, settled.regressions
        row = np.arange(first, first + found.status.size * self._step, self._step, dtype=np.int64)
        if self._one_rhs:
            params, stderr, rss = found.params[:, 0].T, found.stderr[:, 0].T, found.rss[0]
        else:
            params, stderr, rss = np.moveaxis(found.params, -1, 0), np.moveaxis(found.stderr, -1, 0), found.rss.T
        if self._weighted:
            with np.errstate(over="ignore"):
                rss = rss * (self._unit or 1.0)
        return StreamedRegression(row, params, stderr, rss, found.condition, found.status)

    def __repr__(self) -> str:
        return f"<RollingStream after {self.rows} rows, windows of {self._windows.rows}, {self._progress()}>"


def _shape_of(regressors: npt.NDArray[Any], rhs: npt.NDArray[Any]) -> tuple[int, int]:
    """Return how many regressors and right-hand sides there are."""
    count = regressors.shape[1]
    if count > MOST_REGRESSORS:
        raise ValueError(f"A must have at most {MOST_REGRESSORS} columns; got {count}; drop or combine some")
    return count, 1 if rhs.ndim == 1 else rhs.shape[1]
