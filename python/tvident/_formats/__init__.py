"""Reads files of other programs with the libraries that know them, in a process of its own."""

from tvident._formats.known import FOLDERS, FORMATS, PROCESS, Format

__all__ = ["FOLDERS", "FORMATS", "PROCESS", "Format"]
