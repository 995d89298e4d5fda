"""Results as tables of pandas and polars, and as data sets of xarray."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import xarray as xr


@dataclass(frozen=True)
class Table:
    r"""Columns of one length, and what is known of them.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Seconds.
    columns : mapping of str to ndarray, shape (\*, n)
    units : mapping of str to str
    settings : mapping
        What was used, as plain JSON.
    labels : Labels, optional
        Those of the container that samples came in.
    """

    time: npt.NDArray[np.float64]
    columns: Mapping[str, npt.NDArray[Any]]
    units: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    labels: arguments.Labels | None = None

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch; empty for a single record."""
        return next(iter(self.columns.values())).shape[:-1]

    @property
    def index(self) -> Any:
        """What pandas called the samples, None where nothing did."""
        return None if self.labels is None else self.labels.index

    def records(self) -> list[tuple[str, Any]]:
        """Return a name and the labels for every axis of the batch."""
        known = self.labels
        if known is not None and known.records is not None:
            return [(str(getattr(known.records, "name", None) or "record"), list(known.records))]
        if known is not None and known.dims:
            return [
                (str(dim), known.coordinates[dim].to_numpy() if dim in known.coordinates else range(count))
                for dim, count in zip(known.dims[:-1], self.batch, strict=True)
            ]
        names = ["record"] if len(self.batch) == 1 else [f"record_{axis}" for axis in range(len(self.batch))]
        return [(name, range(count)) for name, count in zip(names, self.batch, strict=True)]

    def attributes(self) -> dict[Any, Any]:
        """Return what is said beside the numbers."""
        said = {} if self.labels is None else dict(self.labels.attributes)
        for name in ("unit", "units"):
            said.pop(name, None)  # of the samples: every column has its own
        return {**said, "settings": json.dumps(self.settings)}


class Tabular:
    """What can be given as a table."""

    def _table(self) -> Table:
        raise NotImplementedError

    def to_pandas(self) -> pd.DataFrame:
        """Return a pandas table: a row a sample, with the index of the samples if they had one, and with their attributes.

        Returns
        -------
        pandas.DataFrame
            Indexed by time in seconds, or as the samples were; then ``time`` is a column. Several records are below each other,
            with an index of record and time. ``attrs`` hold the units, the settings as JSON and what the samples had there.

        Raises
        ------
        ImportError
            If pandas is missing: install ``tvident[tables]``.

        See Also
        --------
        to_polars, to_xarray : other containers.
        Identification.columns, Identification.save : arrays by name, and files.
        """
        pandas, table = package("pandas"), self._table()
        columns = {name: values.reshape(-1) for name, values in table.columns.items()}
        index = pandas.Index(table.time, name="time")
        if table.index is not None:
            index = table.index
            columns = {"time": np.tile(table.time, int(np.prod(table.batch, dtype=int))), **columns}
        if table.batch:
            records = table.records()
            index = pandas.MultiIndex.from_product(
                [*(labels for _, labels in records), index],
                names=[*(name for name, _ in records), index.name or "sample"],
            )
        frame: pd.DataFrame = pandas.DataFrame(columns, index=index)
        frame.attrs = {**table.attributes(), "units": _units(table)}
        return frame

    def to_polars(self) -> pl.DataFrame:
        """Return a polars table: a row a sample, ``time`` in seconds first, before it the record where there are several.

        Returns
        -------
        polars.DataFrame

        Raises
        ------
        ImportError
            If polars is missing: install ``tvident[tables]``.

        See Also
        --------
        to_pandas, to_xarray : other containers.
        Identification.columns, Identification.save : arrays by name, and files.
        """
        polars, table = package("polars"), self._table()
        count, columns = table.time.size, dict[str, Any]()
        places = [place.reshape(-1) for place in np.indices(table.batch)]
        for (name, labels), place in zip(table.records(), places, strict=True):
            columns[name] = np.repeat(np.asarray(labels)[place], count)
        columns["time"] = np.tile(table.time, int(np.prod(table.batch, dtype=int)))
        if table.index is not None and table.index.dtype.kind in "mM":
            dates = arguments.plain("index", table.index)
            columns[str(table.index.name or "date")] = np.tile(dates, int(np.prod(table.batch, dtype=int)))
        columns |= {name: values.reshape(-1) for name, values in table.columns.items()}
        frame: pl.DataFrame = polars.DataFrame(columns)
        return frame

    def to_xarray(self) -> xr.Dataset:
        """Return an xarray data set, with the coordinates and attributes of the samples if they had some.

        Returns
        -------
        xarray.Dataset
            Dimensions are those of the samples, time last; a coordinate ``time`` in seconds where they had none. Every variable
            has its unit in ``attrs["units"]``; the attribute ``settings`` is JSON.

        Raises
        ------
        ImportError
            If xarray is missing: install ``tvident[tables]``.

        See Also
        --------
        to_pandas, to_polars : other containers.
        Identification.columns, Identification.save : arrays by name, and files.
        """
        xarray, table = package("xarray"), self._table()
        known = table.labels
        if known is not None and known.dims:
            dims, coordinates = known.dims, dict(known.coordinates)
            if dims[-1] not in coordinates:
                coordinates[dims[-1]] = table.time
        else:
            records = table.records()
            dims = (*(name for name, _ in records), "time")
            coordinates = {name: list(labels) for name, labels in records}
            coordinates["time"] = table.time if table.index is None else arguments.plain("index", table.index)
        units = _units(table)
        variables = {
            name: (dims, values, {"units": units[name]} if name in units else {})
            for name, values in table.columns.items()
        }
        made: xr.Dataset = xarray.Dataset(variables, coordinates, table.attributes())
        if "units" not in made[dims[-1]].attrs and made[dims[-1]].dtype.kind == "f":
            made[dims[-1]].attrs["units"] = "s"
        return made


def _units(table: Table) -> dict[str, str]:
    """Return the units of all columns that have one; a standard error has that of its parameter."""
    units = {name: table.units.get(name) or table.units.get(name.removesuffix("_stderr")) for name in table.columns}
    return {name: unit for name, unit in units.items() if unit}


def package(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise ImportError(
            f"to_{name}() needs {name}, which is not installed; install it with: pip install 'tvident[tables]'"
        ) from None
