"""Rows of the equation of motion in weak form whose coefficients are curves: dot products with the kernels of a test function."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.alignment import AlignedSamples
from tvident._expansion.basis import AT_A_TIME, Basis
from tvident._expansion.covariance import BLOCK

Array: TypeAlias = npt.NDArray[np.float64]

APART = 0.8
"""Rows are so many standard deviations of a test function apart: nearer ones know nothing that these do not, and the less their covariance
is that of what is next to nothing, the less its ridge hides of the noise in regressors."""

_UNTOLD = 1e-12
"""Of a function's mean square: what counts as said of a function of which nothing is."""

_MOVES = 4.0
"""Mean square of what a coefficient multiplies over that of noise alone, from which on it is motion."""

PIECE = 4096
"""Rows that are in memory at a time: whole blocks of the covariance's factor."""

Places: TypeAlias = Sequence[tuple[int, str, int, float]]
"""Where an unknown appears: equation, role, channel of the motion or number of the term, factor. The role is ``"inertia"``, ``"momentum"``,
``"damping"``, ``"stiffness"`` or ``"term"``."""

Curves: TypeAlias = Sequence[tuple[Places, Sequence[Array]]]
"""Coefficients: where they appear, their values and their derivatives by time at the samples."""


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
    """One unknown of the equations: a factor, or the factors of an expansion.

    Parameters
    ----------
    name : str
    entries : Places
    basis : Basis, optional
        None for a constant.
    """

    name: str
    entries: Places
    basis: Basis | None = None

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


def of_one(role: str, number: int = 0) -> Places:
    """Return where an unknown of one equation of one angle appears; terms have a number."""
    return ((0, role, number, 1.0),)


def spread_of(weights: Array | None) -> Array | None:
    """Return the variance of the noise of samples over that of one of weight one; samples without a weight are not usable anyway."""
    return None if weights is None else np.asarray(1 / np.where(weights > 0, weights, 1.0))


@dataclass(frozen=True)
class ExpandedRecord:
    """A record as rows are made of it: those of all equations at one time follow each other.

    Parameters
    ----------
    angles : ndarray, shape (channels, n)
    torques : ndarray, shape (equations, n)
        Zero where they are not usable, as the angles.
    usable : ndarray of bool, shape (equations, n)
        Whether a row of an equation may use a sample.
    centres : ndarray of bool, shape (n,)
        Whether a row may have its centre at a sample.
    period : float
    half, exponent : int
    lag : float
        By how many samples the torques come late.
    terms : sequence of ndarray, shape (n,)
        What the factors of terms multiply, by the number of the term.
    spread : ndarray, shape (n,), optional
        Variance of the noise of every sample over that of a sample of weight one: one over its weight; none where all are alike.
    alignment : AlignedSamples, optional
        Where its samples lie along curves that are shared; by default each at its own number.
    """

    angles: Array
    torques: Array
    usable: npt.NDArray[np.bool_]
    centres: npt.NDArray[np.bool_]
    period: float
    half: int
    exponent: int
    lag: float = 0.0
    terms: Sequence[Array] = ()
    spread: Array | None = None
    alignment: AlignedSamples | None = None

    @property
    def samples(self) -> int:
        """How many samples there are."""
        return int(self.angles.shape[1])

    @property
    def equations(self) -> int:
        """How many equations there are."""
        return len(self.torques)

    @property
    def stride(self) -> int:
        """Samples from one time of rows to the next."""
        return max(1, int(APART * self.half / np.sqrt(2 * self.exponent + 3)))

    @property
    def length(self) -> int:
        """Samples of a window."""
        return 2 * self.half + 1

    @property
    def rows(self) -> int:
        """How many times of rows there are."""
        return max(0, (self.samples - self.length) // self.stride + 1)

    @property
    def lags(self) -> int:
        """The rows at how many times share samples, this one counted."""
        return (self.length - 1) // self.stride + 1

    @property
    def kernels(self) -> Kernels:
        """Of the angles."""
        return Kernels.of(self.half, self.exponent, self.period)

    def late(self) -> tuple[Array, Array]:
        """Return the torques, moved by whole samples, and the kernel that moves them by the rest."""
        whole = round(self.lag)
        torques = np.stack([_moved(one, whole) for one in self.torques])
        return torques, Kernels.of(self.half, self.exponent, self.period, self.lag - whole).value

    def late_spread(self) -> Array | None:
        """Return the spread of the torques' noise, moved as they are."""
        return None if self.spread is None else _moved(self.spread, round(self.lag))

    def usable_rows(self) -> npt.NDArray[np.bool_]:
        """Return which rows are equations, shape (rows, equations): those that touch no missing sample."""
        whole, first = round(self.lag), np.arange(self.rows) * self.stride
        found = np.empty((self.rows, self.equations), np.bool_)
        for equation, usable in enumerate(self.usable):
            missing = np.concatenate([[0], np.cumsum(~(usable & _moved(usable, whole)))])
            touched = missing[first + self.length] - missing[first]
            found[:, equation] = (touched == 0) & self.centres[first + self.half]
        return found

    def moves(self, entries: Places, noise: Sequence[float]) -> npt.NDArray[np.bool_]:
        """Return at which samples what a coefficient multiplies is more than noise of the angles' variances, within four windows."""
        usable, kernels = self.usable_rows(), self.kernels
        if not usable.any():
            return np.ones(self.samples, np.bool_)
        squares, by_noise = np.zeros((2, self.rows))
        for equation in sorted({entry[0] for entry in entries}):
            here = [entry for entry in entries if entry[0] == equation]
            kernel = parts(here[0][1], kernels)[0]
            moved = sum(factor * self.angles[channel] for _, _, channel, factor in here)
            squares += np.einsum("ij,j->i", self.windows(moved), kernel) ** 2 * usable[:, equation]
            variance = sum(factor**2 * noise[channel] for _, _, channel, factor in here)
            by_noise += variance * np.sum(kernel**2) * usable[:, equation]
        around = 4 * self.lags
        sums, least = (np.concatenate([[0.0], np.cumsum(one)]) for one in (squares, by_noise))
        rows = np.arange(self.rows)
        first, end = np.maximum(rows - around // 2, 0), np.minimum(rows + around // 2 + 1, self.rows)
        moves = np.asarray(sums[end] - sums[first] >= _MOVES * (least[end] - least[first]))
        nearest = np.clip((np.arange(self.samples) - self.half + self.stride // 2) // self.stride, 0, self.rows - 1)
        return np.asarray(moves[nearest])

    def pieces(self, ahead: int = 0) -> Iterator[tuple[slice, slice]]:
        """Give pieces of the times of rows and their samples, with some times ahead of each."""
        # Whole blocks of the covariance, which are longer with more equations.
        count = max(BLOCK, PIECE // self.equations // BLOCK * BLOCK)
        for first in range(0, self.rows, count):
            begin, end = max(0, first - ahead), min(self.rows, first + count)
            yield slice(begin, end), slice(begin * self.stride, (end - 1) * self.stride + self.length)

    def windows(self, channel: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the windows of the rows in a stretch of a channel, shape (rows, 2h + 1): a view."""
        return np.lib.stride_tricks.sliding_window_view(channel, self.length)[:: self.stride]

    def columns(self, unknowns: Sequence[ExpandedUnknown], angles: Array, samples: slice) -> Array:
        """Return the columns of a stretch's rows, shape (rows, equations, columns)."""
        kernels, windows = self.kernels, [self.windows(one[samples]) for one in angles]
        found = np.zeros((len(windows[0]), self.equations, sum(one.size for one in unknowns)))
        for one, place in placed(unknowns):
            basis = one.basis
            if basis is not None and self.alignment is not None:
                basis = self.alignment.basis(basis, self.period)
            known: dict[tuple[str, int], Array] = {}
            for equation, role, channel, factor in one.entries:
                if (role, channel) not in known:
                    each = windows[channel] if role != "term" else self.windows(self.terms[channel][samples])
                    known[role, channel] = self._column(basis, each, parts(role, kernels), samples)
                found[:, equation, place] += factor * known[role, channel]
        return found

    def _column(self, basis: Basis | None, each: Array, weights: Sequence[Array], samples: slice) -> Array:
        """Return the columns of one unknown by the windows of what it multiplies."""
        if basis is None:
            return np.asarray((each @ weights[0])[:, np.newaxis])
        blocks = basis.blocks(samples)
        if blocks is not None:
            return self._sums(each * weights[0], blocks, basis.size)
        column = np.zeros((len(each), basis.size))
        for rate, weight in enumerate(weights):
            self._add_products(each * weight, basis.along(samples, rate), column)
        return column

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

    def noise_kernels(self, curves: Curves, samples: slice) -> dict[tuple[int, int], Array]:
        """Return how much the noise of each sample of an angle enters the rows of an equation, each of shape (rows, 2h + 1)."""
        kernels = self.kernels
        rows = (samples.stop - samples.start - self.length) // self.stride + 1
        found: dict[tuple[int, int], Array] = {}
        for entries, values in curves:
            windows = [self.windows(value[samples]) for value in values]
            for equation, role, channel, factor in entries:
                if role == "term":
                    continue
                entering = found.setdefault((equation, channel), np.zeros((rows, self.length)))
                for window, weight in zip(windows, parts(role, kernels), strict=False):
                    entering += window * (factor * weight)
        return found

    def torques_of_terms(self, curves: Curves, samples: slice) -> Array:
        """Return the torques of terms with these factors at some samples, shape (equations, samples)."""
        found = np.zeros((self.equations, samples.stop - samples.start))
        for entries, values in curves:
            for equation, role, number, factor in entries:
                if role == "term":
                    found[equation] += factor * values[0][samples] * self.terms[number][samples]
        return found


def curve_length(records: Sequence[ExpandedRecord]) -> int:
    """Return how many samples the curves have that records share."""
    aligned = [one.alignment.length for one in records if one.alignment is not None]
    return max(aligned or [one.samples for one in records])


def _moved(channel: npt.NDArray[Any], later: int) -> npt.NDArray[Any]:
    """Return a channel that comes some samples earlier, zero where nothing is left of it."""
    moved = np.zeros_like(channel)
    if later >= 0:
        moved[: channel.size - later] = channel[later:]
    else:
        moved[-later:] = channel[:later]
    return moved
