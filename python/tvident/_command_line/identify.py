"""The command ``tvident identify``."""

from __future__ import annotations

from typing import Any

import click

from tvident._command_line.group import commands, main
from tvident._command_line.identification import IDENTIFICATION
from tvident._command_line.options import RUN


@main.command(epilog="Example: tvident identify rig.csv --angle angle --torque torque --time time -o result.csv")
@click.argument("file", type=click.Path(), required=False)
@IDENTIFICATION
@click.option("--settings-output", type=click.Path(dir_okay=False), help="JSON file for the settings of this run.")
@click.option("--json", "as_json", is_flag=True, help="Print verdict, numbers, advice and settings as JSON.")
@click.option("--explain", is_flag=True, help="Walk through what was asked, found, tested and tried.")
@click.option(
    "--in-pieces",
    is_flag=True,
    help="A recording longer than memory: from FILE to -o, piece by piece; goes on where it was interrupted.",
)
@RUN
def identify(**options: Any) -> None:
    """Identify inertia, damping and stiffness from the angle and torque in FILE.

    What is not given is chosen from the recording, and the summary says what and why.
    """
    commands().identify(**options)
