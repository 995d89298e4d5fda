"""Least squares of weak rows with expanded coefficients, weighted by their noise and corrected for that of the angle.

With the noise of the angle as unknown as the parameters, the most likely parameters make the residuals r(c) of the rows, whose covariance
Γ(c) depends on them, least in rᵀ Γ⁻¹ r. Its slope vanishes where the residuals are orthogonal to the regressors of the angle without
the noise that the residuals show, ê = -σ² Wᵀ Γ⁻¹ r, W being how the noise enters the rows. So every step is a linear least-squares problem
of whitened rows (Gauss and Newton); no bias from noise in the regressors is left.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.rows import Curves, ExpandedRecord, ExpandedUnknown
from tvident._expansion.whitened_rows import KEPT, Noise, WhitenedRows

Array: TypeAlias = npt.NDArray[np.float64]

SINGULAR = 1e-12
"""Columns are dependent where the smallest singular value of the scaled factor is this part of the largest."""


MORE_THAN_NOISE = 1.3
"""What is left of the equations, over their noise, from which on it may be correlated in another way."""

_WHOLE = (128, 32)
"""Rows and columns of what BLAS does not divide among threads, which wait for each other by turning: where other programs
have the processors a factor that takes one thread 1.4 ms took two of them up to 245."""

_LEAST_LEFT = 1e-11
"""Of the square of the right-hand side, from which on products tell what is left of it to four digits: beside a large offset it is less."""

_TO_COMPARE, _TO_SOLVE = 1e-4, 1e-2
"""Least pivots of scaled columns from which on products tell what QR decompositions do: their squares lose 8 and 4 of 16 digits."""


@dataclass(frozen=True)
class ScoredSize:
    """How well some columns explain a record.

    Attributes
    ----------
    size : int
    misfit : float
        The sum of squares of whitened residuals.
    observations : float
        How many independent equations there were.
    as_one : float
        How many of them count as one, since what they leave is correlated.
    """

    size: int
    misfit: float
    observations: float
    as_one: float = 1.0

    @property
    def criterion(self) -> float:
        """Akaike's, corrected, with the number of independent equations."""
        k = self.size + 1
        n = self.observations / self.as_one
        if n <= k + 1 or not self.misfit > 0:
            return float("inf")
        return float(n * np.log(self.misfit / self.observations) + 2 * k * n / (n - k - 1))


@dataclass(frozen=True)
class Fitted:
    """A solution.

    Attributes
    ----------
    values : ndarray, shape (columns,)
    root : ndarray, shape (columns, k)
        A root of their covariance C = root rootᵀ. Functions that are hardly told from each other have factors whose variances cancel in a
        curve; sums of squares of the root's products do not.
    misfit : float
        The sum of squares of whitened residuals.
    observations : float
        How many independent equations there were.
    factor : ndarray, shape (columns, columns), optional
        Triangular, of columns scaled to the same norm; None where they are dependent.
    beside : ndarray, shape (k, columns + 1), optional
        Further equations of variance 1 that were solved with those of the record.
    """

    values: Array
    root: Array
    misfit: float
    observations: float
    factor: Array | None
    beside: Array | None = None

    @property
    def covariance(self) -> Array:
        """Covariance of the values, shape (columns, columns)."""
        return np.asarray(self.root @ self.root.T)

    @cached_property
    def condition(self) -> float:
        """Condition number of the scaled columns."""
        return float("inf") if self.factor is None else float(np.linalg.cond(self.factor))

    @property
    def ratio(self) -> float:
        """The mean square of the residuals over that of the noise."""
        free = self.observations - self.values.size
        return self.misfit / free if free > 0 else float("nan")

    @property
    def scored(self) -> ScoredSize:
        """How well it explains the record."""
        return ScoredSize(self.values.size, np.nan if self.factor is None else self.misfit, self.observations)


class Linearised:
    """Rows of some records around the same curves.

    Parameters
    ----------
    records : sequence of ExpandedRecord
    curves : Curves
        All coefficients, about.
    noise : Noise
        Variances of the noise of every angle and of every torque.
    known : Curves
        Those of the curves that are known beforehand.
    """

    def __init__(self, records: Sequence[ExpandedRecord], curves: Curves, noise: Noise, known: Curves) -> None:
        most_kept = KEPT // max(1, len(records))
        self._each = [WhitenedRows(record, curves, noise, known, most_kept) for record in records]
        self.residuals = np.concatenate([one.residuals for one in self._each])
        self.observations = sum(one.observations for one in self._each)

    def solve(self, unknowns: Sequence[ExpandedUnknown], beside: Array | None = None) -> Fitted:
        """Return the least-squares solution for some unknowns: by QR decompositions of blocks of whitened rows where these need them.

        Parameters
        ----------
        unknowns : sequence of ExpandedUnknown
        beside : ndarray, shape (k, columns + 1), optional
            Further equations of variance 1, the right-hand side last.
        """
        size = sum(one.size for one in unknowns)
        factor = _factor(self._products(unknowns, size, beside), _TO_SOLVE)
        is_well = factor is not None
        if factor is None:
            factor = np.zeros((0, size + 1)) if beside is None else beside
            for white in self.whitened(unknowns):
                factor = np.asarray(np.linalg.qr(np.concatenate([factor, white]), mode="r"), np.float64)
        return replace(solved(factor, self.observations, is_well=is_well), beside=beside)

    def score(self, unknowns: Sequence[ExpandedUnknown], beside: Array | None = None) -> ScoredSize:
        """Return how well some unknowns explain the record, as their solution says."""
        size = sum(one.size for one in unknowns)
        factor = _factor(self._products(unknowns, size, beside), _TO_COMPARE)
        if factor is None:
            return self.solve(unknowns, beside).scored
        return ScoredSize(size, float(factor[size, size] ** 2), self.observations)

    def _products(self, unknowns: Sequence[ExpandedUnknown], size: int, beside: Array | None) -> Array:
        """Return the products of whitened columns, the right-hand side last."""
        start = np.zeros((size + 1, size + 1)) if beside is None else _products(beside)
        return sum(map(_products, self.whitened(unknowns)), start)

    def whitened(self, unknowns: Sequence[ExpandedUnknown]) -> Iterator[Array]:
        """Give pieces of whitened rows, the right-hand side last, record by record."""
        for one in self._each:
            yield from one.whitened(unknowns)

    def correlation(self, unknowns: Sequence[ExpandedUnknown], fitted: Fitted) -> tuple[float, Array]:
        """Return by how much the correlation of what is left makes variances larger than those of as much white noise, and their root.

        It is 1 at least, and where no more is left than noise.
        """
        if not fitted.ratio > MORE_THAN_NOISE:
            return 1.0, fitted.root
        root = self._root_of_residuals(unknowns, fitted)
        with np.errstate(all="ignore"):
            times = (root**2).sum(axis=1) / (fitted.root**2).sum(axis=1)
        found = float(np.median(times)) / fitted.ratio
        return max(1.0, found) if np.isfinite(found) else 1.0, root

    def _root_of_residuals(self, unknowns: Sequence[ExpandedUnknown], fitted: Fitted) -> Array:
        """Return a root of the covariance that follows from whitened residuals and their correlation (Newey and West), not from noise."""
        middle = np.zeros((fitted.values.size, fitted.values.size))
        if fitted.beside is not None:
            middle += _products(fitted.beside[:, :-1] @ fitted.root)
        for one in self._each:
            middle += _correlated_scores(one, unknowns, fitted)
        if not np.isfinite(middle).all():
            return np.full_like(fitted.root, np.nan)
        squares, axes = np.linalg.eigh(middle)
        return np.asarray(fitted.root @ (axes * np.sqrt(np.maximum(squares, 0.0))))


def _scores(rows: WhitenedRows, unknowns: Sequence[ExpandedUnknown], fitted: Fitted) -> Iterator[Array]:
    """Give pieces of whitened rows times their residuals; times the root, columns are orthonormal, however hard to tell apart."""
    for white in rows.whitened(unknowns):
        left = white[:, -1] - white[:, :-1] @ fitted.values
        yield white[:, :-1] @ fitted.root * left[:, np.newaxis]


def _correlated_scores(rows: WhitenedRows, unknowns: Sequence[ExpandedUnknown], fitted: Fitted) -> Array:
    """Return the covariance of the sum of a record's scores, from those of rows that are near each other."""
    record = rows.record
    reach = int(np.ceil(4 * (max(1, record.rows) / 100) ** (2 / 9))) + record.lags
    # Rows of all equations at one time follow each other.
    reach *= record.equations
    middle = np.zeros((fitted.values.size, fitted.values.size))
    nothing = last = np.zeros((reach, fitted.values.size))
    for scores in chain(_scores(rows, unknowns, fitted), [nothing]):
        # Weights that fall linearly with the lag are how often both rows lie in one of all windows of so many rows.
        sums = np.cumsum(np.concatenate([nothing[:1], last, scores]), axis=0)
        middle += _products(sums[reach + 1 :] - sums[: -reach - 1]) / (reach + 1)
        last = np.concatenate([last, scores])[-reach:]
    return middle


def _products(rows: Array) -> Array:
    """Return the products of all columns, in blocks that stay on one thread."""
    high, wide = _WHOLE
    count, columns = -(-len(rows) // high), rows.shape[1]
    padded = np.zeros((count * high, columns))
    padded[: len(rows)] = rows
    pieces = padded.reshape(count, high, columns)
    found = np.empty((columns, columns))
    for first in range(0, columns, wide):
        one = slice(first, first + wide)
        for other in (slice(second, second + wide) for second in range(0, first + 1, wide)):
            found[one, other] = (pieces[:, :, one].swapaxes(1, 2) @ pieces[:, :, other]).sum(axis=0)
            found[other, one] = found[one, other].T
    return found


def _factor(products: Array, least: float) -> Array | None:
    """Return the triangular factor of columns from their products (Cholesky); None where a column is nearly made of others.

    The last column is the right-hand side, of which little may be left.
    """
    norm = np.sqrt(np.diagonal(products))
    if not (norm > 0).all():
        return None
    left, size = products / np.outer(norm, norm), len(products) - 1
    factor = np.zeros_like(left)
    for column in range(size + 1):
        # Scaled columns have squares of one: a pivot is the part of a square that the columns before do not explain.
        pivot = left[column, column]
        if not pivot > (least**2 if column < size else max(least**4, _LEAST_LEFT)):
            return None
        factor[column, column:] = left[column, column:] / np.sqrt(pivot)
        left[column + 1 :, column + 1 :] -= np.multiply.outer(*2 * (factor[column, column + 1 :],))
    return np.asarray(factor * norm)


def solved(factor: Array, observations: float, *, is_well: bool) -> Fitted:
    """Return the solution of a triangular factor whose last column is the right-hand side; singular values tell whether there is one."""
    size = factor.shape[1] - 1
    nothing = Fitted(np.full(size, np.nan), np.full((size, size), np.nan), np.nan, observations, None)
    if factor.shape[0] < factor.shape[1]:
        return nothing
    matrix, rhs = factor[:size, :size], factor[:size, size]
    norm = np.linalg.norm(matrix, axis=0)
    if not np.all(norm > 0):
        return nothing
    scaled = matrix / norm
    if is_well:
        inverse = _inverse(scaled)
    else:
        left, singular, right = np.linalg.svd(scaled)
        if not singular[-1] > SINGULAR * singular[0]:
            return nothing
        inverse = (right.T / singular) @ left.T
    inverse = inverse / norm[:, np.newaxis]
    return Fitted(inverse @ rhs, inverse, float(factor[size, size] ** 2), observations, scaled)


def _inverse(triangle: Array) -> Array:
    """Return the inverse of an upper triangle that is well conditioned, row by row from the last."""
    size = len(triangle)
    found = np.zeros((size, size))
    for row in reversed(range(size)):
        rest = slice(row + 1, size)
        found[row, rest] = -(triangle[row, rest] @ found[rest, rest]) / triangle[row, row]
        found[row, row] = 1 / triangle[row, row]
    return found
