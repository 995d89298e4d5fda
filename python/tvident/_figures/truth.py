"""True parameters to be drawn beside those that were found."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._simulate import Recording

Truth: TypeAlias = "Recording | Mapping[str, npt.ArrayLike] | None"
"""A simulated recording, or numbers and arrays by the names of parameters."""

_TRUE = ("inertia", "damping", "stiffness")


def truth_at(time: npt.NDArray[np.float64], truth: Truth, known: Collection[str]) -> dict[str, npt.NDArray[np.float64]]:
    """Return true parameters at some times, by name; of those whose names are known.

    Raises
    ------
    TypeError
        If nothing of it is one.
    ValueError
        If a name is none of a parameter, or an array has another length than the times.
    """
    if truth is None:
        return {}
    if isinstance(truth, Recording):
        return {name: np.interp(time, truth.time, getattr(truth, name)) for name in _TRUE}
    if not isinstance(truth, Mapping):
        raise TypeError(
            f"truth must be a simulated recording, or numbers and arrays by name; got {arguments.shown(truth)}; pass "
            "{'stiffness': 12.0}, say"
        )
    found = {}
    for name, value in truth.items():
        if name not in known:
            raise ValueError(
                f"truth must name parameters of the result, {arguments.listed(list(known))}; got {arguments.shown(name)}; check it"
            )
        called = f"truth[{name!r}]"
        is_number = np.ndim(value) == 0
        values = np.asarray(
            arguments.finite_number(called, value) if is_number else arguments.real_array(called, value)
        )
        if values.shape not in {(), time.shape}:
            raise ValueError(
                f"{called} must be a number or an array with a value for each of {time.size} samples; got shape {values.shape}; "
                "pass the simulated recording, which has its times, or cut the array"
            )
        found[name] = np.broadcast_to(values.astype(np.float64), time.shape)
    return found
