"""What containers say of their samples beside the numbers: an index, names of axes, coordinates, attributes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._arguments.containers import is_table, package_of, time_axis
from tvident._arguments.shown import shown


@dataclass(frozen=True)
class Labels:
    """Labels of records whose last axis is time.

    Parameters
    ----------
    index : object, optional
        What pandas calls the samples: its index.
    records : sequence, optional
        What a table calls its records: its columns.
    dims : tuple of str
        Names of the axes, time last, as xarray has them.
    coordinates : mapping of str to object
        Coordinates of xarray, one object each.
    attributes : mapping
        What the container has to say beside.
    """

    index: Any = None
    records: Any = None
    dims: tuple[Any, ...] = ()
    coordinates: Mapping[Any, Any] = field(default_factory=dict)
    attributes: Mapping[Any, Any] = field(default_factory=dict)

    def at(self, samples: slice) -> Labels:
        """Return the labels of some samples."""
        index = None if self.index is None else self.index[samples]
        time = self.dims[-1] if self.dims else None
        coordinates = {
            name: one.isel({time: samples}) if time in one.dims else one for name, one in self.coordinates.items()
        }
        return replace(self, index=index, coordinates=coordinates)

    def of_record(self, place: Any) -> Labels:
        """Return the labels of what NumPy's indexing takes along the first axis."""
        records = None if self.records is None else self.records[place]
        if not self.dims:
            return replace(self, records=records if isinstance(place, slice) else None)
        first = self.dims[0]
        coordinates = {
            name: one.isel({first: place}) if first in one.dims else one for name, one in self.coordinates.items()
        }
        return replace(self, dims=self.dims if isinstance(place, slice) else self.dims[1:], coordinates=coordinates)


def labels_of(values: Any) -> Labels | None:
    """Return what a container says of its samples, None for an array."""
    package = package_of(values)
    if package == "xarray" and hasattr(values, "dims"):
        axis = time_axis(values)
        dims = list(values.dims)
        if axis is not None:
            dims.append(dims.pop(axis))
        return Labels(dims=tuple(dims), coordinates=dict(values.coords), attributes=dict(values.attrs))
    if package == "pandas" and hasattr(values, "index") and not callable(values.index):
        records = values.columns if is_table(values) and len(values.columns) > 1 else None
        return Labels(index=values.index, records=records, attributes=dict(values.attrs))
    if package == "polars" and is_table(values) and len(values.columns) > 1:
        return Labels(records=list(values.columns))
    return None


def aligned_with(first: tuple[str, Any], second: tuple[str, Any]) -> Any:
    """Return the second channel as the first one has it: with its axes in the same order.

    Raises
    ------
    ValueError
        If their labels say that they are of different samples.
    """
    (name, one), (other_name, other) = first, second
    package = package_of(one)
    if package != package_of(other):
        return other
    if package == "pandas" and hasattr(one, "index") and hasattr(other, "index"):
        where = _differing(one.index, other.index)
        if where is not None:
            raise ValueError(
                f"{name} and {other_name} must be of the same samples; {where}; pass {other_name}.reindex({name}.index), "
                "or .to_numpy() of both if they belong together as they are"
            )
    if package == "xarray" and hasattr(one, "dims") and hasattr(other, "dims"):
        if set(one.dims) == set(other.dims) and len(set(one.dims)) == len(one.dims):
            other = other.transpose(*one.dims)
        for dim in set(one.dims) & set(other.dims) & set(one.coords) & set(other.coords):
            where = _differing(one.coords[dim].values, other.coords[dim].values)
            if where is not None:
                raise ValueError(
                    f"{name} and {other_name} must be of the same samples; along {dim!r} {where}; align them with xarray.align, or "
                    "pass .values of both if they belong together as they are"
                )
    return other


def _differing(one: Any, other: Any) -> str | None:
    """Return where labels of as many samples differ, in words; a mere count of samples says nothing that could differ from dates."""
    counts = [type(index).__name__ == "RangeIndex" for index in (one, other)]
    if len(one) != len(other) or counts[0] != counts[1]:
        return None
    same: npt.NDArray[np.bool_] = np.asarray(one == other)
    if same.ndim != 1 or same.all():
        return None
    place = int(np.flatnonzero(~same)[0])
    return f"their labels of sample {place} are {shown(one[place])} and {shown(other[place])}"
