"""Gives results in the containers that samples came in: pandas, polars, xarray and structured arrays."""

from tvident._tables.below import TabularList
from tvident._tables.like import Shaped, shaped, without_unit
from tvident._tables.table import Table, Tabular

__all__ = [
    "Shaped",
    "Table",
    "Tabular",
    "TabularList",
    "shaped",
    "without_unit",
]
