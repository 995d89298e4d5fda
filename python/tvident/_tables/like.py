"""The container that samples came in, made again around other samples."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments

Numbers = npt.NDArray[np.number]


@dataclass(frozen=True)
class Shaped:
    """Samples as NumPy has them, and how they came.

    Parameters
    ----------
    array : ndarray
    axis : int
        Which axis is time.
    again : callable
        Makes the container that the samples came in of other samples of the array's shape.
    """

    array: Numbers
    axis: int
    again: Callable[[npt.NDArray[Any]], Any]


def shaped(name: str, values: Any, axis: int) -> Shaped:
    """Return the samples of any container, and the axis that is meant: of a table always its rows.

    Raises
    ------
    ValueError
        If time is to be the columns of a table.
    """
    axis = arguments.whole_number("axis", axis)
    if isinstance(values, np.ndarray) and values.dtype.names and _are_numbers(values):
        _check_rows(name, axis)
        fields = values.dtype.names
        return Shaped(
            arguments.real_array(name, np.stack([values[field] for field in fields], axis=-1)),
            0,
            lambda array: _structured(array, fields),
        )
    package = arguments.package_of(values)
    array = arguments.real_array(name, values)
    if arguments.is_table(values):
        _check_rows(name, axis)
        return Shaped(array, 0, lambda array: _table_like(values, array))
    place = arguments.time_axis(values) if axis == -1 else None
    axis = axis if place is None else place
    if package == "pandas" and hasattr(values, "index") and not callable(values.index):
        return Shaped(
            array, axis, lambda array: _with_attributes(type(values)(array, values.index, name=values.name), values)
        )
    if package == "polars":
        return Shaped(array, axis, lambda array: type(values)(values.name, array))
    if package == "xarray" and hasattr(values, "copy"):
        return Shaped(array, axis, lambda array: values.copy(data=array))
    return Shaped(array, axis, lambda array: array)


def without_unit(made: Any) -> Any:
    """Return a container without the attributes that say the unit: what was computed has another."""
    attributes = getattr(made, "attrs", None)
    for name in ("units", "unit"):
        if isinstance(attributes, dict):
            attributes.pop(name, None)
    return made


def _are_numbers(values: npt.NDArray[Any]) -> bool:
    return values.ndim == 1 and all(values.dtype[field].kind in "biuf" for field in values.dtype.names or ())


def _check_rows(name: str, axis: int) -> None:
    if axis not in (-1, 0):
        raise ValueError(
            f"time must be the rows of a table; got axis={axis} for {name}; leave axis out, or pass an array"
        )


def _table_like(values: Any, array: npt.NDArray[Any]) -> Any:
    if arguments.package_of(values) == "pandas":
        return _with_attributes(type(values)(array, values.index, values.columns), values)
    polars = sys.modules["polars"]
    return polars.DataFrame({column: array[:, place] for place, column in enumerate(values.columns)})


def _with_attributes(made: Any, values: Any) -> Any:
    made.attrs = dict(values.attrs)
    return made


def _structured(array: npt.NDArray[Any], fields: tuple[str, ...]) -> npt.NDArray[Any]:
    made = np.empty(array.shape[:-1], [(field, array.dtype) for field in fields])
    for place, field in enumerate(fields):
        made[field] = array[..., place]
    return made
