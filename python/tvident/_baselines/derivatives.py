"""Derivatives with a setting by hand: a projection of the whole record, differentiation by integration, fixed orders."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from numpy.polynomial import chebyshev, legendre

from tvident import _arguments as arguments
from tvident._derivatives import savgol_filter

Array: TypeAlias = npt.NDArray[np.float64]

_ORDERS = 3
"""The samples themselves, and two derivatives."""

_PIECE = 1 << 14


@np.errstate(all="ignore")  # what leaves the range of doubles is not known
def chebyshev_derivatives(samples: npt.ArrayLike, size: int, *, delta: float) -> Array:
    """Return a record and two derivatives from its projection on Chebyshev polynomials over its whole length.

    Parameters
    ----------
    samples : array_like, shape (n,)
    size : int
        How many polynomials: by hand.
    delta : float
        Sample period in seconds.

    Returns
    -------
    ndarray of float64, shape (3, n)

    Raises
    ------
    ValueError
        If there are more polynomials than samples.

    See Also
    --------
    lanczos_derivatives, savgol_derivatives : of windows, with a setting by hand too.
    tvident.fit_local_polynomials : chooses what is set by hand here.

    References
    ----------
    L. N. Trefethen: Approximation Theory and Approximation Practice, SIAM 2013.

    Examples
    --------
    >>> import numpy as np
    >>> from tvident.baselines import chebyshev_derivatives
    >>> t = np.arange(400) * 0.01
    >>> found = chebyshev_derivatives(t**3, 4, delta=0.01)
    >>> bool(np.allclose(found[2], 6 * t))
    True
    """
    record = _one_record(samples)
    arguments.whole_number("size", size, least=1)
    if size > record.size:
        raise ValueError(f"size must be at most the {record.size} samples; got {size}; take fewer polynomials")
    period = arguments.positive_number("delta", delta)
    x = np.linspace(-1, 1, record.size)
    factor = np.zeros((0, size + 1))
    for first in range(0, record.size, _PIECE):
        some = slice(first, first + _PIECE)
        design = np.column_stack([chebyshev.chebvander(x[some], size - 1), record[some]])
        factor = np.asarray(np.linalg.qr(np.concatenate([factor, design]), mode="r"), np.float64)
    found = np.linalg.solve(factor[:size, :size], factor[:size, size])
    scale = np.float64(2) / (period * (record.size - 1))
    return np.stack([chebyshev.chebval(x, chebyshev.chebder(found, d)) * scale**d for d in range(_ORDERS)])


@np.errstate(all="ignore")  # what leaves the range of doubles is not known
def lanczos_derivatives(samples: npt.ArrayLike, window_length: int, *, delta: float) -> Array:
    """Return a record and two derivatives by integrals with Legendre polynomials (Lanczos): f′ is about 3/(2h³) ∫ t f(x + t) dt.

    Parameters
    ----------
    samples : array_like, shape (n,)
    window_length : int
        Odd: by hand.
    delta : float
        Sample period in seconds.

    Returns
    -------
    ndarray of float64, shape (3, n)
        NaN within half a window of the ends.

    Raises
    ------
    ValueError
        If the window is even or longer than the record.

    See Also
    --------
    chebyshev_derivatives, savgol_derivatives : with a setting by hand too.
    tvident.fit_local_polynomials : chooses what is set by hand here.

    References
    ----------
    C. Lanczos: Applied Analysis, Prentice Hall 1956.
    C. W. Groetsch: Lanczos' generalized derivative, American Mathematical Monthly 105 (1998).

    Examples
    --------
    >>> import numpy as np
    >>> from tvident.baselines import lanczos_derivatives
    >>> t = np.arange(400) * 0.01
    >>> found = lanczos_derivatives(t**2, 21, delta=0.01)
    >>> bool(np.allclose(found[1, 10:-10], 2 * t[10:-10]))
    True
    >>> int(np.isnan(found[1]).sum())
    20
    """
    record = _one_record(samples)
    period = arguments.positive_number("delta", delta)
    length = arguments.window_length("window_length", window_length, period, odd=True)
    arguments.check_window("window_length", length, record.size, least=3)
    half = length // 2
    x = np.arange(-half, half + 1) / half
    found = np.full((_ORDERS, record.size), np.nan)
    for order in range(_ORDERS):
        kernel = legendre.legval(x, np.eye(_ORDERS)[order])
        kernel = kernel - np.mean(kernel) if order else kernel
        # Scaled so that the power of this order has its derivative, whatever the sums leave of the integrals.
        kernel = kernel / np.sum(kernel * (x * half * period) ** order / [1, 1, 2][order])
        found[order, half : record.size - half] = np.correlate(record, kernel, mode="valid")
    return found


def savgol_derivatives(samples: npt.ArrayLike, window_length: int, polyorder: int, *, delta: float) -> Array:
    """Return a record and two derivatives by the Savitzky–Golay filter of a fixed order.

    Parameters
    ----------
    samples : array_like, shape (n,)
    window_length, polyorder : int
        By hand.
    delta : float
        Sample period in seconds.

    Returns
    -------
    ndarray of float64, shape (3, n)

    Raises
    ------
    ValueError
        As :func:`tvident.savgol_filter`.

    See Also
    --------
    tvident.savgol_filter : one derivative, with the order chosen in every window if asked for.
    chebyshev_derivatives, lanczos_derivatives : with a setting by hand too.

    References
    ----------
    A. Savitzky, M. J. E. Golay: Smoothing and differentiation of data by simplified least squares procedures, Analytical Chemistry 36
    (1964).

    Examples
    --------
    >>> import numpy as np
    >>> from tvident.baselines import savgol_derivatives
    >>> t = np.arange(400) * 0.01
    >>> found = savgol_derivatives(t**3, 31, 3, delta=0.01)
    >>> bool(np.allclose(found[2], 6 * t))
    True
    """
    return np.stack([savgol_filter(samples, window_length, polyorder, deriv=d, delta=delta) for d in range(_ORDERS)])


def _one_record(samples: npt.ArrayLike) -> Array:
    """Return the samples of one record."""
    record = np.asarray(arguments.channel("samples", samples), np.float64)
    if record.ndim != 1:
        raise ValueError(f"samples must be one record; got shape {record.shape}; take one of them")
    return record
