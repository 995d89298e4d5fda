"""Which library reads which file, and which extra installs it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

PROCESS = Path(__file__).with_name("process.py")
"""The program that reads a file."""


@dataclass(frozen=True)
class Format:
    """A kind of file.

    Parameters
    ----------
    name : str
        What messages call it.
    module : str
        Of this room: it has a function ``variables``.
    package : str
        What has to be installed.
    extra : str
        Of this package, which installs it.
    cure : str
        What to do about a damaged file.
    slowness : int
        How many times longer than others it may take: some libraries are large.
    """

    name: str
    module: str
    package: str
    extra: str
    cure: str = "copy it again"
    slowness: int = 1


_MATLAB = Format("a MATLAB file", "matlab", "pymatreader", "io", "save it again with -v7")
_HDF5 = Format("an HDF5 file", "hdf5", "h5py", "io")
_NETCDF = Format("a netCDF file", "netcdf", "h5py", "io", "copy it again, or save it with xarray's to_netcdf()")
_XLSX = Format("a workbook", "xlsx", "openpyxl", "io", "save it again, or export CSV")
_MDF = Format("an MDF file", "mdf", "asammdf", "mdf", slowness=4)
_UFF = Format("a universal file", "uff", "pyuff", "uff")
_XDF = Format("an XDF file", "xdf", "pyxdf", "xdf")
_ZARR = Format("a Zarr store", "zarr_arrays", "zarr", "io", slowness=2)
_ROS = Format(
    "a ROS bag",
    "ros",
    "rosbags",
    "ros",
    "copy it again, or repair it: mcap recover, ros2 bag reindex or rosbag reindex",
)

FORMATS = {
    ".mat": _MATLAB,
    ".h5": _HDF5,
    ".hdf5": _HDF5,
    ".hdf": _HDF5,
    ".nc": _NETCDF,
    ".nc4": _NETCDF,
    ".cdf": _NETCDF,
    ".tdms": Format("a TDMS file", "tdms", "nptdms", "io"),
    ".xlsx": _XLSX,
    ".xlsm": _XLSX,
    ".mf4": _MDF,
    ".mdf": _MDF,
    ".uff": _UFF,
    ".unv": _UFF,
    ".c3d": Format("a C3D file", "c3d", "ezc3d", "c3d"),
    ".xdf": _XDF,
    ".xdfz": _XDF,
    ".mcap": _ROS,
    ".db3": _ROS,
    ".bag": _ROS,
    ".zarr": _ZARR,
}
"""Formats by the ending of their files."""

FOLDERS = frozenset((".zarr",))
"""Endings of what may be a folder of files."""
