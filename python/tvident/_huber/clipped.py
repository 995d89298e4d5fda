"""Samples of a channel in place of which a model's prediction stands, with no more than a clipped residual."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

_LIMIT = 2.5
"""Standard deviations from which residuals of samples count linearly. A residual of the torque holds noise of the acceleration too, which
clipping carries into the torque: 98.8 % of normal residuals are left as they are, and 99.9 % of the efficiency of least squares."""

_MEDIAN = 0.6744897501960817
"""Half of normal deviations are smaller than this part of the standard deviation."""

_BLOCK = 1 << 10
"""Samples of a block, which has a scale of its own."""

_FAR = 4.0
"""Standard deviations that one normal residual in 16 000 exceeds."""

_HEAVY = 5.0
"""Tails are heavy where so many times as many residuals as expected are far, and so many more than none."""


@dataclass(frozen=True)
class Clipped:
    """What became of a channel.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Predictions, and residuals as far as they count.
    share : float
        The part of the samples whose residual was clipped.
    scale : float
        The median scale of the residuals.
    """

    values: Array
    share: float
    scale: float


def clip_residuals(recorded: Array, predicted: Array) -> Clipped:
    """Return a channel whose residuals count at most 2.5 standard deviations.

    Least squares of the values have the errors that hold for Huber's loss: clipped residuals are divided by the part of them that is not
    clipped (Huber 1981, modified residuals). Where nothing is predicted samples stay as they are, and missing ones stay missing.
    """
    left = recorded - predicted
    there = np.isfinite(left)
    limits = _LIMIT * _scales(np.where(there, left, np.nan))
    there &= limits > 0
    beyond = there & (np.abs(left) > limits)
    share = float(beyond.sum() / max(1, there.sum()))
    bounded = np.clip(left, -limits, limits) / (1 - share)
    values = np.where(there, predicted + bounded, recorded)
    scale = float(np.nanmedian(limits)) / _LIMIT if there.any() else 0.0
    return Clipped(values if beyond.any() else recorded, share, scale)


def has_heavy_tails(recorded: Array, predicted: Array) -> bool:
    """Return whether many more residuals are far from zero than of normal noise."""
    left = recorded - predicted
    left = np.where(np.isfinite(left), left, np.nan)
    count = int(np.isfinite(left).sum())
    expected = count * math.erfc(_FAR / math.sqrt(2))
    far = np.nansum(np.abs(left) > _FAR * _scales(left))
    return bool(far > _HEAVY * expected + _HEAVY)


def _scales(left: Array) -> Array:
    """Return the standard deviation of normal residuals at every sample, from medians of blocks, none below half the median of all."""
    blocks = max(1, left.size // _BLOCK)
    edges = np.linspace(0, left.size, blocks + 1).astype(int)
    found = np.full(blocks, np.nan)
    for block in range(blocks):
        residuals = left[edges[block] : edges[block + 1]]
        residuals = residuals[np.isfinite(residuals)]
        if residuals.size:
            found[block] = np.median(np.abs(residuals)) / _MEDIAN
    there = np.isfinite(found)
    if not there.any():
        return np.zeros(left.size)
    found = np.maximum(found, np.median(found[there]) / 2)
    centres = (edges[:-1] + edges[1:] - 1) / 2
    return np.asarray(np.interp(np.arange(left.size), centres[there], found[there]))
