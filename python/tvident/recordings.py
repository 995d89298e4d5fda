"""Recordings in files: CSV and other text, NPY, NPZ and MATLAB; channels by name."""

from tvident._files import Channels, FileError, FileWarning, channel, read

__all__ = ["Channels", "FileError", "FileWarning", "channel", "read"]
