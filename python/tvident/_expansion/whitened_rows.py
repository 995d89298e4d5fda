"""Rows of one record around some curves: whitened by the covariance of their noise, with regressors that are free of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.covariance import Whitening
from tvident._expansion.rows import Curves, ExpandedRecord, ExpandedUnknown, parts

Array: TypeAlias = npt.NDArray[np.float64]

Noise: TypeAlias = tuple[Sequence[float], Sequence[float]]
"""Variances of the noise of every angle and of every torque."""

_QUIET = 1e-9
"""The noise of a torque counts as at least this part of the largest torque: rows without noise have no covariance."""

_AT_ONCE, KEPT = 1 << 21, 1 << 22
"""Numbers of the whitened columns that are in memory at once, and of those that all records keep: 16 and 32 MiB."""


def with_least_noise(noise: Noise, records: Sequence[ExpandedRecord], curves: Curves) -> Noise:
    """Return variances of noise with which all rows of some records have a covariance; curves are all coefficients, about.

    Where no torque acts at all, what the motion makes of the coefficients is what else there is to compare with.
    """
    largest = max(float(np.mean(one.torques**2, axis=1).max()) for one in records)
    largest = largest or max(_largest_term(one, curves) for one in records)
    least = largest * _QUIET**2 or 1.0
    return noise[0], [max(one, least) for one in noise[1]]


def _largest_term(record: ExpandedRecord, curves: Curves) -> float:
    """Return the mean square of the largest product of a coefficient and what it multiplies, about."""
    kernels, largest = record.kernels, 0.0
    for entries, values in curves:
        level = float(np.mean(values[0] ** 2))
        for _, role, number, factor in entries:
            is_term = role == "term"
            # Derivatives are as much larger as their kernels are.
            by = 1.0 if is_term else float(np.sum(parts(role, kernels)[0] ** 2) / np.sum(kernels.value**2))
            channel = record.terms[number] if is_term else record.angles[number]
            largest = max(largest, factor**2 * level * by * float(np.mean(channel**2)))
    return largest


class WhitenedRows:
    """Rows of a record around some curves: what noise they have, and their regressors without it.

    Parameters
    ----------
    record : ExpandedRecord
    curves : Curves
        All coefficients, about.
    noise : Noise
    known : Curves
        Those of the curves that are known beforehand.
    most_kept : int
        Numbers of whitened columns that are kept.
    """

    def __init__(self, record: ExpandedRecord, curves: Curves, noise: Noise, known: Curves, most_kept: int) -> None:
        self.record = record
        self._most_kept = most_kept
        curves, known = (_own(record, one) for one in (curves, known))
        self._curves, self._noise = curves, noise
        self._kept: dict[tuple[str, tuple[int, ...] | None], Array] = {}
        usable = record.usable_rows()
        self._torques, self._late = record.late()
        self._late_spread = record.late_spread()
        band, left, rhs = self._band_and_residuals()
        left[~usable] = 0.0
        self._usable = usable
        self.residuals = left[usable]
        self._whitening = Whitening(band, usable.ravel(), record.equations)
        self.observations = float(usable.sum()) * self._whitening.worth
        shown = self._shown(self._whitening.solve(left.ravel()).reshape(left.shape))
        self._rhs = self._without_noise(rhs, shown, known)
        self._rhs[~usable] = 0.0
        self._angles = record.angles - shown

    def whitened(self, unknowns: Sequence[ExpandedUnknown]) -> Iterator[Array]:
        """Give pieces of whitened rows, the right-hand side last."""
        numbers = self._usable.size * sum(one.size for one in unknowns)
        if not self._usable.size:
            return
        if numbers <= _AT_ONCE:
            yield np.concatenate([*(self._kept_columns(one) for one in unknowns), self._white_rhs], axis=1)
        else:
            yield from self._pieces(lambda samples: self._columns(unknowns, samples), self._rhs[:, :, np.newaxis])

    def _kept_columns(self, one: ExpandedUnknown) -> Array:
        """Return the whitened columns of one unknown, which are kept: searches for a size ask for those of all others again and again."""
        key = one.name, None if one.basis is None else tuple(one.basis.sizes)
        found = self._kept.pop(key, None)
        if found is None:
            found = np.concatenate(list(self._pieces(lambda samples: self._columns([one], samples), None)))
        # Those that were asked for longest ago are forgotten first.
        kept = found.size + sum(other.size for other in self._kept.values())
        while self._kept and kept > self._most_kept:
            kept -= self._kept.pop(next(iter(self._kept))).size
        self._kept[key] = found
        return found

    @cached_property
    def _white_rhs(self) -> Array:
        return self._whitening.whiten(self._rhs.reshape(-1, 1))[0]

    def _columns(self, unknowns: Sequence[ExpandedUnknown], samples: slice) -> Array:
        return self.record.columns(unknowns, self._angles, samples)

    def _pieces(self, columns: Callable[[slice], Array], beside: Array | None) -> Iterator[Array]:
        """Give pieces of whitened columns of the samples of a piece, and of columns beside them, shape (rows, equations, columns)."""
        record, before = self.record, None
        for some, samples in record.pieces():
            design = columns(samples)
            if beside is not None:
                design = np.concatenate([design, beside[some]], axis=2)
            design[~self._usable[some]] = 0.0
            rows = design.reshape(-1, design.shape[2])
            white, before = self._whitening.whiten(rows, some.start * record.equations, before)
            yield white

    def _band_and_residuals(self) -> tuple[Array, Array, Array]:
        """Return the covariance of rows by how far they are apart, what is left of each, and the right-hand sides."""
        record, count = self.record, self.record.equations
        left, rhs = np.zeros((2, record.rows, count))
        band = np.zeros((record.rows * count, record.lags * count))
        for some, samples in record.pieces(record.lags - 1):
            entering = record.noise_kernels(self._curves, samples)
            rhs[some] = self._averages(self._torques[:, samples], self._late)
            left[some] = rhs[some] - self._motion(entering, record.angles[:, samples])
            left[some] -= self._terms(self._curves, samples)
            spread = self._spread_over(entering, samples)
            for lag in range(min(record.lags, some.stop - some.start)):
                self._add_covariance(band, some, lag, spread)
        return band, left, rhs

    def _add_covariance(self, band: Array, some: slice, lag: int, entering: dict[tuple[int, int], Array]) -> None:
        """Note the covariance of rows of a piece that are some times apart; entering is how much noise of deviation one enters each."""
        record, count = self.record, self.record.equations
        angles, torques = self._noise
        apart, rows = lag * record.stride, some.stop - some.start - lag
        white = self._white(slice((some.start + lag) * record.stride, None), rows, apart)
        for equation in range(count):
            places = slice((some.start + lag) * count + equation, some.stop * count, count)
            for other in range(equation + 1 if lag == 0 else count):
                shared = torques[equation] * white if equation == other else np.zeros(rows)
                for channel, variance in enumerate(angles):
                    one, two = entering.get((equation, channel)), entering.get((other, channel))
                    if one is not None and two is not None and variance:
                        both = np.einsum("ij,ij->i", one[lag:, : record.length - apart], two[:rows, apart:])
                        shared += variance * both
                band[places, lag * count + equation - other] = shared

    def _white(self, samples: slice, rows: int, apart: int) -> Array:
        """Return the covariance that noise of the torque of variance one gives rows from a sample on with rows some samples before."""
        later, earlier = self._late[: self.record.length - apart], self._late[apart:]
        spread = self._late_spread
        if spread is None:
            return np.full(rows, later @ earlier)
        products = later * earlier
        return self.record.windows(spread[samples])[:rows, : products.size] @ products

    def _spread_over(self, entering: dict[tuple[int, int], Array], samples: slice) -> dict[tuple[int, int], Array]:
        """Return how much noise of deviation one enters rows, where samples of small weights have more."""
        if self.record.spread is None:
            return entering
        deviations = self.record.windows(np.sqrt(self.record.spread[samples]))
        return {place: kernels * deviations for place, kernels in entering.items()}

    def _motion(self, entering: dict[tuple[int, int], Array], angles: Array) -> Array:
        """Return what the motion of some angles makes of a piece's rows, shape (rows, equations)."""
        rows = (angles.shape[1] - self.record.length) // self.record.stride + 1
        found = np.zeros((rows, self.record.equations))
        for (equation, channel), kernels in entering.items():
            found[:, equation] += np.einsum("ij,ij->i", kernels, self.record.windows(angles[channel]))
        return found

    def _terms(self, curves: Curves, samples: slice) -> Array:
        """Return what terms make of a piece's rows, shape (rows, equations)."""
        return self._averages(self.record.torques_of_terms(curves, samples), self.record.kernels.value)

    def _averages(self, torques: Array, kernel: Array) -> Array:
        """Return the averages of torques over the windows of a piece's rows, shape (rows, equations)."""
        return np.stack([self.record.windows(one) @ kernel for one in torques], axis=1)

    def _shown(self, weights: Array) -> Array:
        """Return the noise of the angles that the residuals show."""
        record, shown = self.record, np.zeros(self.record.angles.shape)
        for some, samples in record.pieces():
            count = some.stop - some.start
            for (equation, channel), kernels in record.noise_kernels(self._curves, samples).items():
                weighted, piece = kernels * weights[some, equation, np.newaxis], shown[channel, samples]
                for place in range(record.length):
                    piece[place : place + (count - 1) * record.stride + 1 : record.stride] += weighted[:, place]
        variances = np.asarray(self._noise[0])[:, np.newaxis] * (1.0 if record.spread is None else record.spread)
        return np.asarray(-variances * shown)

    def _without_noise(self, rhs: Array, shown: Array, known: Curves) -> Array:
        """Return the right-hand sides without the noise that is shown, and without what is known."""
        record, found = self.record, rhs.copy()
        for some, samples in record.pieces():
            found[some] -= self._motion(record.noise_kernels(self._curves, samples), shown[:, samples])
            if known:
                angles = record.angles[:, samples] - shown[:, samples]
                found[some] -= self._motion(record.noise_kernels(known, samples), angles)
                found[some] -= self._terms(known, samples)
        return found


def _own(record: ExpandedRecord, curves: Curves) -> Curves:
    """Return curves at the samples of a record."""
    if record.alignment is None:
        return curves
    return [(places, record.alignment.curve(values, record.period)) for places, values in curves]
