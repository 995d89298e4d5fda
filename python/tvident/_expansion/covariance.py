"""The covariance of overlapping rows: a band, its factor, and solutions with it."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

RIDGE = 1e-6
"""Added to the variance of a row, relative to it, so that frequencies that the test function suppresses do not count."""

BLOCK = 32
"""Times of rows in a block: more than share samples with one, which are some twenty at most."""


_PROBES = 4
"""Vectors of random signs by which a trace is found."""


class Whitening:
    """The factor L of a banded covariance Γ = L Lᵀ, by blocks of rows of which only neighbours share samples.

    Parameters
    ----------
    band : ndarray, shape (rows, lags)
        ``band[i, l]`` is the covariance of the rows i and i - l.
    usable : ndarray of bool, shape (rows,)
        Rows that are no equations count as independent of all others.
    equations : int
        Rows at one time, which follow each other.
    """

    def __init__(self, band: Array, usable: npt.NDArray[np.bool_], equations: int = 1) -> None:
        rows, lags = band.shape
        self.rows = rows
        self._width = width = BLOCK * equations
        self._blocks = blocks = -(-rows // width)
        full = np.zeros((blocks * width, lags))
        full[:rows] = np.where(usable[:, np.newaxis], band, 0.0)
        there = np.zeros(blocks * width, dtype=bool)
        there[:rows] = usable
        for lag in range(1, lags):
            full[lag:, lag] *= there[:-lag]
        middle = float(np.mean(band[usable, 0])) if usable.any() else 1.0
        full[:, 0] = np.where(there, full[:, 0] * (1 + RIDGE), middle)
        self._diagonal, self._lower = self._factor(full, lags)
        self._worth = self._worth_of(np.where(usable, RIDGE * band[:, 0], 0.0))

    def _factor(self, full: Array, lags: int) -> tuple[Array, Array]:
        width, blocks = self._width, self._blocks
        row, column = np.arange(width)[:, np.newaxis], np.arange(width)[np.newaxis]
        own, before = row - column, row - column + width
        inside, beside = (own >= 0) & (own < lags), (before >= 0) & (before < lags)
        diagonal, lower = np.empty((blocks, width, width)), np.zeros((blocks, width, width))
        for block in range(blocks):
            some = full[block * width : (block + 1) * width]
            triangle = np.where(inside, some[row, np.clip(own, 0, lags - 1)], 0.0)
            matrix = triangle + np.tril(triangle, -1).T
            if block:
                shared = np.where(beside, some[row, np.clip(before, 0, lags - 1)], 0.0)
                lower[block] = shared @ diagonal[block - 1].T
                matrix -= lower[block] @ lower[block].T
            diagonal[block] = np.linalg.inv(np.linalg.cholesky(matrix))
        return diagonal, lower

    def _worth_of(self, added: Array) -> float:
        """Return the part of rows that tells something new: what their noise leaves of the whitened rows' squares, tr(Γ'⁻¹ Γ) a row.

        What the ridge adds to it is found with random signs (Hutchinson), whose squares scatter by a hundredth for 10 000 rows.
        """
        signs = np.random.default_rng(0).integers(0, 2, (self.rows, _PROBES)) * 2.0 - 1
        white, _ = self.whiten(np.asarray(signs * np.sqrt(added)[:, np.newaxis], dtype=np.float64))
        count = float(_PROBES * max(1, int(np.count_nonzero(added))))
        return float(np.clip(1 - float(np.sum(white**2)) / count, 0, 1))

    @property
    def worth(self) -> float:
        """How many independent equations one row is worth, at most one: rows overlap."""
        return self._worth

    def whiten(self, columns: Array, first: int = 0, before: Array | None = None) -> tuple[Array, Array]:
        """Return L⁻¹ times some columns, piece by piece.

        Parameters
        ----------
        columns : ndarray, shape (rows, columns)
            From a row on at which a block begins, to the end or to where another begins.
        first : int
            That row.
        before : ndarray, optional
            The second result for the piece before.
        """
        found = self._padded(columns)
        number = first // self._width
        last = np.zeros(found.shape[1:]) if before is None else before
        for block in range(len(found)):
            rest = found[block] - self._lower[number + block] @ last
            found[block] = last = self._diagonal[number + block] @ rest
        return found.reshape(-1, columns.shape[1])[: len(columns)], last

    def solve(self, column: Array) -> Array:
        """Return Γ⁻¹ times a column, shape (rows,)."""
        found = self._padded(self.whiten(column[:, np.newaxis])[0])
        for block in reversed(range(self._blocks)):
            own = found[block]
            if block + 1 < self._blocks:
                own -= self._lower[block + 1].T @ found[block + 1]
            found[block] = self._diagonal[block].T @ own
        return found.reshape(-1)[: self.rows]

    def _padded(self, columns: Array) -> Array:
        blocks = -(-len(columns) // self._width)
        found = np.zeros((blocks * self._width, columns.shape[1]))
        found[: len(columns)] = columns
        return found.reshape(blocks, self._width, columns.shape[1])
