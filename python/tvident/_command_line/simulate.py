"""The command ``tvident simulate``."""

from __future__ import annotations

from typing import Any, get_args

import click

from tvident._choices import Excitation, Pattern
from tvident._command_line.group import commands, main
from tvident._command_line.quantities import RATE


@main.command()
@click.argument("output", type=click.Path(dir_okay=False))
@click.option("--duration", type=float, default=20.0, show_default=True, help="Seconds.")
@click.option("--sample-rate", type=RATE, default=1000.0, show_default=True, help="Samples per second.")
@click.option("--seed", type=int, default=0, show_default=True, help="The same seed gives the same recording.")
@click.option(
    "--pattern", type=click.Choice(get_args(Pattern)), default="slider", show_default=True, help="How stiffness moves."
)
@click.option(
    "--excitation", type=click.Choice(get_args(Excitation)), default="multisine", show_default=True, help="Torque."
)
@click.option("--torque-snr-db", type=float, default=20.0, show_default=True, help="Torque over its noise, dB.")
@click.option(
    "--angle-noise", type=float, default=1e-4, show_default=True, help="Noise over the angle's standard deviation."
)
@click.option("--encoder-counts", type=int, help="Counts a turn, instead of noise.")
def simulate(**options: Any) -> None:
    """Write a simulated recording of the paper's rig, with its truth, to OUTPUT: a CSV file, or of another kind by its ending."""
    commands().simulate(**options)
