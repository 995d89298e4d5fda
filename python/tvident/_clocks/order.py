"""The order of the splines by which channels whose times jitter are brought onto a grid: by predicted variance and bias."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._clocks.gaps import are_followed, beyond, is_worth, take_many
from tvident._clocks.grid import Grid, Numbers
from tvident._clocks.missing import LEAST_BRIDGED

_USUAL, _SMALL = 5, 0.31
"""Up to so much jitter a spline of fifth order costs no precision (measured), and hardly any bias."""

_ORDERS, _JUDGE = (1, 3, 5), 7
"""What there is to choose from, and the order that they are compared with."""

_FEW_LOST = 0.02
"""Share of samples that may be lost without a thought about the order."""

_LOOKED_AT, _RECORDS = 1 << 13, 4
"""Samples of the middle of a record, and records, that decide."""

_APART = 8
"""Samples between those that are left out, for each of them."""

_EXPLAINED, _SEEN = 2.0, 1e-3
"""What splines may miss samples by: so many times the noise's variance, and this part of the channel's root mean square."""

_LEAST = 1e-24
"""Of the mean square of a channel: errors below this are rounding."""

_NOISES = 8
"""Records of noise that tell how much of it there is at every place."""


@np.errstate(all="ignore")
def chosen_order(grid: Grid, channels: Mapping[str, npt.NDArray[np.number]]) -> int:
    """Return the order with the least errors of all channels.

    The error of an order is the variance of the noise that it passes, which follows from the times alone, and the square of its bias: by
    how much the next order differs, beyond what noise alone makes that, where noise makes little of it.
    """
    if grid.jitter <= _SMALL and grid.places.size >= (1 - _FEW_LOST) * grid.samples:
        return _USUAL
    middle = Middle.of(grid, channels)
    by_order = [middle.resampled(order, grid.bridged) for order in (*_ORDERS, _JUDGE)]
    gains = [middle.resampling(order, grid.bridged).gain() for order in _ORDERS]
    # What differs between two orders in the channels, and in noise of variance one.
    changes = [middle.beside_noise(one - other) for one, other in pairwise(by_order)]
    squares = middle.mean_square(by_order[0])
    # The noise of a channel is at most what makes the two highest orders differ.
    noise = changes[-1][:-1] / changes[-1][-1]
    scores = []
    for gain, changed in zip(gains, changes, strict=True):
        bias = np.maximum(changed[:-1] - noise * changed[-1], 0.0)
        scores.append(float(np.nansum(np.log(noise * gain + bias + _LEAST * squares + np.finfo(float).tiny))))
    return _ORDERS[int(np.argmin(scores))]


@np.errstate(all="ignore")
def longest_bridged(grid: Grid, channels: Mapping[str, npt.NDArray[np.number]], order: int) -> float:
    """Return the longest step in periods that a spline may go over: as long as it predicts samples that are left out there.

    Everywhere in the middle of the record some samples are left out, so that steps become as long. What they are missed by is compared with
    what noise alone is. Longer steps are gaps, unless they take many equations, and splines add less to the variance of these than
    is lost with all over such a step. Where no step is longer than those that are no gaps anyway, and nothing is missing,
    nothing is asked.
    """
    nothing_lost = all(np.isfinite(values).all() for values in channels.values())
    steps = np.diff(grid.places)
    if nothing_lost and float(steps.max()) <= LEAST_BRIDGED:
        return LEAST_BRIDGED
    middle = Middle.of(grid, channels)
    every = middle.resampled(order, grid.bridged)
    judge = middle.resampled(_JUDGE, grid.bridged)
    change = middle.beside_noise(every - judge)
    noise = change[:-1] / change[-1] if change[-1] > 0 else np.zeros(change.size - 1)
    squares = middle.mean_square(every)
    usual = 0.0
    for lost in range(1, math.floor(grid.bridged)):
        kept = np.arange(middle.places.size) % (_APART * lost) >= lost
        holed = Middle(middle.places[kept], middle.samples, middle.rows[:, kept])
        wrong = middle.beside_noise(_missed(holed, middle, kept, order))
        if not usual and (wrong[:-1] <= _EXPLAINED * noise * wrong[-1] + _SEEN**2 * squares).all():
            continue
        longest = max(float(lost), LEAST_BRIDGED)
        usual = usual or longest
        bias = beyond(wrong[:-1], wrong[-1], noise)
        gaps = np.full(bias.size, np.count_nonzero((steps > longest) & (steps <= lost + 1)) / grid.places.size)
        if not (is_worth(lost, gaps, bias, noise, squares) & are_followed(bias, squares)).all():
            break
    else:
        longest = grid.bridged
    usual = usual or longest
    saved = np.count_nonzero((steps > usual) & (steps <= longest)) / grid.places.size
    return longest if take_many(saved) else usual


def _missed(holed: Middle, middle: Middle, kept: npt.NDArray[np.bool_], order: int) -> Numbers:
    """Return by how much samples that are left out are missed."""
    without = ~kept & (middle.places >= holed.places[0]) & (middle.places <= holed.places[-1])
    found = holed.resampling(order, math.inf).at(holed.rows, middle.places[without])
    return np.asarray(found - middle.rows[:, without])


@dataclass(frozen=True)
class Middle:
    """The middle of a record: some channels, and records of noise of variance one after them.

    Parameters
    ----------
    places : ndarray
        Times in periods.
    samples : int
        Of the grid.
    rows : ndarray, shape (channels + noises, n)
    """

    places: Numbers
    samples: int
    rows: Numbers

    @classmethod
    def of(cls, grid: Grid, channels: Mapping[str, npt.NDArray[np.number]]) -> Middle:
        """Return the middle of some channels."""
        first = max(0, (grid.places.size - _LOOKED_AT) // 2)
        part = slice(first, first + _LOOKED_AT)
        places = grid.places[part] - np.ceil(grid.places[part][0])
        rows = [row[part] for values in channels.values() for row in values.reshape(-1, values.shape[-1])[:_RECORDS]]
        noise = np.random.default_rng(0).standard_normal((_NOISES, places.size))
        every = np.stack([*rows, *noise]).astype(np.float64)
        # What the core takes for no number is none here.
        every[~(np.abs(every) <= arguments.LARGEST)] = np.nan
        return cls(places, math.floor(places[-1]) + 1, every)

    def mean_square(self, rows: Numbers) -> Numbers:
        """Return the mean square of what is known of every channel; NaN where nothing is."""
        return _mean_square(rows[:-_NOISES], np.ones(rows.shape[1]))

    def beside_noise(self, rows: Numbers) -> Numbers:
        """Return the mean square of what is known of every channel, and that of noise of variance one last.

        Where samples lie close together splines amplify noise a thousand times: few such places would make most of a mean, and chance alone
        sets these of two records of noise apart several times. So a place counts less by as much as noise is larger there than a sample's.
        """
        noise = rows[-_NOISES:]
        there = np.mean(noise**2, axis=0)
        weights = 1 / np.maximum(there, 1.0)
        # Each record of noise is weighed by the others, as channels are by records that are not theirs.
        own = 1 / np.maximum((_NOISES * there - noise**2) / (_NOISES - 1), 1.0)
        return np.append(_mean_square(rows[:-_NOISES], weights), _mean_square(noise, own).mean())

    def resampling(self, order: int, bridged: float) -> _core.Resampling:
        """Return how it is brought onto the grid."""
        return _core.Resampling(self.places, self.samples, order=order, bridged=bridged)

    def resampled(self, order: int, bridged: float) -> Numbers:
        """Return it on the grid."""
        return self.resampling(order, bridged).onto_grid(self.rows, workers=1)


def _mean_square(rows: Numbers, weights: Numbers) -> Numbers:
    """Return the weighted mean square of what is known of every row; NaN where nothing is."""
    known = np.where(np.isfinite(rows), weights, 0.0)
    sums = np.sum(known * np.where(np.isfinite(rows), rows, 0.0) ** 2, axis=1)
    return np.asarray(sums / np.sum(known, axis=1))
