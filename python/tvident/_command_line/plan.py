"""The command ``tvident plan``."""

from __future__ import annotations

from typing import Any

import click

from tvident._command_line.group import commands, main
from tvident._command_line.quantities import RATE


@main.command(
    epilog="Example: tvident plan --inertia 0.0123 --damping 0.008 --stiffness 13 --band 0.5 12 --torque-noise 0.02 --torque-rms 0.2"
)
@click.argument("file", type=click.Path(), required=False)
@click.option("--inertia", type=float, help="A guess, kg m^2, or kg of an axis that slides.")
@click.option("--damping", type=float, help="A guess, N m s/rad, or N s/m.")
@click.option("--stiffness", type=float, help="A guess, N m/rad, or N/m.")
@click.option("--band", type=float, nargs=2, help="Lowest and highest frequency that can be excited, Hz.")
@click.option("--torque-noise", type=float, help="Standard deviation of a sample of the torque.")
@click.option("--angle-noise", type=float, help="The same of the angle; 0 by default.")
@click.option("--wanted", type=float, default=0.02, show_default=True, help="Relative error of the stiffness.")
@click.option("--duration", type=float, help="Seconds; planned if there is a torque.")
@click.option("--torque-rms", type=float, help="Root mean square of the torque; planned if there is a duration.")
@click.option(
    "--angle-unit", metavar="UNIT", help="Unit of --angle-noise, as deg, or mm: the axis slides; rad by default."
)
@click.option(
    "--torque-unit", metavar="UNIT", help="Unit of --torque-noise and --torque-rms, as 'N mm', or N; N m by default."
)
@click.option("--resolution", type=float, help="Seconds over which a stiffness that changes may be averaged.")
@click.option("--sample-rate", type=RATE, help="Samples per second; 1000 by default.")
@click.option("--more", type=float, help="Seconds to be recorded in addition to FILE; 60 by default.")
@click.option("--json", "as_json", is_flag=True, help="Print the plan as JSON, with its units.")
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="File for the torque, of a kind by its ending.")
def plan(**options: Any) -> None:
    """Say how long to record, which frequencies and amplitude give a wanted error, or what more of FILE would bring.

    FILE is a result that identify saved as NPZ or Parquet.
    """
    commands().plan(**options)
