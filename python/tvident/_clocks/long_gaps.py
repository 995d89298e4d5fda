"""Gaps of a uniform clock that are longer than usual ones and take many equations: packets with pauses, or most samples missing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._clocks.gaps import FEW, LONGEST, USUAL, are_followed, beyond, gaps_of, is_worth, mean_of, take_many, taken
from tvident._clocks.grid import Numbers

_LENGTHS = (1, 2, 3, 4, 6, 8, 12, 16, 24, LONGEST)
"""Samples in a row up to which gaps are bridged."""

_APART = 8
"""Stretches between those that are left out, for each of them."""

_ALIKE = 0.5
"""Part of the samples that one channel lacks that others lack at least: what splines smooth then, they smooth of the whole equation."""

_LEAST = 1e-24
"""Of the mean square of a channel: what is rounding."""

_Rows = npt.NDArray[np.float64]


def over_long(every: _Rows, rows: _Rows, variance: Numbers, orders: Sequence[int]) -> tuple[int, int] | None:
    """Return the order of splines and the most samples in a row that they go over, where long gaps take many equations; None elsewhere.

    The error of an order is what it passes of the noise, and its bias. That is at most what samples that are left out beside those that are
    missing are missed by, since gaps become longer then: of packets at regular places far too much. It is hardly more than what the next
    order differs by in the gaps, where noise makes little of that. So the less of both counts.

    Parameters
    ----------
    every, rows : ndarray, shape (channels, n)
        Channels, NaN where samples are missing, and a part of them that decides.
    variance : ndarray
        Of the channels' noise; not finite where no window is whole.
    orders : sequence of int
        What there is to choose from.
    """
    # A channel that is bridged alone is smoothed alone.
    if not _are_alike(every) or not take_many(_of_any(every, USUAL + 1, LONGEST)):
        return None
    lengths = [0]
    for longest in _LENGTHS:
        if taken(_of_any(every, lengths[-1] + 1, every.shape[1])) < FEW:
            break
        lengths.append(longest)
    classes = [(shortest + 1, longest) for shortest, longest in pairwise(lengths)]
    shares = [np.array([gaps_of(row, *one) for row in every]) for one in classes]
    across = {one: _across(rows, one) for one in {*orders, *(one + 2 for one in orders)}}
    among = [_in_gaps(rows, *one) for one in classes]
    changes = {one: [_changes(across[one], across[one + 2], there) for there in among] for one in orders}
    missed = {one: [_missed_over(rows, one, longest) for _, longest in classes] for one in orders}
    # Of a record of which hardly a window is whole nobody knows what is noise: at most what single samples are missed by, at least nothing.
    most = np.min([found[0][0] / found[0][1] for found in missed.values()], axis=0)
    surely = np.where(np.isfinite(variance), variance, 0.0)
    variance = np.where(np.isfinite(variance), variance, most)
    squares = np.array([mean_of(row**2) for row in rows])
    biases = {
        one: [
            np.fmin(*(beyond(*wrong, surely) for wrong in both)) for both in zip(changes[one], missed[one], strict=True)
        ]
        for one in orders
    }
    errors = {}
    for one, found in biases.items():
        passed = [_mean_squares(across[one][1], there) for there in among]
        added = [
            longest * share * np.nan_to_num(variance * gain + bias)
            for (_, longest), share, gain, bias in zip(classes, shares, passed, found, strict=True)
        ]
        errors[one] = float(np.sum(np.log(np.sum(added, axis=0) + _LEAST * squares + np.finfo(float).tiny)))
    best = min(errors, key=errors.__getitem__)
    bridged = 0
    for (_, longest), share, bias in zip(classes, shares, biases[best], strict=True):
        allowed = is_worth(longest, share, bias, variance, squares) & are_followed(bias, squares)
        if not (allowed | (share == 0)).all():
            break
        bridged = longest
    return (best, bridged) if take_many(_of_any(every, USUAL + 1, bridged)) else None


def _of_any(every: _Rows, fewest: int, most: int) -> float:
    """Return how many gaps of so many samples there are for each sample, of whatever channel: an equation needs all of them."""
    starts = np.zeros(every.shape[1], dtype=np.bool_)
    for row in every:
        known = np.flatnonzero(np.isfinite(row))
        steps = np.diff(known)
        starts[known[:-1][(steps > fewest) & (steps <= most + 1)]] = True
    return float(np.mean(starts))


def _are_alike(every: _Rows) -> bool:
    """Tell whether all channels lack about as many samples."""
    missing = np.mean(~np.isfinite(every), axis=1)
    return bool(missing.min() >= _ALIKE * missing.max())


def _missed_over(rows: _Rows, order: int, lost: int) -> tuple[Numbers, Numbers]:
    """Return the mean squares by which samples in gaps of at least so many are missed, and of noise of variance one."""
    generator = np.random.default_rng(0)
    # At random, as gaps may come at regular places.
    starts = np.arange(0, rows.shape[1], _APART * lost)
    starts += generator.integers(0, (_APART - 1) * lost, starts.size)
    left_out = np.zeros(rows.shape[1], dtype=np.bool_)
    left_out[np.minimum(starts[:, np.newaxis] + np.arange(lost), rows.shape[1] - 1)] = True
    found, of_noise = _across(rows, order, left_out)
    every = np.broadcast_to(left_out, rows.shape)
    return _mean_squares(found - rows, every), _mean_squares(of_noise - _noise(rows), every)


def _across(rows: _Rows, order: int, left_out: npt.NDArray[np.bool_] | None = None) -> tuple[_Rows, _Rows]:
    """Return rows with all gaps bridged, and noise of variance one with the same gaps; some samples may be left out, too."""
    samples = rows.shape[1]
    every = np.concatenate([rows, _noise(rows)])
    if left_out is not None:
        every[:, left_out] = np.nan
    resampling = _core.Resampling(np.arange(samples, dtype=np.float64), samples, order=order, bridged=math.inf)
    found = resampling.onto_grid(every, workers=1)
    return found[: rows.shape[0]], found[rows.shape[0] :]


def _noise(rows: _Rows) -> _Rows:
    """Return noise of variance one where rows are known."""
    return np.where(np.isfinite(rows), np.random.default_rng(0).standard_normal(rows.shape), np.nan)


def _in_gaps(rows: _Rows, fewest: int, most: int) -> npt.NDArray[np.bool_]:
    """Return which samples of rows lie in gaps of so many."""
    found = np.zeros(rows.shape, dtype=np.bool_)
    for row, there in zip(rows, found, strict=True):
        known = np.flatnonzero(np.isfinite(row))
        steps = np.diff(known)
        wanted = np.flatnonzero((steps > fewest) & (steps <= most + 1))
        changes = np.zeros(row.size + 1, dtype=np.int64)
        changes[known[wanted] + 1] += 1
        changes[known[wanted + 1]] -= 1
        there[:] = np.cumsum(changes[:-1]) > 0
    return found


def _changes(
    one: tuple[_Rows, _Rows], other: tuple[_Rows, _Rows], there: npt.NDArray[np.bool_]
) -> tuple[Numbers, Numbers]:
    """Return the mean squares of what differs between two orders at some samples of rows, and of noise."""
    return _mean_squares(one[0] - other[0], there), _mean_squares(one[1] - other[1], there)


def _mean_squares(rows: _Rows, there: npt.NDArray[np.bool_]) -> Numbers:
    """Return the mean squares of rows at some samples."""
    return np.array([mean_of(row[some] ** 2) for row, some in zip(rows, there, strict=True)])
