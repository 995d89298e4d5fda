"""SciPy's Savitzky–Golay filter, faster and exact, and with an order chosen in every window."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._derivatives.plans import HIGHEST_ORDER, plan
from tvident._tables import shaped, without_unit

Mode: TypeAlias = Literal["interp", "mirror", "constant", "nearest", "wrap"]


_PART = 1 << 18
"""Samples copied at a time: about a millisecond."""

_LONGEST_PADDED = 100_001
"""Samples of a window that may always reach beyond the record, however short it is."""


def _mirrored(places: npt.NDArray[np.intp], count: int) -> npt.NDArray[np.intp]:
    """Return the samples that lie at places beyond the record where it is mirrored at its first and last sample."""
    folded = places % max(1, 2 * count - 2)
    return np.minimum(folded, 2 * count - 2 - folded)


_INSIDE: dict[str, Callable[[npt.NDArray[np.intp], int], npt.NDArray[np.intp]]] = {
    "mirror": _mirrored,
    "nearest": lambda places, count: np.clip(places, 0, count - 1),
    "wrap": lambda places, count: places % count,
}
"""Which samples of the record are taken for places beyond it."""


# SciPy's parameters.
@arguments.called_as("savgol_filter(x, 51, 3)")
def savgol_filter(
    x: npt.ArrayLike,
    window_length: int,
    polyorder: int | Literal["aicc"],
    deriv: int = 0,
    delta: float = 1.0,
    axis: int = -1,
    mode: Mode = "interp",
    cval: float = 0.0,
    *,
    period: float | None = None,
) -> Any:
    """Filter with :func:`scipy.signal.savgol_filter`'s call and results.

    A drop-in replacement: even windows, all modes, float32 in and out. It is exact where SciPy's coefficients are not (their least
    squares in raw powers fail from order 7 on at 201 samples) and takes the same time for any window.

    Parameters
    ----------
    x : array_like
        Samples, of any shape and unit. Float32 stays float32, any other real type becomes float64. Masked ones
        are NaN. A table (pandas, polars, a structured array) has time along its rows, and every column is filtered.
    window_length : int
        Samples in a window, odd or even. With an even window the result belongs half a sample later, as in SciPy.
    polyorder : int or "aicc"
        Order of the polynomial, less than `window_length`, at most 15; or ``"aicc"``: chosen in every window by the Akaike information
        criterion as in :func:`fit_local_polynomials`.
    deriv : int, optional
        Derivative wanted, 0 for the smoothed samples. Above the order it is zero.
    delta : float, optional
        Sample period in seconds.
    axis : int, optional
        Axis of time; where it is left out, the dimension of xarray that is called ``time`` or has dates.
    mode : {"interp", "mirror", "constant", "nearest", "wrap"}, optional
        What is taken beyond the ends. ``"interp"`` extends nothing but evaluates the first and last full window off its centre.
    cval : float, optional
        Value beyond the ends for ``"constant"``.
    period : float, optional
        Period of a wrapped angle in the unit of `x`, which is unwrapped first as in :func:`fit_local_polynomials`.

    Returns
    -------
    ndarray, same shape as `x`, or the container that `x` is, with its index, coordinates and attributes
        Filtered samples, in the unit of `x` per second to the power of `deriv`. Windows that hold a value that is no finite number are
        NaN, and no others.

    Raises
    ------
    ValueError
        If the window is longer than the record with mode ``"interp"``, or longer than twice the record and than 100 001 samples with
        another, `polyorder` is not less than `window_length` or above 15, a mode is unknown, or `x` spans more than one and a half of
        `period`.
    TypeError
        If `x` is complex or holds no numbers.

    Notes
    -----
    Equation (2) of the paper with a fixed order. The cost is a few ns a sample at any window length, and more where the order is
    chosen: see :func:`fit_local_polynomials`.

    See Also
    --------
    fit_local_polynomials : all derivatives at once, with standard errors and a status.
    scipy.signal.savgol_filter : whose call and results these are.

    References
    ----------
    A. Savitzky, M. J. E. Golay: Smoothing and differentiation of data by simplified least squares procedures, Analytical Chemistry 36
    (1964).

    Examples
    --------
    >>> import numpy as np
    >>> from tvident import savgol_filter
    >>> np.round(savgol_filter([2, 2, 5, 2, 1, 0, 1, 4, 9], 5, 2), 2)
    array([1.66, 3.17, 3.54, 2.86, 0.66, 0.17, 1.  , 4.  , 9.  ])
    """
    arguments.one_of("mode", mode, get_args(Mode))
    given = shaped("x", x, axis)
    array, axis = given.array, given.axis
    samples = arguments.along_axis("x", array, axis)
    length = arguments.whole_number("window_length", window_length, least=1)
    chosen = arguments.is_word(polyorder, "aicc")
    if isinstance(polyorder, str) and not chosen:
        raise ValueError(
            f"polyorder must be a whole number or 'aicc'; got {arguments.shown(polyorder)}; use one of these"
        )
    order = None if chosen else arguments.whole_number("polyorder", polyorder, least=0)
    if order is not None and order >= length:
        raise ValueError(
            f"polyorder must be less than window_length; got {order} for {length} samples; lower the order"
        )
    if order is not None and order > HIGHEST_ORDER:
        raise ValueError(
            f"polyorder must be at most {HIGHEST_ORDER}; got {order}; polynomials of a higher order do more harm than good: "
            "shorten the window"
        )
    ends = mode == "interp"
    if ends:
        arguments.check_window("window_length", length, samples.shape[-1])
    else:
        _check_padded_window(length, samples.shape[-1])
    if period is not None:
        samples = arguments.unwrapped("x", samples, period).values
    derivative, seconds = _derivative(deriv, delta, HIGHEST_ORDER if order is None else order)
    beyond = arguments.real_number("cval", cval)
    core_plan = plan(length, order=order, derivatives=(derivative,), delta=seconds, noise=False)
    if not ends:
        samples = _padded(samples.astype(np.float64, copy=False), length, mode, beyond)
    derivatives = core_plan.estimate(samples, ends=ends, workers=arguments.worker_count(None)).derivatives
    filtered: npt.NDArray[Any] = derivatives[0] if samples.ndim == 1 else np.moveaxis(derivatives[0], -1, axis)
    if array.dtype == np.float32:
        with np.errstate(all="ignore"):
            filtered = filtered.astype(np.float32)
    made = given.again(filtered)
    return without_unit(made) if derivative > 0 else made


def _derivative(deriv: int, delta: float, order: int) -> tuple[int, float]:
    """Return which derivative tables are made for, and for which sample period."""
    wanted, period = arguments.whole_number("deriv", deriv, least=0), arguments.positive_number("delta", delta)
    if wanted > order:
        # All of them are zero, in any unit of time.
        return order + 1, 1.0
    arguments.check_power("deriv", wanted, period)
    return wanted, period


def _check_padded_window(length: int, samples: int) -> None:
    """Check that a window which may reach beyond the record is not longer by far."""
    most = max(_LONGEST_PADDED, 2 * samples + 1)
    if length > most:
        raise ValueError(
            f"window_length must be at most {most} for a record of {samples} samples; got {length}; shorten it: from twice the record on "
            "all windows hold the same samples"
        )


def _padded(samples: npt.NDArray[np.float64], length: int, mode: str, cval: float) -> npt.NDArray[np.float64]:
    """Return the samples with half a window more at either end, copied in parts so that Ctrl-C is heard in between."""
    before, after, count = (length - 1) // 2, length // 2, samples.shape[-1]
    padded = np.empty((*samples.shape[:-1], before + count + after))
    for first in range(0, count, _PART):
        part = samples[..., first : first + _PART]
        padded[..., before + first : before + first + part.shape[-1]] = part
    for beyond in (np.arange(-before, 0), np.arange(count, count + after)):
        padded[..., beyond + before] = cval if mode == "constant" else samples[..., _INSIDE[mode](beyond, count)]
    return padded
