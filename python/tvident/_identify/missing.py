"""Values that are missing: what becomes of the numbers around them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._status import Status


def missing(*channels: npt.NDArray[Any]) -> npt.NDArray[np.bool_] | None:
    r"""Return where any of some channels of one shape holds no finite number, or None if none does anywhere.

    Parameters
    ----------
    *channels : ndarray, shape (\*, n)

    Returns
    -------
    ndarray of bool, shape (\*, n), or None
    """
    holes = [
        ~np.isfinite(channel) for channel in channels if channel.dtype.kind == "f" and not np.isfinite(channel).all()
    ]
    return np.logical_or.reduce(holes) if holes else None


def windows_that_hold(holes: npt.NDArray[np.bool_], before: int, after: int, step: int) -> npt.NDArray[np.bool_]:
    """Return for every `step`-th sample whether a hole lies at most `before` samples before or `after` samples after it.

    Parameters
    ----------
    holes : ndarray of bool, shape (n,)
    before, after : int
        Samples.
    step : int
        Samples.

    Returns
    -------
    ndarray of bool, shape (ceil(n / step),)
    """
    n = holes.size
    counted = np.concatenate(([0], np.cumsum(holes)))
    samples = np.arange(0, n, step)
    return np.asarray(counted[np.minimum(samples + after + 1, n)] > counted[np.maximum(samples - before, 0)])


def propagate(found: Any, holes: npt.NDArray[np.bool_], lengths: list[tuple[int, int]], step: int) -> None:
    r"""Take the numbers away whose windows hold a hole, but for constants, whose window is the record.

    Parameters
    ----------
    found : Collected
        What was found; changed.
    holes : ndarray of bool, shape (\*, n)
    lengths : list of (int, int)
        By record, samples of the window that makes an equation, and of the one whose equations are solved together.
    step : int
        Every how many samples there is a number.
    """
    records = holes.reshape(-1, holes.shape[-1])
    each = []
    for record, (length, rows) in zip(records, lengths, strict=True):
        half = length // 2
        each.append(windows_that_hold(record, half + rows // 2, half + rows - rows // 2 - 1, step))
    hit = np.stack(each).reshape(found.status.shape)
    changing = [name for name in found.values if name not in found.constants]
    if not changing:
        return
    for table in (found.values, found.errors):
        for name in changing:
            table[name] = np.where(hit, np.nan, table[name])
    found.residual_std, found.condition = (np.where(hit, np.nan, one) for one in (found.residual_std, found.condition))
    found.status = np.where(hit, found.status | np.uint16(Status.INVALID | Status.GAP), found.status)
