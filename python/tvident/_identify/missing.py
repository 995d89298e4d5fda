"""Values that are missing: what becomes of the numbers around them."""

from __future__ import annotations

from collections.abc import Sequence
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


def propagate_missing(found: Sequence[Any], holes: npt.NDArray[np.bool_], step: int) -> None:
    r"""Take the numbers away whose windows hold a hole, but for constants, whose window is the record.

    Parameters
    ----------
    found : sequence of Identified
        One a record; changed.
    holes : ndarray of bool, shape (\*, n)
    step : int
        Every how many samples there is a number.
    """
    for record, one in zip(holes.reshape(-1, holes.shape[-1]), found, strict=True):
        changing = [unknown for unknown in one.unknowns if unknown.kind != "constant"]
        if not changing:
            continue
        half, rows = one.window_length // 2, one.regression_window
        hit = windows_that_hold(record, half + rows // 2, half + rows - rows // 2 - 1, step)
        for unknown in changing:
            unknown.values = np.where(hit, np.nan, unknown.values)
            unknown.stderr = np.where(hit, np.nan, unknown.stderr)
        one.residual_std, one.condition = (np.where(hit, np.nan, each) for each in (one.residual_std, one.condition))
        one.status = np.where(hit, one.status | np.uint16(Status.INVALID | Status.GAP), one.status)
