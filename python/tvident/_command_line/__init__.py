"""Provides the command ``tvident``: one file per command."""

import os
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

        if os.environ.get("_TVIDENT_COMPLETE", "").startswith("fish"):
            from click.shell_completion import add_completion_class

            from tvident._command_line.fish import Fish

            add_completion_class(Fish)

__all__ = ["main"]
