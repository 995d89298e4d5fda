"""The angle's noise taken off the normal matrix of every window, and constants from all windows together.

Every window's rows are multiplied out to a normal matrix. What the noise of the angle adds to it on average, its variance times the
Gram matrix of the kernels, is subtracted; the window's own unknowns are eliminated (Schur complement); what is left is summed over the
windows and solved for the constants (Speckman 1988).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MOST_NOISE = 0.9
"""The largest part of a window's information that is believed to be noise."""


@dataclass
class Column:
    """A column of the rows, and the kernels that made it from the angle; none where it holds no noise of the angle."""

    values: Array
    kernel: Array
    companion: Array
    """The same multiplied with the time from each row's centre, where the factor may grow linearly in time."""
    companion_kernel: Array


@dataclass
class Rows:
    """The rows of a record. Those that are no equations are zero in every column."""

    windowed: Sequence[Column]
    constant: Sequence[Column]
    side: Column
    usable: npt.NDArray[np.bool_]
    period: float
    """Seconds from one row to the next."""
    linear: bool
    """Whether what is windowed may grow linearly within a window."""
    variance: float
    """Variance of the angle's noise."""

    @property
    def local(self) -> int:
        """Unknowns of one window."""
        return len(self.windowed) * (2 if self.linear else 1)

    def columns(self, centre: float) -> Array:
        """Give all rows of the record, times counted from a row: unknowns of a window, their companions, constants, right-hand side."""
        time = (np.arange(self.usable.size) - centre) * self.period
        columns = [one.values for one in self.windowed]
        if self.linear:
            columns += [one.companion + time * one.values for one in self.windowed]
        columns += [one.values for one in self.constant]
        return np.stack([*columns, self.side.values], axis=1) * self.usable[:, None]

    def noise(self, centre: float, rows: npt.NDArray[np.intp]) -> Array:
        """Give what the angle's noise adds to the products of these columns over some rows."""
        time = (rows[self.usable[rows]] - centre) * self.period
        still, mixed, growing = self.grams
        # A column's kernel at time t is a + t b: the products of two of them, summed over the rows.
        products = time.size * still + time.sum() * (mixed + mixed.T) + float(time @ time) * growing
        return np.asarray(self.variance * products)

    @cached_property
    def grams(self) -> tuple[Array, Array, Array]:
        """Give the products of the kernels a that stay the same in a window, of a and b, and of those b that grow with time."""
        still = [one.kernel for one in self.windowed]
        growing = [np.zeros_like(self.side.kernel)] * len(still)
        if self.linear:
            still, growing = still + [one.companion_kernel for one in self.windowed], growing + still
        still += [one.kernel for one in (*self.constant, self.side)]
        growing += [np.zeros_like(self.side.kernel)] * (len(still) - len(growing))
        a, b = np.array(still), np.array(growing)
        return a @ a.T, a @ b.T, b @ b.T


@dataclass
class Window:
    """What the rows of a window say once the noise is taken off."""

    normal: Array
    side: Array
    rest: float
    """The squares that are left of the right-hand side by the best unknowns."""
    norms: Array
    """Squares of the columns before anything was taken off."""
    local: int
    count: int
    product: Array
    """The window's own columns times all that the covariance of the rows makes of them."""

    @cached_property
    def own(self) -> Array:
        """The window's own unknowns where all constants are zero."""
        return np.asarray(np.linalg.solve(self.normal[: self.local, : self.local], self.side[: self.local]))

    @cached_property
    def dependence(self) -> Array:
        """By what they fall with each constant."""
        own = self.normal[: self.local]
        return np.asarray(np.linalg.solve(own[:, : self.local], own[:, self.local :]))

    @cached_property
    def left(self) -> tuple[Array, Array]:
        """What is left for the constants: normal matrix and right-hand side."""
        across = self.normal[self.local :, : self.local]
        return self.normal[self.local :, self.local :] - across @ self.dependence, self.side[
            self.local :
        ] - across @ self.own

    @cached_property
    def condition(self) -> float:
        """The condition number of all normal equations, columns scaled."""
        return float(np.linalg.cond(self.normal / np.sqrt(np.outer(self.norms, self.norms))))

    def squares(self, constants: Array) -> float:
        """Give the sum of squares that is left with some constants."""
        if not constants.size:
            return self.rest
        normal, side = self.left
        off = constants - np.linalg.solve(normal, side)
        return self.rest + float(off @ normal @ off)

    @cached_property
    def freedom(self) -> float:
        """The part of the noise that the window's own unknowns take up."""
        return float(np.trace(np.linalg.solve(self.normal[: self.local, : self.local], self.product)))

    def covariance(self, variance: float) -> tuple[Array, Array]:
        """Give the covariance of the window's own unknowns, and the size of what it is a sum of.

        In the coordinates of the factor it is at least that of independent rows.
        """
        inverse = np.linalg.inv(np.linalg.cholesky(self.normal[: self.local, : self.local]))
        noise = inverse @ self.product @ inverse.T
        np.fill_diagonal(noise, np.maximum(np.diag(noise), variance))
        return inverse.T @ noise @ inverse, np.abs(inverse.T) @ np.abs(noise) @ np.abs(inverse)


def window(rows: Rows, held: npt.NDArray[np.intp], centre: float, gamma: Array) -> Window:
    """Take the noise off the normal equations of one window, of rows that follow each other."""
    columns = rows.columns(centre)
    part = columns[held]
    total = part.T @ part
    noise = rows.noise(centre, held)
    inverse = np.linalg.inv(np.linalg.cholesky(total[:-1, :-1]))
    relative = float(np.linalg.norm(inverse @ noise[:-1, :-1] @ inverse.T))
    corrected = total - min(1.0, MOST_NOISE / relative if relative else 1.0) * noise
    normal, side = corrected[:-1, :-1], corrected[:-1, -1]
    product = part[:, : rows.local].T @ gamma[held[0] : held[-1] + 1] @ columns[:, : rows.local]
    return Window(
        normal=normal,
        side=side,
        rest=max(0.0, float(corrected[-1, -1] - side @ np.linalg.solve(normal, side))),
        norms=np.diag(total)[:-1],
        local=rows.local,
        count=int(rows.usable[held].sum()),
        product=(product + product.T) / 2,
    )


def row_covariance(kernels: Array, parameters: Array, noise: tuple[float, float], stride: int, count: int) -> Array:
    """Give the covariance of all rows by the noise of angle and torque, whose kernel is the last."""
    mixed = parameters @ kernels

    def by_lag(kernel: Array) -> Array:
        every = np.correlate(kernel, kernel, "full")[kernel.size - 1 :: stride]
        return np.asarray(np.r_[every, np.zeros(count)][:count])

    lags = noise[0] * by_lag(mixed) + noise[1] * by_lag(kernels[2])
    return np.asarray(lags[np.abs(np.subtract.outer(np.arange(count), np.arange(count)))])


@dataclass
class Fit:
    """Constants from all windows together."""

    values: Array
    covariance: Array
    windows: list[Window]
    weights: Array
    misfits: Array
    condition: float
    """By how much normal equations may lose digits: those of the worst window times those of the sum."""


def fit(rows: Rows, span: int, step: int, gamma: Array, torque: float) -> Fit:
    """Solve for the constants from windows of `span` rows every `step` rows.

    `gamma` is the covariance of the rows, `torque` the part of a row's variance that comes from the torque.
    """
    count = rows.usable.size
    firsts = range(0, count - span + 1, step)
    windows = [window(rows, np.arange(first, first + span), first + (span - 1) / 2, gamma) for first in firsts]
    weights = np.array([float(one.count > rows.local + len(rows.constant) + 1) for one in windows])
    values, normal = pooled(windows, weights)
    misfits = np.zeros(len(windows))
    for _ in range(3):
        misfits = misfits_of(windows, values, gamma, torque)
        weights = np.where(weights > 0, huber(misfits, weights, windows, gamma), 0.0)
        values, normal = pooled(windows, weights)
    influence = np.zeros((count, len(rows.constant)))
    for first, weight, one in zip(firsts, weights, windows, strict=True):
        held = slice(first, first + span)
        columns = rows.columns(first + (span - 1) / 2)[held, :-1]
        influence[held] += weight * (columns[:, rows.local :] - columns[:, : rows.local] @ one.dependence)
    inverse = np.linalg.inv(normal)
    norms = sum(weight * one.norms[rows.local :] for weight, one in zip(weights, windows, strict=True))
    scaled = normal / np.sqrt(np.outer(norms, norms))
    condition = float(np.linalg.cond(scaled)) * max(one.condition for one in windows)
    return Fit(values, inverse @ influence.T @ gamma @ influence @ inverse, windows, weights, misfits, condition)


def pooled(windows: list[Window], weights: Array) -> tuple[Array, Array]:
    """Sum what windows left for the constants, and solve it."""
    normal, side = (
        np.asarray(sum(weight * one.left[part] for weight, one in zip(weights, windows, strict=True)))
        for part in range(2)
    )
    return np.linalg.solve(normal, side), normal


def misfits_of(windows: list[Window], values: Array, gamma: Array, torque: float) -> Array:
    """Give the squares that every window leaves, over what the noise should leave."""
    found = []
    for one in windows:
        noise = one.count * gamma[0, 0]
        # The angle's noise in the rows was taken off the squares with that of the normal matrix.
        squares = one.squares(values) + one.count * (gamma[0, 0] - torque)
        found.append(squares / max(noise - one.freedom, 0.3 * noise))
    return np.array(found)


def huber(misfits: Array, weights: Array, windows: list[Window], gamma: Array) -> Array:
    """Give every window's weight: less where it fits worse than chance allows."""
    middle = np.sort(misfits[weights > 0])[int((weights > 0).sum()) // 2]
    correlations = gamma[0] / gamma[0, 0]
    alike = 1 + 2 * np.sum(correlations[1:] ** 2)
    independent = np.maximum(np.array([one.count for one in windows]) / alike - 2, 1)
    most = max(middle, 1.0) * (1 + 4 * np.sqrt(2 / independent))
    return np.asarray((most / np.maximum(misfits, most)) ** 2)
