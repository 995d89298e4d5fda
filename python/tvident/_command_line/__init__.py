"""Provides the command ``tvident``: one file per command."""

from tvident._command_line import demo, derivatives, identify, info, simulate  # noqa: F401 - each adds its command
from tvident._command_line.group import main

__all__ = ["main"]
