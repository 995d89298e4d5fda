"""The command ``tvident compare``."""

from __future__ import annotations

from typing import Any

import click

from tvident._choices import TERM_NAMES
from tvident._command_line.group import commands, main
from tvident._command_line.options import CHANNELS, MISSING, TIME


@main.command(epilog="Example: tvident compare rig.csv --angle angle --torque torque --time time")
@click.argument("file", type=click.Path(), required=False)
@CHANNELS
@TIME
@MISSING
@click.option(
    "--inertia", metavar="KIND", help="For all models: auto, constant, windowed, varying, a number, a channel."
)
@click.option(
    "--damping", metavar="KIND", help="The same for damping; the models that are compared by default leave it out once."
)
@click.option("--stiffness", metavar="KIND", help="The same for stiffness.")
@click.option(
    "--model",
    "models",
    multiple=True,
    metavar="TERM,TERM…",
    help=f"Terms of a candidate, of {', '.join(TERM_NAMES)}, or none; repeat it. By default nine candidates are compared.",
)
@click.option(
    "--methods",
    is_flag=True,
    help="Compare methods instead: this one and those that came before. Errors are shown where FILE has the truth, as that of simulate.",
)
@click.option("--lag", metavar="TIME", help="Delay of the torque: seconds, '2 ms', or auto.")
@click.option("--torque-time", metavar="NAME", help="Channel of times of the torque, where it has a clock of its own.")
@click.option("--mask", metavar="NAME", help="Channel, or file, that is not zero where a sample may be used.")
@click.option("--workers", type=int, help="Threads; by default all processors.")
@click.option("--json", "as_json", is_flag=True, help="Print verdict, table and averaged parameters as JSON.")
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False),
    help="File for the table, of a kind by its ending, or - for CSV here.",
)
@click.option("--plot", type=click.Path(dir_okay=False), help="Picture of the weights: PNG, PDF or SVG.")
def compare(**options: Any) -> None:
    """Compare candidates for the equation of motion of the angle and torque in FILE.

    Says which terms the recording supports, and parameters averaged over the models with errors that know of the choice.
    """
    commands().compare(**options)
