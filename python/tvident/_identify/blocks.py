"""Equations in blocks, as products of their columns: what unknowns of every block leave, and constants of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_FEWEST_BLOCKS = 12
"""Blocks of equations that tell how much a factor scatters."""

ROUNDING = 1e-12
"""Less than this part of the torque's squares is rounding."""

_BUFFERS = 256 << 20
"""Bytes that OpenBLAS takes at most when it is used first."""


@cache
def _start_blas() -> None:
    """Have OpenBLAS take its buffers once there is memory for them: where there is none it ends the process.

    Raises
    ------
    MemoryError
        If there is none.
    """
    np.empty(_BUFFERS, np.uint8)
    one = np.eye(2)
    np.linalg.lstsq(one, one @ np.linalg.solve(one, one), rcond=None)


def products(rows: Array, length: int) -> tuple[Array, Array] | None:
    """Return products of columns of norm one in every block of rows, and the norms; None where blocks are few.

    Products have the shape (records, blocks, columns, columns).
    """
    records, samples, columns = rows.shape
    blocks = samples // length
    if blocks < _FEWEST_BLOCKS:
        return None
    _start_blas()
    blocked = rows[:, : blocks * length].reshape(records, blocks, length, columns)
    found = np.swapaxes(blocked, -1, -2) @ blocked
    norms = np.sqrt(np.einsum("rbii->ri", found))
    norms = np.where(norms > 0, norms, 1.0)
    return found / (norms[:, np.newaxis, :, np.newaxis] * norms[:, np.newaxis, np.newaxis, :]), norms


def without(products: Array, places: Sequence[int]) -> Array:
    """Return products of what unknowns of every block leave of the columns."""
    if not places:
        return products
    inner = products[:, places][:, :, places]
    across = products[:, places]
    scale = np.trace(inner, axis1=1, axis2=2)[:, np.newaxis, np.newaxis]
    inner = inner + (ROUNDING * scale + np.finfo(float).tiny) * np.eye(len(places))
    return np.asarray(products - np.swapaxes(across, 1, 2) @ np.linalg.solve(inner, across))


def solved(total: Array, places: Sequence[int], rhs: int = -1) -> tuple[float, Array]:
    """Return what columns leave of the squares of another, and their factors."""
    normal, product = total[np.ix_(places, places)], total[places, rhs]
    values = np.linalg.lstsq(normal, product, rcond=1e-13)[0]
    return float(total[rhs, rhs] - product @ values), np.asarray(values, np.float64)
