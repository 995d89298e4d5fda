"""Least squares of weak rows with expanded coefficients, weighted by their noise and corrected for that of the angle.

With the noise of the angle as unknown as the parameters, the most likely parameters make the residuals r(c) of the rows, whose covariance
Γ(c) depends on them, least in rᵀ Γ⁻¹ r. Its slope vanishes where the residuals are orthogonal to the regressors of the angle without
the noise that the residuals show, ê = -σ² Wᵀ Γ⁻¹ r, W being how the noise enters the rows. So every step is a linear least-squares problem
of whitened rows (Gauss and Newton); no bias from noise in the regressors is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.covariance import Whitening
from tvident._expansion.rows import Record, Unknown

Array: TypeAlias = npt.NDArray[np.float64]

Curves: TypeAlias = list[tuple[str, list[Array]]]
"""Coefficients by their roles: values at the samples, and derivatives by time."""

SINGULAR = 1e-12
"""Columns are dependent where the smallest singular value of the scaled factor is this part of the largest."""


@dataclass(frozen=True)
class Fitted:
    """A solution.

    Attributes
    ----------
    values : ndarray, shape (columns,)
    covariance : ndarray, shape (columns, columns)
    misfit : float
        The sum of squares of whitened residuals.
    observations : float
        How many independent equations there were.
    condition : float
        Of the columns, scaled to the same norm.
    """

    values: Array
    covariance: Array
    misfit: float
    observations: float
    condition: float

    @property
    def criterion(self) -> float:
        """Akaike's, corrected, with the number of independent equations."""
        k = self.values.size + 1
        if self.observations <= k + 1 or not np.isfinite(self.condition) or not self.misfit > 0:
            return float("inf")
        n = self.observations
        return float(n * np.log(self.misfit / n) + 2 * k * n / (n - k - 1))


class Linearised:
    """Rows of a record around some curves: what noise they have, and their regressors without it.

    Parameters
    ----------
    record : Record
    curves : Curves
        Inertia, damping and stiffness, about.
    terms : Array
        Torque of the further terms, about, at every sample.
    noise : (float, float)
        Variances of the noise of angle and torque.
    known : Curves
        Those of the curves that are known beforehand.
    """

    def __init__(self, record: Record, curves: Curves, terms: Array, noise: tuple[float, float], known: Curves) -> None:
        self.record = record
        usable = record.usable_rows()
        torque, late = record.late()
        lags, rows = record.lags, record.rows
        band, left, rhs = np.zeros((rows, lags)), np.zeros(rows), np.zeros(rows)
        for some, samples in record.pieces(lags - 1):
            entering = record.noise_kernels(curves, samples)
            right = record.windows(torque[samples]) @ late
            rhs[some] = right
            motion = np.einsum("ij,ij->i", entering, record.windows(record.angle[samples]))
            left[some] = right - motion - record.windows(terms[samples]) @ record.kernels.value
            for lag in range(lags):
                apart, now = lag * record.stride, slice(some.start + lag, some.stop)
                count = len(entering) - lag
                if count <= 0:
                    break
                shared = np.einsum("ij,ij->i", entering[lag:, : record.length - apart], entering[:count, apart:])
                white = float(late[: record.length - apart] @ late[apart:])
                band[now, lag] = noise[0] * shared + noise[1] * white
        left[~usable] = 0.0
        self.usable, self.residuals = usable, left[usable]
        self.whitening = Whitening(band, usable)
        self.observations = float(usable.sum()) * self.whitening.worth
        weights = self.whitening.solve(left)
        shown = np.zeros(record.angle.size)
        self.rhs = rhs.copy()
        for some, samples in record.pieces():
            entering = record.noise_kernels(curves, samples) * weights[some, np.newaxis]
            count, piece = some.stop - some.start, shown[samples]
            for place in range(record.length):
                piece[place : place + (count - 1) * record.stride + 1 : record.stride] += entering[:, place]
        shown *= -noise[0]
        for some, samples in record.pieces():
            entering = record.noise_kernels(curves, samples)
            self.rhs[some] = rhs[some] - np.einsum("ij,ij->i", entering, record.windows(shown[samples]))
            if known:
                entering = record.noise_kernels(known, samples)
                angle = record.angle[samples] - shown[samples]
                self.rhs[some] -= np.einsum("ij,ij->i", entering, record.windows(angle))
        self.rhs[~usable] = 0.0
        self.angle = record.angle - shown

    def solve(self, unknowns: Sequence[Unknown]) -> Fitted:
        """Return the least-squares solution for some unknowns, by QR decompositions of blocks of whitened rows."""
        record, columns = self.record, sum(one.size for one in unknowns)
        factor: Array = np.zeros((0, columns + 1))
        before = None
        for some, samples in record.pieces():
            design = np.column_stack([record.columns(unknowns, self.angle, samples), self.rhs[some]])
            design[~self.usable[some]] = 0.0
            white, before = self.whitening.whiten(design, some.start, before)
            factor = np.asarray(np.linalg.qr(np.concatenate([factor, white]), mode="r"), np.float64)
        return solved(factor, self.observations)

    def covariance_of_residuals(self, unknowns: Sequence[Unknown], fitted: Fitted) -> Array:
        """Return a covariance that follows from the whitened residuals and their correlation (Newey and West), not from the noise."""
        record, before = self.record, None
        reach = int(np.ceil(4 * (max(1, record.rows) / 100) ** (2 / 9))) + record.lags
        middle = np.zeros((fitted.values.size, fitted.values.size))
        last = np.zeros((0, fitted.values.size))
        for some, samples in record.pieces():
            design = np.column_stack([record.columns(unknowns, self.angle, samples), self.rhs[some]])
            design[~self.usable[some]] = 0.0
            white, before = self.whitening.whiten(design, some.start, before)
            scores = white[:, :-1] * (white[:, -1] - white[:, :-1] @ fitted.values)[:, np.newaxis]
            chain, new = np.concatenate([last, scores]), len(scores)
            for lag in range(reach + 1):
                late = chain[max(lag, len(chain) - new) :]
                product = late.T @ chain[len(chain) - len(late) - lag : len(chain) - lag]
                weight = 1 - lag / (reach + 1)
                middle += product if lag == 0 else weight * (product + product.T)
            last = chain[-reach:]
        return np.asarray(fitted.covariance @ middle @ fitted.covariance)


def solved(factor: Array, observations: float) -> Fitted:
    """Return the solution of a triangular factor whose last column is the right-hand side."""
    size = factor.shape[1] - 1
    nothing = Fitted(np.full(size, np.nan), np.full((size, size), np.nan), np.nan, observations, np.inf)
    if factor.shape[0] < factor.shape[1]:
        return nothing
    matrix, rhs = factor[:size, :size], factor[:size, size]
    norm = np.linalg.norm(matrix, axis=0)
    if not np.all(norm > 0):
        return nothing
    left, singular, right = np.linalg.svd(matrix / norm)
    if not singular[-1] > SINGULAR * singular[0]:
        return nothing
    inverse = (right.T / singular) @ left.T / norm[:, np.newaxis]
    misfit = float(factor[size, size] ** 2)
    values = inverse @ rhs
    return Fitted(values, inverse @ inverse.T, misfit, observations, float(singular[0] / singular[-1]))
