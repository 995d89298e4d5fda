"""Pieces of a recording: one sample or many."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments

_FLOAT64 = np.dtype(np.float64)


def piece(name: str, values: npt.ArrayLike) -> npt.NDArray[Any]:
    """Return a piece of a record as an array with one axis; a single number is a piece of one sample."""
    # What comes a thousand times a second goes the short way.
    if type(values) is float:
        return np.array((values,))
    if type(values) is np.ndarray and values.ndim == 1 and values.dtype == _FLOAT64:
        return values
    array = arguments.any_array(name, values)
    if array.ndim > 1:
        raise ValueError(
            f"{name} must be one sample or several along one axis; got shape {array.shape}; make a stream for every record"
        )
    return np.atleast_1d(array)


def check_open(*, ended: bool) -> None:
    """Check that a stream goes on."""
    if ended:
        raise ValueError("a stream takes no samples after its end; got some after finish(); make another stream")


def check_finite(name: str, values: npt.NDArray[Any], policy: str, begin: int) -> None:
    """Refuse values that are no number where the policy says so."""
    if policy == "raise" and values.dtype.kind == "f" and not np.isfinite(values).all():
        place = int(np.flatnonzero(~np.isfinite(values))[0])
        raise ValueError(
            f"{name} must hold finite numbers where nan_policy='raise'; sample {begin + place} is {values[place]}; "
            "repair it or use nan_policy='propagate'"
        )
