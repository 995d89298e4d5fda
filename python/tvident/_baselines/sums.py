"""Parameters as sums of functions with sizes by hand, from rows with derivatives: ordinary least squares."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._baselines.recursive import Tracked, rows_of_numbers
from tvident._expansion import Expansion

Array: TypeAlias = npt.NDArray[np.float64]


def expanded_least_squares(
    regressors: npt.ArrayLike, rhs: npt.ArrayLike, *, family: str, sizes: npt.ArrayLike
) -> Tracked:
    """Return parameters that are sums of functions of time, by ordinary least squares of all rows.

    Parameters
    ----------
    regressors : array_like, shape (n, p)
    rhs : array_like, shape (n,)
    family : str
        Of :class:`tvident.Expansion`.
    sizes : array_like of int, shape (p,)
        How many functions each parameter has; 1 for a constant. By hand.

    Returns
    -------
    Tracked
        Errors are those of rows with independent noise.

    Raises
    ------
    ValueError
        If a family is unknown, or shapes do not fit.

    See Also
    --------
    tvident.Expansion : sums of functions whose sizes are chosen.
    tvarx : polynomials of time within windows.

    References
    ----------
    H. L. Wei, S. A. Billings: Identification of time-varying systems using multiresolution wavelet models, International Journal of
    Systems Science 33 (2002): a factor that changes, as a sum of functions of time, makes a regression with constants.

    Examples
    --------
    >>> import numpy as np
    >>> from tvident.baselines import expanded_least_squares
    >>> rows = np.random.default_rng(0).standard_normal((500, 2))
    >>> changing = 1 + 0.5 * np.linspace(-1, 1, 500) ** 2
    >>> found = expanded_least_squares(rows, 3 * rows[:, 0] + changing * rows[:, 1], family="chebyshev", sizes=[1, 3])
    >>> bool(np.allclose(found.values[:, 0], 3)), bool(np.allclose(found.values[:, 1], changing))
    (True, True)
    """
    design, right = rows_of_numbers(regressors, rhs)
    each = [arguments.whole_number("sizes", one, least=1) for one in np.ravel(np.asarray(sizes, object))]
    if len(each) != design.shape[1]:
        raise ValueError(
            f"sizes must be one for each column of regressors; got {len(each)} for {design.shape}; give 1 for constants"
        )
    functions = Expansion(family).families[0]
    places = np.linspace(0, 1, right.size)
    values = [functions.values(places, size, 0) if size > 1 else np.ones((right.size, 1)) for size in each]
    matrix = np.concatenate([one * column[:, np.newaxis] for one, column in zip(values, design.T, strict=True)], axis=1)
    norm = np.linalg.norm(matrix, axis=0)
    norm = np.where(norm > 0, norm, 1.0)
    factor, _, rank, _ = np.linalg.lstsq(matrix / norm, right, rcond=None)
    left = right - matrix / norm @ factor
    inverse = np.linalg.pinv((matrix / norm).T @ (matrix / norm)) * (left @ left) / max(1, right.size - int(rank))
    found, errors = np.empty(design.shape), np.empty(design.shape)
    first = 0
    for column, one in enumerate(values):
        place = slice(first, first + one.shape[1])
        first += one.shape[1]
        found[:, column] = one @ (factor[place] / norm[place])
        scaled = one / norm[place]
        errors[:, column] = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", scaled, inverse[place, place], scaled), 0))
    return Tracked(found, errors)
