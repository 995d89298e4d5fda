"""Kinds of inertia, damping and stiffness: known, constant, windowed, varying, or decided by the record."""

from __future__ import annotations

from typing import TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._choices import Kind
from tvident._expansion import Expansion

Parameter: TypeAlias = Kind | Expansion | float | npt.ArrayLike


COEFFICIENTS = ("inertia", "damping", "stiffness")
"""Coefficients of the equation of motion, in the order of its derivatives from the second down."""


def parameter(name: str, value: object, shape: tuple[int, ...]) -> Kind | float | npt.NDArray[np.number]:
    """Return how a coefficient comes about: a kind of unknown, a number, or an array of the angle's shape."""
    if isinstance(value, str):
        kinds = get_args(Kind)
        if value not in kinds:
            raise ValueError(
                f"{name} must be 'windowed', 'constant', 'auto', 'varying', a number or an array; got {arguments.shown(value)}; "
                "use one of these"
            )
        kind: Kind = next(kind for kind in kinds if kind == value)
        return kind
    if isinstance(value, bool | np.bool_):
        raise TypeError(
            f"{name} must be a number, an array or a kind; got {value}; write 'windowed' where it is unknown"
        )
    known = arguments.any_array(name, value)  # type: ignore[arg-type] # which is what it checks
    if known.ndim == 0:
        number = float(known)
        if not np.isfinite(number):
            raise ValueError(f"{name} must be finite; got {number}; give a number, or 'windowed' where it is unknown")
        _check_size(name, abs(number))
        return number
    known = arguments.as_record(name, value, shape)  # type: ignore[arg-type] # an array by now
    if not np.isfinite(known).all():
        raise ValueError(
            f"a known {name} must be finite at every sample; got {np.count_nonzero(~np.isfinite(known))} values that are not; "
            "interpolate them, and leave these samples out with mask= if that would be wrong"
        )
    _check_size(name, float(np.abs(known).max()))
    try:
        return np.broadcast_to(known, shape)
    except ValueError:
        raise ValueError(
            f"a known {name} must have one value for every sample; got shape {known.shape} for an angle of shape {shape}; "
            "resample it"
        ) from None


def _check_size(name: str, largest: float) -> None:
    if largest > arguments.LARGEST:
        raise ValueError(
            f"a known {name} must be at most {arguments.LARGEST:g}; got {largest:g}; take units that make the numbers smaller"
        )
