"""The command ``tvident derivatives``."""

from __future__ import annotations

from typing import Any, get_args

import click

from tvident._choices import Loss, RowPolicy, Selection
from tvident._command_line.group import commands, main
from tvident._command_line.options import CRITERION, MISSING, PERIOD, RUN, TIME, TIME_UNIT, only_options_from_toml


@main.command(epilog="Example: tvident derivatives rig.csv --channel angle --time time -o derivatives.csv")
@click.argument("file", type=click.Path())
@click.option("--channel", metavar="NAME", help="Channel to differentiate; of one channel beside times not needed.")
@click.option(
    "--window-length",
    default="auto",
    show_default=True,
    help="Samples, odd, a duration such as '0.2 s', or auto: chosen.",
)
@TIME
@TIME_UNIT
@MISSING
@click.option("--max-order", type=int, default=15, show_default=True, help="Highest candidate order.")
@click.option("--order", type=int, help="Fixes the order.")
@CRITERION
@click.option(
    "--selection", type=click.Choice(get_args(Selection)), help="Whose criterion: the window's, or its neighbours' too."
)
@click.option(
    "--loss",
    type=click.Choice(get_args(Loss)),
    default="squares",
    show_default=True,
    help="huber: spikes move derivatives by little.",
)
@PERIOD
@click.option("--quantisation", type=float, help="Step that the channel was rounded to; looked for if not given.")
@click.option("--max-deriv", type=int, default=2, show_default=True, help="Highest derivative.")
@click.option(
    "--nan-policy",
    type=click.Choice(get_args(RowPolicy)),
    default="propagate",
    show_default=True,
    help="Missing values.",
)
@click.option("--weights", metavar="NAME", help="Channel of weights: one over the variance of each sample's noise.")
@click.option("--max-gap", help="Longer gaps split the record: samples or a duration. Half a window if not given.")
@click.option(
    "--min-observations", type=int, help="Samples that a window with a gap must hold. Half of them if not given."
)
@click.option(
    "--settings",
    type=click.Path(),
    is_eager=True,
    expose_value=False,
    callback=only_options_from_toml,
    help="TOML file of options, as order = 7.",
)
@RUN
def derivatives(**options: Any) -> None:
    """Differentiate a channel of FILE with a polynomial order chosen in every window."""
    commands().derivatives(**options)
