"""Rows of the equation of motion in weak form whose coefficients are curves: dot products with the kernels of a test function."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.basis import AT_A_TIME, Basis

Array: TypeAlias = npt.NDArray[np.float64]

ROWS_A_HALF_WIDTH = 6
"""Rows carry all their information so many times in a half-width."""

_UNTOLD = 1e-12
"""Of a function's mean square: what counts as said of a function of which nothing is."""

_MOVES = 4.0
"""Mean square of what a coefficient multiplies over that of noise alone, from which on it is motion."""

PIECE = 4096
"""Rows that are in memory at a time: whole blocks of the covariance's factor."""


@dataclass(frozen=True)
class Kernels:
    """A test function φ = (1 - x²)^p at the samples of a window, and its derivatives by time.

    Parameters
    ----------
    value, rate, change : ndarray, shape (2h + 1,)
        φ, φ′ and φ″.
    """

    value: Array
    rate: Array
    change: Array

    @classmethod
    def of(cls, half: int, exponent: int, period: float, shift: float = 0.0) -> Kernels:
        """Return the kernels of a test function that is moved by a part of a sample."""
        x = (np.arange(-half, half + 1) - shift) / half
        inside = np.maximum(1 - x**2, 0.0)
        scale = 1 / np.sum(inside**exponent)
        seconds = half * period
        rate = -2 * exponent * x * inside ** (exponent - 1) / seconds
        change = 2 * exponent * inside ** (exponent - 2) * (2 * (exponent - 1) * x**2 - inside) / seconds**2
        value = inside**exponent
        # Sums are not quite zero where windows are short, which a large constant angle would show.
        rate, change = (kernel - np.sum(kernel) * scale * value for kernel in (rate, change))
        return cls(value * scale, rate * scale, change * scale)


@dataclass(frozen=True)
class ExpandedUnknown:
    """One unknown of the equation: a factor, or the factors of an expansion.

    Parameters
    ----------
    name : str
    role : str
        ``"inertia"``, ``"momentum"``, ``"damping"``, ``"stiffness"`` or ``"term"``.
    basis : Basis, optional
        None for a constant.
    samples : ndarray, shape (n,), optional
        Of a term.
    """

    name: str
    role: str
    basis: Basis | None = None
    samples: Array | None = None

    @property
    def size(self) -> int:
        """How many columns it has."""
        return 1 if self.basis is None else self.basis.size


def placed(unknowns: Sequence[ExpandedUnknown]) -> Iterator[tuple[ExpandedUnknown, slice]]:
    """Give every unknown and the place of its factors among those of all."""
    first = 0
    for one in unknowns:
        yield one, slice(first, first + one.size)
        first += one.size


def condition_of_curves(unknowns: Sequence[ExpandedUnknown], root: Array, usable: npt.NDArray[np.bool_]) -> float:
    """Return a condition number of the rows that knows nothing of how alike the functions of an expansion are.

    Harmonics of a period that is longer than the record are hardly told from each other, and the curve that they make is. It is the
    condition of rows whose functions are orthonormal along the samples that are usable.

    Parameters
    ----------
    unknowns : sequence of ExpandedUnknown
    root : ndarray, shape (columns, columns)
        A root of the covariance of the factors, as the inverse of the rows' triangular factor is.
    usable : ndarray of bool, shape (n,)
    """
    some = slice(None, None, max(1, -(-usable.size // AT_A_TIME)))
    inverse = root.copy()
    for one, place in placed(unknowns):
        if one.basis is not None:
            functions = np.asarray(one.basis.along(some, 0))[usable[some]]
            inverse[place] = np.linalg.qr(functions, mode="r") @ root[place] if len(functions) >= one.size else np.nan
    if not np.isfinite(inverse).all():
        return float("inf")
    norm = np.linalg.norm(inverse, axis=1, keepdims=True)
    return float(np.linalg.cond(inverse / norm)) if np.all(norm > 0) else float("inf")


def reach_over(basis: Basis, told: npt.NDArray[np.bool_]) -> Array:
    """Return by how much errors of a curve grow from where the motion tells it to each sample, where only those samples determine it."""
    stride = max(1, -(-told.size // AT_A_TIME))
    functions = np.asarray(basis.along(slice(None, None, stride), 0))
    there = told[::stride]
    known = functions[there]
    if not known.any():
        return np.ones(told.size)
    gram = known.T @ known / len(known)
    # Functions that are zero wherever something is told have errors without bounds.
    gram += _UNTOLD * np.trace(gram) / len(gram) * np.eye(len(gram))
    square = np.maximum(np.einsum("ij,ji->i", functions, np.linalg.solve(gram, functions.T)), 0.0)
    return np.repeat(np.sqrt(square / np.median(square[there & (square > 0)])), stride)[: told.size]


def parts(role: str, kernels: Kernels) -> list[Array]:
    """Return the kernels by which a coefficient and its derivatives multiply the angle, after integration by parts."""
    if role == "inertia":
        return [kernels.change, 2 * kernels.rate, kernels.value]
    if role == "momentum":
        return [kernels.change, kernels.rate]
    if role == "damping":
        return [-kernels.rate, -kernels.value]
    return [kernels.value]


@dataclass(frozen=True)
class ExpandedRecord:
    """A record as rows are made of it.

    Parameters
    ----------
    angle, torque : ndarray, shape (n,)
        Zero where they are not usable.
    usable : ndarray of bool, shape (n,)
        Whether a row may use a sample.
    centres : ndarray of bool, shape (n,)
        Whether a row may have its centre at a sample.
    period : float
    half, exponent : int
    lag : float
        By how many samples the torque comes late.
    """

    angle: Array
    torque: Array
    usable: npt.NDArray[np.bool_]
    centres: npt.NDArray[np.bool_]
    period: float
    half: int
    exponent: int
    lag: float = 0.0

    @property
    def stride(self) -> int:
        """Samples from one row to the next."""
        return max(1, self.half // ROWS_A_HALF_WIDTH)

    @property
    def length(self) -> int:
        """Samples of a window."""
        return 2 * self.half + 1

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return max(0, (self.angle.size - self.length) // self.stride + 1)

    @property
    def lags(self) -> int:
        """How many rows share samples, this one counted."""
        return (self.length - 1) // self.stride + 1

    @property
    def kernels(self) -> Kernels:
        """Of the angle."""
        return Kernels.of(self.half, self.exponent, self.period)

    def late(self) -> tuple[Array, Array]:
        """Return the torque, moved by whole samples, and the kernel that moves it by the rest."""
        whole = round(self.lag)
        torque = np.zeros_like(self.torque)
        if whole >= 0:
            torque[: self.torque.size - whole] = self.torque[whole:]
        else:
            torque[-whole:] = self.torque[:whole]
        return torque, Kernels.of(self.half, self.exponent, self.period, self.lag - whole).value

    def usable_rows(self) -> npt.NDArray[np.bool_]:
        """Return which rows are equations: those that touch no missing sample."""
        whole = round(self.lag)
        moved = np.zeros_like(self.usable)
        if whole >= 0:
            moved[: self.usable.size - whole] = self.usable[whole:]
        else:
            moved[-whole:] = self.usable[:whole]
        missing = np.concatenate([[0], np.cumsum(~(self.usable & moved))])
        first = np.arange(self.rows) * self.stride
        touched = missing[first + self.length] - missing[first]
        return np.asarray((touched == 0) & self.centres[first + self.half])

    def moves(self, role: str, noise: float) -> npt.NDArray[np.bool_]:
        """Return at which samples what a coefficient multiplies is more than noise of this variance, within four windows."""
        usable, kernel = self.usable_rows(), parts(role, self.kernels)[0]
        if not usable.any():
            return np.ones(self.angle.size, np.bool_)
        windows = np.lib.stride_tricks.sliding_window_view(self.angle, self.length)[:: self.stride]
        squares = np.einsum("ij,j->i", windows, kernel) ** 2 * usable
        around = 4 * self.lags
        sums, counts = (np.concatenate([[0.0], np.cumsum(one)]) for one in (squares, usable))
        rows = np.arange(self.rows)
        first, end = np.maximum(rows - around // 2, 0), np.minimum(rows + around // 2 + 1, self.rows)
        moves = sums[end] - sums[first] >= _MOVES * noise * np.sum(kernel**2) * (counts[end] - counts[first])
        nearest = np.clip((np.arange(self.angle.size) - self.half + self.stride // 2) // self.stride, 0, self.rows - 1)
        return np.asarray(moves[nearest])

    def pieces(self, ahead: int = 0) -> Iterator[tuple[slice, slice]]:
        """Give pieces of rows and their samples, with some rows ahead of each."""
        for first in range(0, self.rows, PIECE):
            begin, end = max(0, first - ahead), min(self.rows, first + PIECE)
            yield slice(begin, end), slice(begin * self.stride, (end - 1) * self.stride + self.length)

    def windows(self, channel: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the windows of the rows in a stretch of a channel, shape (rows, 2h + 1): a view."""
        return np.lib.stride_tricks.sliding_window_view(channel, self.length)[:: self.stride]

    def columns(self, unknowns: Sequence[ExpandedUnknown], angle: Array, samples: slice) -> Array:
        """Return the columns of a stretch's rows, shape (rows, columns)."""
        kernels, windows = self.kernels, self.windows(angle[samples])
        found = []
        for one in unknowns:
            each = windows if one.samples is None else self.windows(one.samples[samples])
            weights = parts(one.role, kernels)
            if one.basis is None:
                found.append((each @ weights[0])[:, np.newaxis])
                continue
            blocks = one.basis.blocks(samples)
            if blocks is not None:
                found.append(self._sums(each * weights[0], blocks, one.size))
                continue
            column = np.zeros((len(each), one.size))
            for rate, weight in enumerate(weights):
                functions = one.basis.along(samples, rate)
                self._add_products(each * weight, functions, column)
            found.append(column)
        return np.concatenate(found, axis=1)

    def _sums(self, weighted: Array, blocks: npt.NDArray[np.int64], size: int) -> Array:
        """Return the sums of weighted windows over the samples of every block: the products with functions that are one at a time."""
        into = self.windows(blocks) + size * np.arange(len(weighted))[:, np.newaxis]
        sums = np.bincount(into.ravel(), weighted.ravel(), len(weighted) * size)
        return np.asarray(sums, np.float64).reshape(-1, size)

    def _add_products(self, weighted: Array, functions: Array, into: Array) -> None:
        """Add the products of weighted windows with functions, each where it is not zero."""
        for number, function in enumerate(functions.T):
            there = np.flatnonzero(function)
            if not there.size:
                continue
            first = max(0, (int(there[0]) - self.length) // self.stride)
            last = min(len(weighted), int(there[-1]) // self.stride + 1)
            windows = self.windows(np.ascontiguousarray(function))[first:last]
            into[first:last, number] += np.einsum("ij,ij->i", weighted[first:last], windows)

    def noise_kernels(self, curves: Sequence[tuple[str, Sequence[Array]]], samples: slice) -> Array:
        """Return how much each sample's noise of the angle enters every row, shape (rows, 2h + 1).

        Parameters
        ----------
        curves : sequence
            Coefficients: their roles, their values and their derivatives by time at every sample.
        samples : slice
        """
        kernels = self.kernels
        rows = (samples.stop - samples.start - self.length) // self.stride + 1
        found = np.zeros((rows, self.length))
        for role, values in curves:
            for value, weight in zip(values, parts(role, kernels), strict=False):
                found += self.windows(value[samples]) * weight
        return found
