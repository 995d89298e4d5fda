"""Options of every command that identifies: what decides what is identified."""

from __future__ import annotations

from typing import get_args

import click

from tvident._choices import TERM_NAMES, RowPolicy
from tvident._command_line.method import METHOD
from tvident._command_line.options import BESIDE, CHANNELS, MISSING, PERIOD, TIME, options_from_toml, options_of

IDENTIFICATION = options_of(
    CHANNELS,
    BESIDE,
    PERIOD,
    TIME,
    MISSING,
    METHOD,
    click.option("--inertia", metavar="KIND", help="auto, constant, windowed, varying, a known number, or a channel."),
    click.option("--damping", metavar="KIND", help="The same for damping; 0 leaves it out."),
    click.option("--stiffness", metavar="KIND", help="The same for stiffness."),
    click.option(
        "--term",
        "terms",
        multiple=True,
        metavar="TERM[:KIND]",
        help=f"{', '.join(TERM_NAMES)}; may be repeated; none removes the default offset.",
    ),
    click.option(
        "--instrument",
        metavar="NAME",
        help="Channel, or file, that moves the system and that no noise of the others reaches.",
    ),
    click.option("--lag", metavar="TIME", help="Delay of the torque: seconds, '2 ms', or auto."),
    click.option(
        "--torque-time", metavar="NAME", help="Channel of times of the torque, where it has a clock of its own."
    ),
    click.option(
        "--align",
        metavar="HOW",
        help="By how much times of the torque are late: offset or drift (found from the equation), or a time such as '2 ms'.",
    ),
    click.option(
        "--quantisation", type=float, help="Step to which the angle was rounded; estimated if not given; 0: none."
    ),
    click.option(
        "--loss",
        type=click.Choice(["squares", "huber", "auto"]),
        help="squares (default); huber: spikes of the torque count linearly; auto: where there are any.",
    ),
    click.option("--mask", metavar="NAME", help="Channel, or file, that is not zero where a sample may be used."),
    click.option(
        "--weights", metavar="NAME", help="Channel, or file, of weights: one over the variance of each sample's noise."
    ),
    click.option(
        "--settings",
        type=click.Path(),
        is_eager=True,
        callback=options_from_toml,
        help="Settings of an earlier run: its result, or what --settings-output wrote; or a TOML file of options.",
    ),
    click.option(
        "--nan-policy",
        type=click.Choice(get_args(RowPolicy)),
        default="omit",
        show_default=True,
        help="Missing values: omit their equations, propagate to all windows that contain one, or raise.",
    ),
)
"""Everything that decides what is identified; the file comes before it."""
