"""Tells times of a clock that lost samples from those that were printed with few digits: a channel moves on where samples are lost."""

from __future__ import annotations

from functools import partial

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
    a channel goes on evenly over the longer steps, in the second it moves twice as far. Where noise or fast motion hides which of both it
    is, times count as uniform.

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
    if _tell_lost(channel.reshape(-1, channel.shape[-1]), counts):
        longest = int(counts.argmax()) + 1
        raise NotUniformError(partial(_lost_before, longest, float(times[longest])), times)


def _lost_before(sample: int, time: float) -> str:
    """Return what to say of times between which samples are lost."""
    return (
        f"t must be uniform; samples are lost before t[{sample}] = {time:g}; leave them missing (NaN) on a uniform grid"
    )


def _tell_lost(channels: npt.NDArray[np.number], counts: Numbers) -> bool:
    """Return whether channels move on over longer steps as over so many usual ones, and not so where no step is longer."""
    longer = np.flatnonzero(counts > 1)
    cumulative = np.concatenate([[0], np.cumsum(counts > 1)])

    def beside(places: npt.NDArray[np.intp], side: int, many: int) -> npt.NDArray[np.intp]:
        """Return places among whose samples so many steps are longer."""
        inside = places[(places >= side - 1) & (places + side < channels.shape[-1])]
        found: npt.NDArray[np.intp] = inside[cumulative[inside + side] - cumulative[inside - side + 1] == many]
        return found

    for side in _SIDES:
        alone = beside(longer, side, 1)
        if 2 * alone.size >= longer.size:
            break
    if not alone.size:
        return False
    alone = alone[:: -(-alone.size // _MOST_PLACES)]
    for usual_side in (side, min(_SIDES)):
        usual = beside(np.arange(channels.shape[-1]), usual_side, 0)
        if usual.size:
            break
    if not usual.size:
        return False
    usual = usual[:: -(-usual.size // _MOST_PLACES)]
    lost = counts[alone] - 1
    left, uneven = [], []
    for values in channels:
        stepped, slope = _steps(values, alone, side)
        moved = slope * lost
        stepped = np.clip(stepped, -_LARGEST * np.abs(moved), _LARGEST * np.abs(moved))
        beside_it, usual_slope = _steps(values, usual, usual_side)
        square, usual_square = float(np.nansum(stepped**2)), float(np.nansum(usual_slope**2))
        if square > 0 and usual_square > 0:
            left.append(float(np.nansum((stepped - moved) ** 2)) / square)
            uneven.append(float(np.nansum(beside_it**2)) / usual_square)
    # Motion that is hardly sampled, such as a fast tone, steps anywhere, and may so at every place alike.
    return bool(left) and bool(max(np.mean(left), np.mean(uneven)) < _CLEARLY)


def _steps(values: npt.NDArray[np.number], places: npt.NDArray[np.intp], side: int) -> tuple[Numbers, Numbers]:
    """Return by how much a channel steps at some places beside a curve through samples on either side, and the slope of that there."""
    number = np.arange(1 - side, side + 1) - 0.5
    rows = np.stack([np.ones_like(number), number, number > 0], axis=1).astype(np.float64)
    if side > min(_SIDES):
        rows = np.column_stack([rows, number**2, number**3])
    around = values[places[:, None] + np.arange(1 - side, side + 1)].astype(np.float64)
    with np.errstate(invalid="ignore"):  # what is infinite has no slope
        found = np.linalg.pinv(rows) @ around.T
    return found[2], found[1]
