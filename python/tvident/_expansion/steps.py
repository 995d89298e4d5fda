"""What functions that are constant in cells leave of a curve that changes within these: part of its errors at a place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.basis import Basis

Array: TypeAlias = npt.NDArray[np.float64]

_OF_A_LINE = 1 / 12
"""The mean square of what a line leaves around its mean in a cell, over the square of its change there."""


def variance_of_steps(basis: Basis, factors: Array, root: Array, places: Sequence[Array]) -> Array | float:
    """Return the mean square by which a curve leaves its steps around some places: zero for functions without steps.

    Within a cell the curve changes as from one cell to the next: the smaller of both changes where they have one sign, so that a jump
    between level parts adds nothing, less what noise makes of it.
    """
    added: Array | float = 0.0
    for number, (family, size) in enumerate(zip(basis.families, basis.sizes, strict=True)):
        cells = family.cells(size)
        if cells > 1:
            added = added + _OF_A_LINE * _change(basis, factors, root, places, number, cells) ** 2
    return added


def _change(basis: Basis, factors: Array, root: Array, places: Sequence[Array], number: int, cells: int) -> Array:
    """Return the change of a curve within the cells of one of its coordinates."""
    own = basis.at(places)
    # As functions find it: the upper limit belongs to the last cell.
    cell = np.floor(places[number] * cells).clip(0, cells - 1)
    changes, noises = [], []
    for step in (-1, 1):
        other = cell + step
        is_inside = (other >= 0) & (other < cells)
        middle = (other.clip(0, cells - 1) + 0.5) / cells
        beside = basis.at([middle if one == number else place for one, place in enumerate(places)]) - own
        changes.append(np.where(is_inside, step * (beside @ factors), np.nan))
        noises.append(np.where(is_inside, ((beside @ root) ** 2).sum(axis=1), np.nan))
    # Beyond the first and the last cell there is none: the change on the other side stands for both.
    before, behind = (np.where(np.isnan(one), other, one) for one, other in (changes, changes[::-1]))
    noise = sum(np.where(np.isnan(one), other, one) for one, other in (noises, noises[::-1])) / 2
    smaller = np.where(np.abs(before) < np.abs(behind), before, behind)
    square = np.where(before * behind > 0, smaller**2, 0.0) - noise
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))
