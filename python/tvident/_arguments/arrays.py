"""Arrays of samples."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident._arguments.numbers import one_of, whole_number

NanPolicy: TypeAlias = Literal["propagate", "raise"]

RowPolicy: TypeAlias = Literal["omit", "propagate", "raise"]
"""What to do about values that are no number, where windows may do without some of their rows."""

_READ_AS_THEY_ARE = frozenset(np.dtype(code) for code in ("f8", "f4", "i8", "i4", "i2", "i1", "u8", "u4", "u2", "u1"))


def real_array(name: str, values: npt.ArrayLike) -> npt.NDArray[np.number]:
    """Return values as an array of real numbers that the core reads without a copy of its own."""
    array = np.asarray(values)
    if array.dtype.kind == "c":
        raise TypeError(
            f"{name} must be real; got complex numbers ({array.dtype}); pass the real part or the magnitude"
        )
    if array.dtype.kind not in "biuf":
        raise TypeError(
            f"{name} must hold numbers; got {array.dtype}; convert them with np.asarray({name}, dtype=float)"
        )
    if array.ndim == 0:
        raise ValueError(f"{name} must be an array of samples; got the single number {array}; pass a sequence")
    if array.size == 0:
        raise ValueError(f"{name} must not be empty; got an array of shape {array.shape}; check how it was read or cut")
    if array.dtype not in _READ_AS_THEY_ARE:
        array = array.astype(np.float64)
    return array


def along_axis(name: str, array: npt.NDArray[Any], axis: int) -> npt.NDArray[Any]:
    """Return a view with the given axis last."""
    axis = whole_number("axis", axis)
    if not -array.ndim <= axis < array.ndim:
        raise ValueError(f"axis must name one of the {array.ndim} axes of {name}; got {axis}; use -1 for the last")
    return np.moveaxis(array, axis, -1)


def check_nan(name: str, array: npt.NDArray[Any], policy: str, policies: Any = NanPolicy) -> None:
    """Apply a policy for values that are no number, as far as it must be applied before any work."""
    one_of("nan_policy", policy, get_args(policies))
    if policy == "raise" and array.dtype.kind == "f" and not np.isfinite(array).all():
        place = tuple(int(index[0]) for index in np.nonzero(~np.isfinite(array)))
        where = place[0] if len(place) == 1 else place
        raise ValueError(
            f"{name} must hold finite numbers where nan_policy='raise'; sample {where} is {array[place]}; "
            "repair it or use nan_policy='propagate'"
        )


def mask(name: str, values: npt.ArrayLike | None, shape: tuple[int, ...]) -> npt.NDArray[np.bool_] | None:
    """Return a mask of the given shape, or nothing."""
    if values is None:
        return None
    array = np.asarray(values)
    if array.dtype != np.bool_:
        raise TypeError(f"{name} must hold True and False; got {array.dtype}; write {name} = {name} != 0")
    try:
        return np.broadcast_to(array, shape)
    except ValueError:
        raise ValueError(
            f"{name} must have one value for every sample; got shape {array.shape} for an angle of shape {shape}; check its length"
        ) from None
