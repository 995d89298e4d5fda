"""Finds samples that have a flag, and stretches of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._status.flags import Status


def untold_samples(status: npt.NDArray[np.uint16]) -> npt.NDArray[np.bool_]:
    """Return the samples whose values hardly anything tells: ILL_CONDITIONED, but for invalid ones, which have no value.

    Examples
    --------
    >>> untold_samples(np.array([0, 128, 129], np.uint16)).tolist()
    [False, True, False]
    """
    asked = np.uint16(Status.ILL_CONDITIONED | Status.INVALID)
    return np.asarray(status & asked == Status.ILL_CONDITIONED)


def stretches_of(flag: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return where stretches of flagged samples begin, and the samples behind their ends.

    Examples
    --------
    >>> first, end = stretches_of(np.array([True, False, True, True]))
    >>> first.tolist(), end.tolist()
    ([0, 2], [1, 4])
    """
    edges: Any = np.flatnonzero(flag[1:] != flag[:-1]) + 1
    if flag.size and flag[0]:
        edges = np.append(0, edges)
    if flag.size and flag[-1]:
        edges = np.append(edges, flag.size)
    return edges[::2], edges[1::2]
