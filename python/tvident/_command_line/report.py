"""The command ``tvident report``."""

from __future__ import annotations

from typing import Any

import click

from tvident._command_line.group import commands, main
from tvident._command_line.identification import IDENTIFICATION
from tvident._command_line.options import WORK


@main.command(epilog="Example: tvident report rig.csv --angle angle --torque torque --time time -o report.html")
@click.argument("file", type=click.Path(), required=False)
@IDENTIFICATION
@WORK
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False),
    default="report.html",
    show_default=True,
    help="The page: a name that ends in .html, or - for standard output.",
)
def report(**options: Any) -> None:
    """Identify as identify does, and write a page that shows the recording and the result.

    The page opens in any browser without a network: verdict, warnings with their times, settings, and plots of all channels of FILE and
    of all results that can be zoomed down to the sample.
    """
    commands().report(**options)
