"""Parameters that are tracked from sample to sample: recursive least squares with forgetting, Kalman's filter and its smoother."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments

Array: TypeAlias = npt.NDArray[np.float64]

_VAGUE = 1e6
"""Standard deviations of parameters before the first row, in units of their sizes."""


class Tracked(NamedTuple):
    """Parameters at every row.

    Attributes
    ----------
    values, stderr : ndarray, shape (n, p)

    See Also
    --------
    recursive_least_squares, random_walk_smoother, expanded_least_squares, tvarx : return it.

    References
    ----------
    L. Ljung: System Identification: Theory for the User, 2nd edition, Prentice Hall 1999.

    Examples
    --------
    >>> import numpy as np
    >>> from tvident import baselines
    >>> rows = np.random.default_rng(0).standard_normal((50, 2))
    >>> values, stderr = baselines.recursive_least_squares(rows, rows @ [2.0, 3.0])
    >>> values.shape == stderr.shape == (50, 2)
    True
    """

    values: Array
    stderr: Array


@np.errstate(all="ignore")  # small numbers may leave the range of doubles
def recursive_least_squares(regressors: npt.ArrayLike, rhs: npt.ArrayLike, *, forgetting: float = 0.99) -> Tracked:
    """Return least squares of the past, in which every row counts less the older it is.

    Parameters
    ----------
    regressors : array_like, shape (n, p)
    rhs : array_like, shape (n,)
    forgetting : float, optional
        What a row is worth of the next one: by hand.

    Returns
    -------
    Tracked
        Errors are those of rows with independent noise, from weighted residuals.

    Raises
    ------
    ValueError
        If shapes do not fit, or the forgetting is not between 0 and 1.

    See Also
    --------
    random_walk_smoother : looks both ways.
    tvident.rolling_least_squares : windows, which look both ways too.

    References
    ----------
    L. Ljung: System Identification: Theory for the User, 2nd edition, Prentice Hall 1999, section 11.2.

    Examples
    --------
    >>> import numpy as np
    >>> from tvident.baselines import recursive_least_squares
    >>> rows = np.random.default_rng(0).standard_normal((300, 2))
    >>> changing = np.where(np.arange(300) < 150, 2.0, 5.0)
    >>> found = recursive_least_squares(rows, rows[:, 0] * changing + 3 * rows[:, 1], forgetting=0.9)
    >>> found.values[[149, 299]].round(2)
    array([[2., 3.],
           [5., 3.]])
    """
    design, right = rows_of_numbers(regressors, rhs)
    forgetting = arguments.finite_number("forgetting", forgetting, least=1e-6, most=1)
    scale = _scales(design)
    size = design.shape[1]
    spread, now = np.eye(size) * _VAGUE**2, np.zeros(size)
    values, errors = np.full(design.shape, np.nan), np.full(design.shape, np.nan)
    misfit, weight = 0.0, 0.0
    for row, (regressor, target) in enumerate(zip(design / scale, right, strict=True)):
        moved = spread @ regressor
        gain = moved / (forgetting + regressor @ moved)
        error = target - regressor @ now
        now = now + gain * error
        spread = (spread - np.outer(gain, moved)) / forgetting
        spread = (spread + spread.T) / 2
        misfit = forgetting * misfit + error * (target - regressor @ now)
        weight = forgetting * weight + 1
        values[row] = now / scale
        if weight > size:
            variance = max(misfit / (weight - size), 0.0)
            errors[row] = np.sqrt(np.maximum(np.diag(spread), 0) * variance * (1 + forgetting) / 2) / scale
    return Tracked(values, errors)


@np.errstate(all="ignore")  # small numbers may leave the range of doubles
def random_walk_smoother(
    regressors: npt.ArrayLike, rhs: npt.ArrayLike, *, steps: npt.ArrayLike, noise: float
) -> Tracked:
    """Return the mean of parameters that walk at random, from all rows: Kalman's filter, and back with Rauch, Tung and Striebel.

    Parameters
    ----------
    regressors : array_like, shape (n, p)
    rhs : array_like, shape (n,)
    steps : array_like, shape (p,)
        Standard deviation of a parameter's step from row to row; 0 for a constant. By hand.
    noise : float
        Standard deviation of the right-hand side.

    Returns
    -------
    Tracked

    Raises
    ------
    ValueError
        If shapes do not fit, or the noise is not positive.

    See Also
    --------
    recursive_least_squares : of the past alone.
    tvident.rolling_least_squares : windows, which look both ways too.

    References
    ----------
    R. E. Kalman: A new approach to linear filtering and prediction problems, Journal of Basic Engineering 82 (1960).
    H. E. Rauch, F. Tung, C. T. Striebel: Maximum likelihood estimates of linear dynamic systems, AIAA Journal 3 (1965).

    Examples
    --------
    >>> import numpy as np
    >>> from tvident.baselines import random_walk_smoother
    >>> rows = np.random.default_rng(0).standard_normal((300, 2))
    >>> changing = np.linspace(2, 5, 300)
    >>> found = random_walk_smoother(rows, rows[:, 0] * changing + 3 * rows[:, 1], steps=[0.01, 0], noise=0.001)
    >>> bool(np.abs(found.values[:, 0] - changing).max() < 0.05), found.values[0, 1].round(2).item()
    (True, 3.0)
    """
    design, right = rows_of_numbers(regressors, rhs)
    scale = _scales(design)
    each = arguments.any_array("steps", steps).astype(np.float64)
    if each.shape != design.shape[1:] or not (np.abs(each) <= arguments.LARGEST).all():
        raise ValueError(
            f"steps must be one for each of {design.shape[1]} parameters; got shape {each.shape}; give 0 for constants"
        )
    walk = np.diag((each * scale) ** 2)
    variance = arguments.positive_number("noise", noise, most=arguments.LARGEST) ** 2
    count, size = design.shape
    means, spreads = np.empty((count, size)), np.empty((count, size, size))
    now, spread = np.zeros(size), np.eye(size) * (_VAGUE * np.sqrt(variance)) ** 2
    for row, (regressor, target) in enumerate(zip(design / scale, right, strict=True)):
        spread = spread + walk
        moved = spread @ regressor
        gain = moved / (variance + regressor @ moved)
        now = now + gain * (target - regressor @ now)
        # Joseph's form stays positive.
        kept = np.eye(size) - np.outer(gain, regressor)
        spread = kept @ spread @ kept.T + variance * np.outer(gain, gain)
        means[row], spreads[row] = now, spread
    for row in range(count - 2, -1, -1):
        try:
            back = np.linalg.solve(spreads[row] + walk, spreads[row]).T
        except np.linalg.LinAlgError:
            raise ValueError(
                f"noise must be large enough for the digits of numbers; got {noise:g}; give that of the right-hand side"
            ) from None
        means[row] += back @ (means[row + 1] - means[row])
        spreads[row] += back @ (spreads[row + 1] - spreads[row] - walk) @ back.T
    errors = np.sqrt(np.maximum(np.einsum("ijj->ij", spreads), 0))
    return Tracked(means / scale, errors / scale)


def rows_of_numbers(regressors: npt.ArrayLike, rhs: npt.ArrayLike) -> tuple[Array, Array]:
    """Return regressors and right-hand sides, checked."""
    design = arguments.any_array("regressors", regressors).astype(np.float64)
    right = arguments.any_array("rhs", rhs).astype(np.float64)
    if design.ndim != 2 or right.shape != design.shape[:1] or not right.size:  # noqa: PLR2004 - rows and columns
        raise ValueError(
            f"regressors must be of shape (n, p) and the right-hand side (n,); got {design.shape} and {right.shape}; transpose them"
        )
    for name, one in (("regressors", design), ("rhs", right)):
        if not (np.abs(one) <= arguments.LARGEST).all():
            raise ValueError(
                f"{name} must hold finite numbers of at most {arguments.LARGEST:g}; got others; leave these rows out"
            )
    return design, right


def _scales(design: Array) -> Array:
    """Return the root mean square of every column: numbers of one size keep their digits."""
    scale = np.sqrt(np.mean(design**2, axis=0))
    return np.where(scale > 0, scale, 1.0)
