"""Arrays of samples."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from tvident._arguments.containers import plain, time_last
from tvident._arguments.numbers import one_of, whole_number
from tvident._arguments.shown import shown
from tvident._choices import NanPolicy

_READ_AS_THEY_ARE = frozenset(np.dtype(code) for code in ("f8", "f4", "i8", "i4", "i2", "i1", "u8", "u4", "u2", "u1"))

_OTHER_KINDS = {
    "S": "text; read it with np.asarray(text, dtype=float)",
    "U": "text; read it with np.asarray(text, dtype=float)",
    "M": "dates; take seconds from the first sample on: (dates - dates[0]) / np.timedelta64(1, 's')",
    "m": "durations; divide them by np.timedelta64(1, 's')",
}
"""What arrays hold that are no numbers, and the cure."""


def real_array(name: str, values: npt.ArrayLike) -> npt.NDArray[np.number]:
    """Return values as an array of real numbers that the core reads without a copy of its own; masked ones are NaN."""
    array = any_array(name, values)
    if array.ndim == 0:
        raise ValueError(
            f"{name} must be an array of samples; got the single value {shown(array.item())}; pass a sequence"
        )
    if array.size == 0:
        raise ValueError(f"{name} must not be empty; got an array of shape {array.shape}; check how it was read or cut")
    return array


def any_array(name: str, values: npt.ArrayLike) -> npt.NDArray[np.number]:
    """Return values as an array of real numbers of any shape; masked ones are NaN."""
    if values is None:
        raise TypeError(f"{name} must hold numbers; got None; give an array of numbers")
    array = _as_array(name, values)
    kind = array.dtype.kind
    if kind == "c":
        raise TypeError(
            f"{name} must be real; got complex numbers ({array.dtype}); pass the real part or the magnitude"
        )
    if kind not in "biuf":
        got = _OTHER_KINDS.get(kind, f"{array.dtype}; convert them with np.asarray({name}, dtype=float)")
        raise TypeError(f"{name} must hold numbers; got {got}")
    array = np.asarray(_filled(array))
    if not is_read_as_it_is(array.dtype):
        with np.errstate(all="ignore"):
            # A long double may be too large for a double: it is infinite then, and so no sample.
            array = array.astype(np.float64)
    return array


def _as_array(name: str, values: npt.ArrayLike) -> npt.NDArray[Any]:
    """Return values as an array, a masked one if they are masked."""
    values = plain(name, values)
    if isinstance(values, list | tuple):
        values = [_filled(value) if isinstance(value, np.ma.MaskedArray) else value for value in values]
    try:
        return values if isinstance(values, np.ma.MaskedArray) else np.asarray(values)
    except (ValueError, OverflowError):
        raise ValueError(
            f"{name} must be a regular array of numbers; got {shown(values)}; give all rows the same length"
        ) from None
    except (TypeError, RuntimeError) as error:
        # Arrays of other libraries, which may be on another device, say themselves how they become NumPy's.
        raise TypeError(
            f"{name} must be an array that NumPy reads; got {shown(type(values))} ({shown(error)}); convert it first"
        ) from None


def _filled(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return an array with NaN where it is masked: such samples are missing, and anything may lie below the mask."""
    if not isinstance(array, np.ma.MaskedArray) or array.dtype.kind not in "biuf" or not np.ma.is_masked(array):
        return array
    return np.asarray(np.ma.filled(array.astype(np.result_type(array.dtype, np.float16)), np.nan))


def is_read_as_it_is(kind: np.dtype[Any]) -> bool:
    """Return whether the core reads numbers of a type; others are converted."""
    return kind in _READ_AS_THEY_ARE


def along_axis(name: str, array: npt.NDArray[Any], axis: int) -> npt.NDArray[Any]:
    """Return a view with the given axis last."""
    axis = whole_number("axis", axis)
    if not -array.ndim <= axis < array.ndim:
        raise ValueError(f"axis must name one of the {array.ndim} axes of {name}; got {axis}; use -1 for the last")
    return array if axis in (-1, array.ndim - 1) else np.moveaxis(array, axis, -1)


def check_nan(name: str, array: npt.NDArray[Any], policy: str, policies: Any = NanPolicy) -> None:
    """Apply a policy for values that are no number, as far as it must be applied before any work."""
    one_of("nan_policy", policy, get_args(policies))
    if policy == "raise" and array.dtype.kind == "f" and not np.isfinite(array).all():
        place = tuple(int(index[0]) for index in np.nonzero(~np.isfinite(array)))
        where = place[0] if len(place) == 1 else place
        raise ValueError(
            f"{name} must hold finite numbers where nan_policy='raise'; sample {where} is {array[place]}; "
            f"repair it or use nan_policy={'omit' if 'omit' in get_args(policies) else 'propagate'!r}"
        )


def mask(name: str, values: npt.ArrayLike | None, shape: tuple[int, ...]) -> npt.NDArray[np.bool_] | None:
    """Return a mask of the given shape, or None; what is masked in the mask itself is False."""
    if values is None:
        return None
    array = _as_array(name, values)
    if array.dtype != np.bool_ and array.size:
        raise TypeError(f"{name} must hold True and False; got {array.dtype}; write {name} = {name} != 0")
    cells = time_last(values, np.ma.filled(array, False))  # noqa: FBT003 - what is masked is left out
    if cells.ndim == len(shape) + 1 and cells.shape[-1] == 1:
        cells = cells[..., 0]  # a column, as the channels may be
    try:
        return np.broadcast_to(np.asarray(cells), shape)
    except ValueError:
        raise ValueError(
            f"{name} must have one value for every sample; got shape {array.shape} for an angle of shape {shape}; check its length"
        ) from None


def weights(name: str, values: npt.ArrayLike | None, shape: tuple[int, ...]) -> npt.NDArray[np.float64] | None:
    """Return weights, one for every sample, or None; a masked one is zero."""
    if values is None:
        return None
    array = some_weights(name, values, shape)
    if not array.any():
        raise ValueError(f"{name} must leave something to use; got zeros alone; give a weight above zero")
    return array


def some_weights(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> npt.NDArray[np.float64]:
    """Return weights of some samples of more, which may all be zero; that of a single one may be a number."""
    array = np.array(
        any_array(name, np.ma.filled(values, 0.0) if np.ma.is_masked(values) else values), dtype=np.float64
    )
    if array.ndim == 0 and shape == (1,):
        array = array.reshape(shape)
    if array.shape != shape:
        raise ValueError(
            f"{name} must have one value for every sample, shape {shape}; got shape {array.shape}; check its length"
        )
    wrong = ~(np.isfinite(array) & (array >= 0))
    if wrong.any():
        place = tuple(int(index[0]) for index in np.nonzero(wrong))
        raise ValueError(
            f"{name} must be finite and not negative; {name}[{', '.join(map(str, place))}] is {array[place]}; give one over the "
            "variance of the sample's noise, relative to the others, and 0 where it is not to be used"
        )
    return array
