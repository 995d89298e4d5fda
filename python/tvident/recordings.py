"""Recordings in files of many kinds: channels by name."""

from tvident._files import Channels, FileError, FileWarning, channel, read

__all__ = ["Channels", "FileError", "FileWarning", "channel", "read"]
