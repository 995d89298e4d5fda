"""Reads files of other programs with the libraries that know them, in a process of its own."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tvident._formats.known import FOLDERS, FORMATS, PROCESS, Format

if TYPE_CHECKING:
    from tvident._formats.columns import columns_of
    from tvident._formats.hdf5 import datasets, hdf5_arrays, hdf5_rate
    from tvident._formats.netcdf import (
        NetcdfMeaning,
        is_netcdf_3,
        netcdf_3_rate,
        netcdf_4_rate,
        netcdf_columns,
        netcdf_meaning,
        numbers_of_netcdf_3,
        numbers_of_netcdf_4,
    )
    from tvident._formats.zarr_arrays import zarr_found, zarr_rate

__all__ = [
    "FOLDERS",
    "FORMATS",
    "PROCESS",
    "Format",
    "NetcdfMeaning",
    "columns_of",
    "datasets",
    "hdf5_arrays",
    "hdf5_rate",
    "is_netcdf_3",
    "netcdf_3_rate",
    "netcdf_4_rate",
    "netcdf_columns",
    "netcdf_meaning",
    "numbers_of_netcdf_3",
    "numbers_of_netcdf_4",
    "zarr_found",
    "zarr_rate",
]

_READERS = {
    "columns_of": "columns",
    **dict.fromkeys(("datasets", "hdf5_arrays", "hdf5_rate"), "hdf5"),
    **dict.fromkeys(("NetcdfMeaning", "is_netcdf_3", "netcdf_3_rate", "netcdf_4_rate", "netcdf_columns"), "netcdf"),
    **dict.fromkeys(("netcdf_meaning", "numbers_of_netcdf_3", "numbers_of_netcdf_4"), "netcdf"),
    **dict.fromkeys(("zarr_found", "zarr_rate"), "zarr_arrays"),
}
"""Where what reads comes from: entered when first asked for, since most recordings are of other formats."""


def __getattr__(name: str) -> Any:
    if name not in _READERS:
        raise AttributeError(f"module 'tvident._formats' has no attribute {name!r}")
    return getattr(import_module(f"tvident._formats.{_READERS[name]}"), name)
