"""Finds stretches of samples that have a flag."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


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
