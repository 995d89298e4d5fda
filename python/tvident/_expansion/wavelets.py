"""Haar functions, and the scaling functions of Daubechies' wavelets."""

from __future__ import annotations

from functools import cache
from math import comb
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

_HALVINGS = 12
"""Scaling functions are tabulated at so many halvings of the distance between neighbours."""


def haar_values(places: Array, size: int, derivative: int) -> Array:
    """Return one, then steps up and down on ever shorter intervals, shape (places, size)."""
    if derivative:
        raise ValueError("Haar functions have no derivatives")
    found = np.ones((places.size, size))
    inside = np.minimum(places, np.nextafter(1.0, 0.0))
    for number in range(1, size):
        level = number.bit_length() - 1
        within = inside * 2.0**level - (number - 2**level)
        there = (within >= 0) & (within < 1)
        found[:, number] = np.where(there, np.where(within < 0.5, 1.0, -1.0) * 2.0 ** (level / 2), 0.0)  # noqa: PLR2004
    return found


def scaling_values(order: int, places: Array, size: int, derivative: int) -> Array:
    """Return shifted scaling functions of Daubechies' wavelets with so many vanishing moments, shape (places, size).

    On cells of which a power of two fits into the interval they span what the wavelets down to that scale span, and
    stay well conditioned where these are cut at the ends.
    """
    if derivative:
        raise ValueError("derivatives of Daubechies' functions are not continuous")
    table, reach = _scaling_table(order), 2 * order - 1
    cells = size - reach + 1
    # Function k begins k cells after the interval does, the first before it.
    within = places[:, np.newaxis] * cells - np.arange(1 - reach, cells)
    return np.interp(within, np.linspace(0, reach, table.size), table, left=0.0, right=0.0)


@cache
def daubechies_filter(order: int) -> Array:
    """Return the filter of a scaling function with so many vanishing moments, of sum one (Daubechies 1988).

    Half of the roots of the polynomial that all such filters share are inside the unit circle; these give the filter of least delay.
    """
    share = np.array([comb(order - 1 + k, k) for k in range(order)], dtype=np.float64)
    filter_ = np.array([1.0])
    for _ in range(order):
        filter_ = np.convolve(filter_, [0.5, 0.5])
    for root in np.roots(share[::-1]):
        # A root y of it stands for the roots z and 1/z of 4 y, which is two less z less one over z.
        middle = 1 - 2 * root
        outer = np.sqrt(middle**2 - 1 + 0j)
        z = middle + outer if abs(middle + outer) < 1 else middle - outer
        filter_ = np.convolve(filter_, np.array([1.0, -z]) / (1 - z))
    return np.ascontiguousarray(filter_.real)


@cache
def _scaling_table(order: int) -> Array:
    """Return a scaling function at even places of its support: at whole numbers as an eigenvector, between them by its equation."""
    filter_ = 2 * daubechies_filter(order)
    reach = filter_.size - 1
    whole = np.arange(1, reach)
    taps = 2 * whole[:, np.newaxis] - whole
    inside = (taps >= 0) & (taps <= reach)
    matrix = np.where(inside, filter_[np.clip(taps, 0, reach)], 0.0)
    eigenvalues, vectors = np.linalg.eig(matrix)
    middle = vectors[:, np.argmin(abs(eigenvalues - 1))].real
    table = np.concatenate([[0.0], middle / middle.sum(), [0.0]])
    for _ in range(_HALVINGS):
        # φ(x) = Σ h_k φ(2x - k): what is known at some places gives it halfway between them.
        spacing = (table.size - 1) // reach
        finer = np.zeros(2 * (table.size - 1) + 1)
        for tap, factor in enumerate(filter_):
            # The place i of the finer table is 2x = i of the coarser one.
            shifted = np.arange(finer.size) - tap * spacing
            there = (shifted >= 0) & (shifted < table.size)
            finer[there] += factor * table[shifted[there]]
        table = finer
    return table
