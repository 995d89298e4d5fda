"""The command ``tvident live``."""

from __future__ import annotations

from typing import Any

import click

from tvident._choices import TERM_NAMES
from tvident._command_line.group import commands, main
from tvident._command_line.method import METHOD
from tvident._command_line.quantities import RATE


def _only_standard_input(_: click.Context, __: click.Parameter, file: str) -> str:
    """Refuse a file: what is recorded while it is taken comes through a pipe."""
    if file != "-":
        raise click.UsageError(
            f"live takes what is piped in, as -; got {file!r}; write tvident live - < {file}, or identify a file that is whole: "
            "tvident identify"
        )
    return file


@main.command(
    epilog="Example: a-driver | tvident live - --angle position --torque effort --time t --sample-rate 1000 --method paper"
)
@click.argument("file", metavar="[-]", default="-", callback=_only_standard_input)
@click.option(
    "--lsl", metavar="NAME", help="Take a stream of the Lab Streaming Layer instead: its name, type=… or source_id=…."
)
@click.option(
    "--angle", required=True, metavar="NAME", help="Channel of the angle: column, key, label, or number from 0."
)
@click.option("--torque", required=True, metavar="NAME", help="The same for the torque.")
@click.option(
    "--time", "time_channel", metavar="NAME", help="The same for stamps in seconds, by which losses are found."
)
@click.option("--counter", metavar="NAME", help="The same for a number that each sample counts up.")
@click.option(
    "--angle-unit", metavar="UNIT", help="Unit of the angle, as deg; by default its header's or label's, or rad."
)
@click.option(
    "--torque-unit", metavar="UNIT", help="Unit of the torque, as 'N mm'; by default its header's or label's, or N m."
)
@click.option("--sample-rate", type=RATE, help="Nominal samples per second; by default that of the LSL stream.")
@METHOD
@click.option("--inertia", metavar="KIND", help="constant, windowed, or a known number.")
@click.option("--damping", metavar="KIND", help="The same for damping; 0 leaves it out.")
@click.option("--stiffness", metavar="KIND", help="The same for stiffness.")
@click.option(
    "--term",
    "terms",
    multiple=True,
    metavar="TERM[:KIND]",
    help=f"{', '.join(TERM_NAMES)}; none removes the default offset.",
)
@click.option("--lag", metavar="TIME", hidden=True)
@click.option(
    "--half-life", metavar="LENGTH", help="Of constants: samples, or '10 s', after which an equation counts half."
)
@click.option("--settings", type=click.Path(), help="Settings of an earlier result, as identify takes them.")
@click.option("--step", type=int, default=1, show_default=True, help="Every how many samples a result is wanted.")
@click.option(
    "--to",
    "shown",
    type=click.Choice(["table", "json", "nothing"]),
    help="On standard output: a table (the default on a terminal), or JSON lines (otherwise).",
)
@click.option("--every", type=float, default=1.0, show_default=True, help="Seconds from line to line of the table.")
@click.option("--udp", metavar="HOST:PORT", help="Send JSON datagrams too, as PlotJuggler takes them at port 9870.")
@click.option(
    "--lsl-output", metavar="NAME", help="Send a stream of the Lab Streaming Layer too: parameters, errors, status."
)
@click.option("--duration", type=float, help="Seconds after which to end; by default when the source does.")
def live(**options: Any) -> None:
    """Identify while angle and torque are recorded: from lines on standard input, or from the Lab Streaming Layer.

    Lines are CSV, with a header or without, or JSON objects or lists. Parameters come with a fixed delay; lost samples count as missing.
    At the end the effective rate, the drift of the clock and what was lost go to standard error.
    """
    commands().live(**options)
