"""SciPy's Savitzky–Golay filter, faster and exact, and with an order chosen in every window."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._derivatives.plans import HIGHEST_ORDER, plan

Mode: TypeAlias = Literal["interp", "mirror", "constant", "nearest", "wrap"]


# What NumPy calls SciPy's modes.
# Samples copied at a time: about a millisecond.
_PART = 1 << 18

_PADDING: dict[str, Literal["reflect", "edge", "wrap"]] = {"mirror": "reflect", "nearest": "edge", "wrap": "wrap"}


# SciPy's parameters.
def savgol_filter(
    x: npt.ArrayLike,
    window_length: int,
    polyorder: int | Literal["aicc"],
    deriv: int = 0,
    delta: float = 1.0,
    axis: int = -1,
    mode: Mode = "interp",
    cval: float = 0.0,
) -> npt.NDArray[Any]:
    """Filter with :func:`scipy.signal.savgol_filter`'s call and results.

    A drop-in replacement: even windows, all modes, float32 in and out. It is exact where SciPy's coefficients are not (their least
    squares in raw powers fail from order 7 on at 201 samples) and takes the same time for any window.

    Parameters
    ----------
    x : array_like
        Samples, of any shape and unit. Float32 stays float32, any other real type becomes float64.
    window_length : int
        Samples in a window, odd or even. With an even window the result belongs half a sample later, as in SciPy.
    polyorder : int or "aicc"
        Order of the polynomial, less than `window_length`, at most 15; or ``"aicc"``: chosen in every window by the Akaike information
        criterion as in :func:`fit_local_polynomials`.
    deriv : int, optional
        Derivative wanted, 0 for the smoothed samples.
    delta : float, optional
        Sample period in seconds.
    axis : int, optional
        Axis of time.
    mode : {"interp", "mirror", "constant", "nearest", "wrap"}, optional
        What is taken beyond the ends. ``"interp"`` extends nothing but evaluates the first and last full window off its centre.
    cval : float, optional
        Value beyond the ends for ``"constant"``.

    Returns
    -------
    ndarray, same shape as `x`
        Filtered samples, in the unit of `x` per second to the power of `deriv`. Windows that hold a value that is no finite number are
        NaN, and no others.

    Raises
    ------
    ValueError
        If the window is longer than the record with mode ``"interp"``, `polyorder` is not less than `window_length` or above 15, or
        a mode is unknown.
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
    array = arguments.real_array("x", x)
    samples = arguments.along_axis("x", array, axis)
    length = arguments.whole_number("window_length", window_length, least=1)
    chosen = polyorder == "aicc"
    if isinstance(polyorder, str) and not chosen:
        raise ValueError(f"polyorder must be a whole number or 'aicc'; got {polyorder!r}; use one of these")
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
    core_plan = plan(
        length,
        order=order,
        derivatives=(arguments.whole_number("deriv", deriv, least=0),),
        delta=arguments.positive_number("delta", delta),
        noise=False,
    )
    ends = mode == "interp"
    if ends:
        arguments.check_window("window_length", length, samples.shape[-1])
    else:
        samples = _padded(samples.astype(np.float64, copy=False), length, mode, cval)
    derivatives = core_plan.estimate(samples, ends=ends, workers=arguments.worker_count(None)).derivatives
    filtered: npt.NDArray[Any] = np.moveaxis(derivatives[0], -1, axis)
    return filtered.astype(np.float32) if np.asarray(x).dtype == np.float32 else filtered


def _padded(samples: npt.NDArray[np.float64], length: int, mode: str, cval: float) -> npt.NDArray[np.float64]:
    """Return the samples with half a window more at either end, copied in parts so that Ctrl-C is heard in between."""
    before, after, count = (length - 1) // 2, length // 2, samples.shape[-1]
    widths = [(0, 0)] * (samples.ndim - 1) + [(before, after)]
    # What lies beyond an end follows from the samples near the two ends.
    near = samples
    if count > 4 * length:
        near = np.concatenate([samples[..., : 2 * length], samples[..., -2 * length :]], axis=-1)
    near = (
        np.pad(near, widths, "constant", constant_values=cval)
        if mode == "constant"
        else np.pad(near, widths, _PADDING[mode])
    )
    if count <= 4 * length:
        return near
    padded = np.empty((*samples.shape[:-1], before + count + after))
    padded[..., :before] = near[..., :before]
    padded[..., before + count :] = near[..., near.shape[-1] - after :]
    for first in range(0, count, _PART):
        part = samples[..., first : first + _PART]
        padded[..., before + first : before + first + part.shape[-1]] = part
    return padded
