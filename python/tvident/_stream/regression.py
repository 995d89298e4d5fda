"""Least squares in windows of rows that come piece by piece."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._regression import MOST_REGRESSORS
from tvident._stream.pieces import Stream


@dataclass(frozen=True, eq=False, slots=True)
class StreamedRegression:
    """What a :class:`RollingStream` gives for some rows, each with one element of every array.

    Attributes
    ----------
    row : ndarray of int64, shape (k,)
        Numbers of the rows at the centres of the windows.
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


class RollingStream(Stream[StreamedRegression]):
    """Solve least squares in windows of rows as they come: :func:`rolling_least_squares`, piece by piece.

    Pieces may hold one row or millions. The numbers are those of one call with all rows, bit for bit (to rounding where a column of ``A``
    other than the first is a constant, which a call with all rows takes first), however the stream is cut; the
    window around a row is given with the row :attr:`delay` rows later. Memory does not grow with what has come.

    Parameters
    ----------
    window_length : int
        Rows in a window, more than there are regressors.
    step : int, optional
        Every how many rows a result is wanted.

    Attributes
    ----------
    delay : int
        Rows from one to its window: the rows of a window after its centre.
    rows : int
        Rows that have come so far.

    Raises
    ------
    ValueError
        If a length is not positive.
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
    the rows of at most two windows, and goes on where it was.

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
    """

    def __init__(self, window_length: int, *, step: int = 1) -> None:
        self._window = arguments.whole_number("window_length", window_length, least=1)
        self._step = arguments.whole_number("step", step, least=1)
        self._shape: tuple[int, int] | None = None
        self._one_rhs = True
        self._stream = self._begun(None)

    @property
    def delay(self) -> int:
        """Rows from one to its window.

        See Also
        --------
        push : gives windows that late.
        """
        return self._window - 1 - self._window // 2

    @property
    def rows(self) -> int:
        """Rows that have come so far: an int.

        See Also
        --------
        delay : how far behind results are.
        """
        return 0 if self._stream is None else self._stream.rows

    def push(self, A: npt.ArrayLike, b: npt.ArrayLike) -> StreamedRegression:
        """Take the next rows, and give the windows that they complete.

        Parameters
        ----------
        A : array_like, shape (m, p), or (p,) beside a single number
            Regressors of the next rows; shape (m,) beside as many numbers is one regressor.
        b : array_like, shape (m,) or (m, q), or a single number
            Right-hand sides.

        Returns
        -------
        StreamedRegression
            Windows around the next rows up to :attr:`delay` before the last one that has come.

        Raises
        ------
        ValueError
            If the stream has ended, lengths differ, or there are other columns than before.
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
        if self._stream is None:
            self._shape, self._one_rhs = _shape_of(regressors, rhs), rhs.ndim == 1
            self._stream = self._begun(None)
        columns = rhs[:, np.newaxis] if rhs.ndim == 1 else rhs
        return self._given(self._stream.push(regressors.T, columns.T))

    def _check_end(self) -> None:
        """Check that rows have come."""
        if self._stream is None:
            raise ValueError("a stream must have rows before it ends; got none; push some")

    def _begun(self, state: Any) -> _core.RollingStream | None:
        """Return the stream, which begins with the first rows."""
        return (
            None
            if self._shape is None
            else _core.RollingStream(self._window, *self._shape, step=self._step, state=state)
        )

    def _given(self, settled: _core.StreamedRegressions) -> StreamedRegression:
        first, found = settled.first, settled.regressions
        row = np.arange(first, first + found.status.size * self._step, self._step, dtype=np.int64)
        if self._one_rhs:
            params, stderr, rss = found.params[:, 0].T, found.stderr[:, 0].T, found.rss[0]
        else:
            params, stderr, rss = np.moveaxis(found.params, -1, 0), np.moveaxis(found.stderr, -1, 0), found.rss.T
        return StreamedRegression(row, params, stderr, rss, found.condition, found.status)

    def __repr__(self) -> str:
        return f"<RollingStream after {self.rows} rows, windows of {self._window}, {self._progress()}>"


def _shape_of(regressors: npt.NDArray[Any], rhs: npt.NDArray[Any]) -> tuple[int, int]:
    """Return how many regressors and right-hand sides there are."""
    count = regressors.shape[1]
    if count > MOST_REGRESSORS:
        raise ValueError(f"A must have at most {MOST_REGRESSORS} columns; got {count}; drop or combine some")
    return count, 1 if rhs.ndim == 1 else rhs.shape[1]
