"""Other sizes that explain a record nearly as well: by how much a curve depends on which was taken."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion.basis import Basis

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Rival:
    """A curve by functions of another size.

    Parameters
    ----------
    weight : float
        Akaike's, of all sizes that were tried; that of the size that was taken counts as any.
    basis : Basis
    factors : ndarray, shape (size,)
    root : ndarray, shape (size, k)
        A root of their covariance.
    """

    weight: float
    basis: Basis
    factors: Array
    root: Array

    def curve(self, functions: Array) -> tuple[Array, Array]:
        """Return the curve and its variance where functions have these values, shape (places, size)."""
        return functions @ self.factors, ((functions @ self.root) ** 2).sum(axis=1)


def scatter(rivals: Sequence[Rival], functions: Callable[[Basis], Array]) -> Array | float:
    """Return the variance that the choice of a size adds to a curve, of which the first of some rivals is the size that was taken.

    The variance of a weighted mean over sizes (Buckland, Burnham, Augustin 1997), around the curve that was taken. Functions of a basis
    are those at the places that are asked for.
    """
    if len(rivals) <= 1:
        return 0.0
    curves = [one.curve(functions(one.basis)) for one in rivals]
    taken, variance = curves[0]
    total = np.zeros(taken.size)
    for one, (values, other) in zip(rivals[1:], curves[1:], strict=True):
        total += one.weight * ((values - taken) ** 2 + np.maximum(other - variance, 0))
    return total
