"""Containers of samples as pandas, polars, xarray, dask and MATLAB have them, known by their module: nothing is imported for them."""

from __future__ import annotations

import sys
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._arguments.shown import shown
from tvident._units import in_its_unit

_MOST_NAMES = 6
"""Fields that a message lists."""


def package_of(values: object) -> str:
    """Return the package that the type of a value, or of a base of it, belongs to: pandas, polars, xarray, dask; or None."""
    kind: Any = type(values)
    return _package_of(kind)


@lru_cache(maxsize=64)
def _package_of(kind: type) -> str:
    for base in kind.__mro__:
        package = base.__module__.partition(".")[0]
        if package in {"pandas", "polars", "xarray", "dask", "dask_expr"}:
            return package.removesuffix("_expr")
    return ""


def is_table(values: object) -> bool:
    """Return whether a value is a table of pandas or polars, whose rows are samples."""
    return package_of(values) in {"pandas", "polars"} and hasattr(values, "columns")


def check_in_memory(name: str, values: Any) -> None:
    """Refuse what is computed or read only when it is asked for: that may be larger than memory.

    Raises
    ------
    TypeError
        If it is a collection of dask, a lazy frame of polars, or what xarray made of one.
    """
    package = package_of(values)
    if package == "dask":
        raise TypeError(_lazy(name, "a dask array" if hasattr(values, "chunks") else "a dask collection", ".compute()"))
    if package == "polars" and not isinstance(values, type) and not hasattr(values, "to_numpy"):
        raise TypeError(_lazy(name, f"a polars {type(values).__name__}", ".collect()"))
    if package == "xarray" and not hasattr(values, "data_vars") and getattr(values, "chunks", None):
        raise TypeError(_lazy(name, "a dask array", ".load()"))


def plain(name: str, values: Any) -> Any:
    """Return what NumPy makes an array of, at once and without a loss: missing values are NaN, times are those of UTC."""
    check_in_memory(name, values)
    package = package_of(values)
    if package == "pandas" and (hasattr(values, "dtype") or hasattr(values, "dtypes")):
        _check_one_record(name, values)
        return _of_pandas(values)
    if package == "polars" and not isinstance(values, type):
        return values.to_numpy()
    if package == "xarray":
        return _of_xarray(name, values)
    values = in_its_unit(values)
    fields = fields_of(values)
    if fields:
        listed = ", ".join(map(str, fields[:_MOST_NAMES])) + (" …" if len(fields) > _MOST_NAMES else "")
        how = f".{fields[0]}" if hasattr(values, "_fieldnames") else f"[{fields[0]!r}]"
        raise TypeError(
            f"{name} must hold numbers; got records with fields {listed}; take one field by its name: {name}{how}"
        )
    if isinstance(values, list | tuple):
        # A loop over plain numbers would take long, and find nothing.
        return values if not values or isinstance(values[0], int | float) else [plain(name, one) for one in values]
    return _unwrapped(values)


def fields_of(values: Any) -> list[Any]:
    """Return the names of what a structure holds: of NumPy, of MATLAB, or a dictionary; an empty list if it is none."""
    if isinstance(values, dict):
        return list(values)
    if isinstance(values, np.ndarray) and values.dtype.names is not None:
        return list(values.dtype.names)
    return list(getattr(values, "_fieldnames", ()))


def _unwrapped(values: Any) -> Any:
    """Return the array that a field of a MATLAB structure is wrapped in: one of objects, of shape (1, 1)."""
    while isinstance(values, np.ndarray) and values.dtype.kind == "O" and values.size == 1:
        inner = values.item()
        if not isinstance(inner, np.ndarray):
            break
        values = inner
    return values


def _lazy(name: str, what: str, call: str) -> str:
    return (
        f"{name} must be in memory; got {what}, which may be larger than memory and is never computed silently; "
        f"pass {name}{call}"
    )


def _check_one_record(name: str, values: Any) -> None:
    """Refuse records that stand one below the other, as an index of several levels tells them apart."""
    index: Any = getattr(values, "index", None)
    if getattr(index, "nlevels", 1) == 1:
        return
    last = np.asarray(index.get_level_values(-1))
    if last.dtype.kind not in "iufmM":
        return
    began = np.flatnonzero(last[1:] < last[:-1])
    if not began.size:
        return
    level = min(range(index.nlevels), key=lambda one: index.get_level_values(one).nunique())
    first = index.get_level_values(level)[0]
    key = first.item() if isinstance(first, np.generic) else first
    raise ValueError(
        f"{name} must be one record, or a table with a column for each; the last level of its index begins again at sample "
        f"{began[0] + 1}; if these are records one below the other, pass {name}.unstack({level}), or one of them: "
        f"{name}.xs({key!r}, level={level}); if all is one record, as where levels are seconds and milliseconds, pass {name}.to_numpy()"
    )


def _of_pandas(values: Any) -> npt.NDArray[Any]:
    kinds = list(values.dtypes) if hasattr(values, "columns") else [getattr(values, "dtype", None)]
    if kinds and getattr(kinds[0], "tz", None) is not None and not hasattr(values, "columns"):
        times = values.dt if hasattr(values, "dt") else values
        return np.asarray(times.tz_convert(None))
    if any(kind is not None and not isinstance(kind, np.dtype) for kind in kinds):
        # Types of pandas' own have values that are missing, of which NumPy would make objects.
        types = sys.modules["pandas"].api.types
        if all(types.is_bool_dtype(kind) for kind in kinds):
            return np.asarray(values.to_numpy(dtype=bool, na_value=False))
        if all(types.is_numeric_dtype(kind) for kind in kinds):
            return np.asarray(values.to_numpy(dtype=np.float64, na_value=np.nan))
    return np.asarray(values)


def _of_xarray(name: str, values: Any) -> npt.NDArray[Any]:
    # Even to ask whether there is an attribute `values` computes it.
    if hasattr(values, "data_vars") or not hasattr(values, "dims"):
        variables = [str(one) for one in values] if hasattr(values, "data_vars") else []
        got = f"a Dataset of {', '.join(variables[:_MOST_NAMES])}" if variables else shown(values)
        one = variables[0] if variables else "angle"
        raise TypeError(f"{name} must be one channel; got {got}; take one variable: {name}[{one!r}]")
    return np.asarray(values.values)


def time_axis(values: Any) -> int | None:
    """Return which axis of a container is time, where the container says so: rows of a table, the dimension of xarray."""
    if is_table(values):
        return 0
    if package_of(values) != "xarray" or not hasattr(values, "dims"):
        return None
    named = [place for place, dim in enumerate(values.dims) if str(dim).lower() in {"time", "t"}]
    dated = [
        place for place, dim in enumerate(values.dims) if dim in values.coords and values.coords[dim].dtype.kind in "mM"
    ]
    found = named or dated
    return found[0] if len(found) == 1 else None


def time_last(values: Any, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return what was made of a container with time as its last axis, where the container says which it is."""
    axis = time_axis(values)
    if axis is None or array.ndim <= axis:
        return array
    array = np.moveaxis(array, axis, -1)
    return array[0] if is_table(values) and array.shape[0] == 1 else array
