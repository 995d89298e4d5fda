"""Reads recordings from files and writes tables to them."""

from tvident._files.channels import Channels, FileError, channel
from tvident._files.recordings import read
from tvident._files.table import aligned, check_folder, check_place, replaced, write_csv, write_table

__all__ = [
    "Channels",
    "FileError",
    "aligned",
    "channel",
    "check_folder",
    "check_place",
    "read",
    "replaced",
    "write_csv",
    "write_table",
]
