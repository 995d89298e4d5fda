"""Options of ``tvident identify`` for the method."""

from __future__ import annotations

from collections.abc import Callable
from typing import get_args

import click

from tvident._choices import Selection, Variation
from tvident._command_line.options import CRITERION, Decorated, options_of

METHODS = ("auto", "paper", "weak", "strong")

METHOD: Callable[[Decorated], Decorated] = options_of(
    click.option(
        "--method",
        type=click.Choice(METHODS),
        help="auto (the default): all settings chosen from the recording; paper: as in the paper; weak: test functions, strong: "
        "derivatives, with the following settings.",
    ),
    click.option(
        "--window-length",
        metavar="LENGTH",
        help="Test function, or window of the polynomials: samples, odd, or '0.2 s'.",
    ),
    click.option("--exponent", metavar="NUMBER", help="Weak form: exponent of the test function, 3 to 20, or auto."),
    click.option("--regression-window", metavar="LENGTH", help="Samples solved together: a number, '0.2 s', or auto."),
    click.option(
        "--averaging/--no-averaging",
        default=None,
        help="Weak form: windows of many lengths, or one window around each sample (the default with --regression-window).",
    ),
    click.option(
        "--variation",
        type=click.Choice(("auto", *get_args(Variation))),
        help="How windowed parameters may change within a window.",
    ),
    click.option("--max-order", type=int, help="Strong form: highest candidate order."),
    CRITERION,
    click.option("--selection", type=click.Choice(get_args(Selection)), help="Strong form: how orders are chosen."),
    click.option(
        "--filter-torque/--no-filter-torque",
        default=None,
        help="Strong form: smooth the torque with the orders of the angle.",
    ),
)
"""Options of the method."""
