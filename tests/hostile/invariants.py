"""What holds of every result, whatever it was computed from."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import Status

Array = npt.NDArray[Any]


def same(one: Any, other: Any) -> bool:
    """Return whether two results have the same bits."""
    if isinstance(one, np.ndarray):
        return bool(one.shape == other.shape and one.dtype == other.dtype and one.tobytes() == other.tobytes())
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other) or (one != one and other != other)  # noqa: PLR0124 - NaN is NaN


def check(values: Mapping[str, Array], errors: Mapping[str, Array], status: Array, apart: Collection[str] = ()) -> None:
    """Check numbers of one shape: missing where the status says so and nowhere else, errors that are errors.

    Numbers that stand `apart`, as constants of a record do, may be there where others are missing.
    """
    invalid = status & Status.INVALID != 0
    missing = np.zeros(status.shape, dtype=np.bool_)
    for name, given in values.items():
        value = np.broadcast_to(given, status.shape)
        missing |= np.isnan(value)
        assert not (np.isnan(value) & ~invalid).any(), f"{name} is NaN where the status is not INVALID"
        assert not np.isinf(value).any(), f"{name} is infinite"
        assert name in apart or not (np.isfinite(value) & invalid).any(), (
            f"{name} is a number where the status is INVALID"
        )
        if name in errors:
            error = np.broadcast_to(errors[name], status.shape)
            assert not np.isinf(error).any(), f"the error of {name} is infinite"
            assert not (error < 0).any(), f"the error of {name} is negative"
            assert not (np.isnan(error) & ~np.isnan(value)).any(), f"{name} has no error"
    assert not (invalid & ~missing).any(), "the status is INVALID where all numbers are there"
