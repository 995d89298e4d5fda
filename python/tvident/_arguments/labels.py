"""What containers say of their samples beside the numbers: an index, names of axes, coordinates, attributes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._arguments.containers import is_table, package_of, plain, time_axis
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

    def of_records(self, place: Any, axes: int) -> Labels:
        """Return the labels of what NumPy's indexing takes of a batch: an index without an ellipsis, and how many axes it leaves."""
        parts = place if isinstance(place, tuple) else (place,)
        if not self.dims:
            is_named = self.records is not None and axes == 1 and len(parts) == 1
            return replace(self, records=_taken(self.records, parts[0]) if is_named else None)
        *batch, time = self.dims
        parts = (*parts, *[slice(None)] * (len(batch) - len(parts)))
        # True is an index that makes an axis, though it is an integer.
        lists = [part for part in parts if isinstance(part, bool) or not isinstance(part, slice | int | np.integer)]
        if len(parts) > len(batch) or len(lists) > 1 or any(np.ndim(part) != 1 for part in lists):
            # Axes that indexing makes or joins have no names.
            names = ["record"] if axes == 1 else [f"record_{axis}" for axis in range(axes)]
            there = {name: one for name, one in self.coordinates.items() if set(one.dims) <= {time}}
            return replace(self, dims=(*names, time), coordinates=there)
        coordinates = dict(self.coordinates)
        for dim, part in zip(batch, parts, strict=True):
            for name, one in coordinates.items():
                if dim in one.dims:
                    places = part if isinstance(part, slice) else np.arange(one.sizes[dim])[part]
                    coordinates[name] = one.isel({dim: places})
        kept = [dim for dim, part in zip(batch, parts, strict=True) if not isinstance(part, int | np.integer)]
        return replace(self, dims=(*kept, time), coordinates=coordinates)


def _taken(records: Any, part: Any) -> Any:
    """Return the names of some records: columns of pandas, or a list."""
    if isinstance(part, slice):
        return records[part]
    places = np.arange(len(records))[part]
    return records[places] if hasattr(records, "take") else [records[place] for place in places]


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


def labels_out(labels: Labels | None) -> tuple[dict[str, npt.NDArray[Any]], dict[str, Any] | None]:
    """Return labels as arrays and plain JSON; what neither of them can hold is left out."""
    if labels is None:
        return {}, None
    arrays: dict[str, npt.NDArray[Any]] = {}
    facts: dict[str, Any] = {"dims": [str(dim) for dim in labels.dims], "attributes": _plain(labels.attributes)}
    if labels.index is not None and labels.index.nlevels == 1:
        zone = getattr(labels.index.dtype, "tz", None)
        facts["index"] = {"name": labels.index.name, "zone": None if zone is None else str(zone)}
        arrays["index"] = _storable(plain("index", labels.index))
    if labels.records is not None:
        facts["records"] = [str(one) for one in labels.records]
    facts["coordinates"] = {}
    for name, one in labels.coordinates.items():
        facts["coordinates"][str(name)] = {"dims": [str(dim) for dim in one.dims], "attributes": _plain(one.attrs)}
        arrays[f"coordinate_{name}"] = _storable(np.asarray(one))
    return arrays, facts


def labels_in(arrays: Mapping[str, npt.NDArray[Any]], facts: Mapping[str, Any]) -> Labels:
    """Return labels from what `labels_out` made of them; without what their package would be needed for where it is missing."""
    index, coordinates = None, dict[Any, Any]()
    if "index" in facts and find_spec("pandas"):
        pandas = import_module("pandas")
        index = pandas.Index(arrays["index"], name=facts["index"]["name"])
        if facts["index"]["zone"]:
            index = index.tz_localize("UTC").tz_convert(facts["index"]["zone"])
    has_xarray = find_spec("xarray") is not None
    for name, one in facts["coordinates"].items() if has_xarray else ():
        made = import_module("xarray").Variable(one["dims"], arrays[f"coordinate_{name}"], one["attributes"])
        coordinates[name] = import_module("xarray").DataArray(made, name=name)
    dims = tuple(facts["dims"]) if has_xarray else ()
    return Labels(index, facts.get("records"), dims, coordinates, facts["attributes"])


def _plain(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Return the attributes that JSON can hold."""
    kept: dict[str, Any] = {}
    for name, value in attributes.items():
        try:
            kept[str(name)] = json.loads(json.dumps(value))
        except (TypeError, ValueError):
            continue
    return kept


def _storable(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    return values.astype(str) if values.dtype.kind == "O" else values
