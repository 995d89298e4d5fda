"""Provides the command ``tvident``: one file per command."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tvident._command_line.group import main
else:
    try:
        import click  # noqa: F401 - an extra: the library does without
    except ImportError:
        from tvident._command_line.missing import main
    else:
        from tvident._command_line.group import main

__all__ = ["main"]
