"""Coefficients of the rig as functions of time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments

Array: TypeAlias = npt.NDArray[np.float64]

Function: TypeAlias = Callable[[Array], npt.ArrayLike]


def function_of_time(name: str, given: float | Function, *, zero: bool = False) -> Callable[[Array], Array]:
    """Return a function of an array of times, from a number or a user's function; its values are checked at every call.

    Parameters
    ----------
    name : str
        What messages call it.
    given : float or callable
    zero : bool
        Zero is allowed.
    """
    if not callable(given):
        number = arguments.finite_number(name, given, least=0) if zero else arguments.positive_number(name, given)
        return lambda t: np.full(t.shape, number)

    def values(t: Array) -> Array:
        # A copy, so that the function cannot change the times of the recording.
        found = arguments.any_array(f"what {name} returns", given(t.copy()))
        if found.shape not in {(), t.shape}:
            raise ValueError(
                f"what {name} returns must be one value for every time; got shape {found.shape} for times of shape {t.shape}; "
                "compute it from the array of times"
            )
        wrong = ~(np.isfinite(found) & (found >= 0 if zero else found > 0))
        if wrong.any():
            place = int(np.flatnonzero(np.broadcast_to(wrong, t.shape))[0])
            raise ValueError(
                f"what {name} returns must be finite and {'not negative' if zero else 'positive'}; got "
                f"{np.broadcast_to(found, t.shape)[place]:g} at {t[place]:g} s; repair the function"
            )
        return np.array(np.broadcast_to(found, t.shape), dtype=np.float64)

    return values
