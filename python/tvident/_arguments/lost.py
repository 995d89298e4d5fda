"""Tells times of a clock that lost samples from those that were printed with few digits: a channel moves on where samples are lost."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tvident._arguments.times import NotUniformError, times_of

Numbers = npt.NDArray[np.float64]

_EXACT = 1e-3
"""Of the usual step: how far steps may be from a whole number of it."""

_SIDES = (4, 2)
"""Samples on either side of a longer step that tell by how much a channel moves there; fewer where steps are longer more often."""

_MOST_PLACES = 1 << 12
"""Longer steps that are looked at."""

_LARGEST = 3.0
"""Of what lost samples move: more is a fault of the channel, such as a turn that was not counted, and counts no more."""

_CLEARLY = 0.1
"""Of the sum of squares of what a channel steps by: lost samples must leave less. Noise, or motion that is hardly sampled, leaves more."""


def check_no_lost_samples(t: npt.ArrayLike | None, channel: npt.NDArray[np.number]) -> None:
    """Refuse times as uniform that are so but for their digits, where a channel tells that samples are lost.

    Steps of 1 ms with one of 2 ms in 500 are those of 998 Hz in three digits, or of 1000 Hz with a sample lost in 500. In the first case
    a channel goes on evenly over the longer steps, in the second it moves twice as far. Where noise hides that it goes on evenly.

    Parameters
    ----------
    t : array_like, shape (n,), optional
        Times of the samples, which increase.
    channel : ndarray, shape (..., n)

    Raises
    ------
    NotUniformError
        If samples are lost.
    """
    if t is None or np.ndim(t) != 1:
        return
    times = np.asarray(times_of(t), dtype=np.float64)
    steps = np.diff(times)
    usual = float(np.median(steps)) if steps.size else 0.0
    if not usual > 0:
        return
    counts = np.rint(steps / usual)
    is_whole = np.abs(steps - counts * usual) <= max(_EXACT * usual, 4 * float(np.spacing(np.abs(times).max())))
    if not is_whole.all() or counts.min() < 1 or counts.max() == 1:
        return
    if any(_tells_lost(row, counts) for row in channel.reshape(-1, channel.shape[-1])):
        longest = int(counts.argmax()) + 1
        raise NotUniformError(
            f"t must be uniform; samples are lost before t[{longest}] = {times[longest]:g}; leave them missing (NaN) on a uniform grid",
            times,
        )


def _tells_lost(values: npt.NDArray[np.number], counts: Numbers) -> bool:
    """Return whether a channel moves on over longer steps as over so many usual ones."""
    longer = np.flatnonzero(counts > 1)
    cumulative = np.concatenate([[0], np.cumsum(counts > 1)])
    for side in _SIDES:
        inside = longer[(longer >= side - 1) & (longer + side < values.size)]
        # No other longer step among these samples.
        alone = inside[cumulative[inside + side] - cumulative[inside - side + 1] == 1]
        if 2 * alone.size >= longer.size:
            break
    if not alone.size:
        return False
    alone = alone[:: -(-alone.size // _MOST_PLACES)]
    around = values[alone[:, None] + np.arange(1 - side, side + 1)].astype(np.float64)
    is_there = np.isfinite(around).all(axis=1)
    around, lost = around[is_there], counts[alone][is_there] - 1
    # A curve, and a step in the middle: what it steps by is what was moved while samples were lost.
    number = np.arange(1 - side, side + 1) - 0.5
    rows = np.stack([np.ones_like(number), number, number > 0], axis=1).astype(np.float64)
    if side > min(_SIDES):
        rows = np.column_stack([rows, number**2, number**3])
    found = np.linalg.lstsq(rows, around.T, rcond=None)[0]
    moved = found[1] * lost
    stepped = np.clip(found[2], -_LARGEST * np.abs(moved), _LARGEST * np.abs(moved))
    return float(np.sum((stepped - moved) ** 2)) < _CLEARLY * float(np.sum(stepped**2))
