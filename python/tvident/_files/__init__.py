"""Reads recordings from files and writes tables to them."""

from tvident._files.channels import Channels, FileError, FileWarning, channel
from tvident._files.names import listed, printable
from tvident._files.places import check_apart, check_folder, check_place
from tvident._files.recordings import read
from tvident._files.replacement import replaced
from tvident._files.table import aligned, write_csv, write_table

__all__ = [
    "Channels",
    "FileError",
    "FileWarning",
    "aligned",
    "channel",
    "check_apart",
    "check_folder",
    "check_place",
    "listed",
    "printable",
    "read",
    "replaced",
    "write_csv",
    "write_table",
]
