"""The command ``tvident info``."""

from __future__ import annotations

from typing import Any

import click

from tvident._command_line.group import commands, main
from tvident._command_line.options import MISSING


@main.command()
@click.argument("file", type=click.Path())
@MISSING
@click.option("--json", "as_json", is_flag=True, help="Print the channels as JSON, with their units.")
def info(**options: Any) -> None:
    """List the channels of FILE: how many samples, their range, and what is missing."""
    commands().info(**options)
