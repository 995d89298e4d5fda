"""Options that several commands have."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, get_args

import click

from tvident._choices import Criterion
from tvident._command_line.group import commands
from tvident._command_line.quantities import PERIOD_IN_TIME_UNIT, RATE

Decorated = TypeVar("Decorated", bound=Callable[..., Any])


def options_of(*options: Callable[[Decorated], Decorated]) -> Callable[[Decorated], Decorated]:
    def decorate(function: Decorated) -> Decorated:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


def options_from_toml(ctx: click.Context, _: click.Parameter, path: str | None) -> str | None:
    """Take what a TOML file holds for the options that are not given; return the path of settings of an earlier result."""
    if path is None or Path(path).suffix.lower() != ".toml":
        return path
    remaining: str | None = commands().options_from_toml(ctx, path)
    return remaining


def only_options_from_toml(ctx: click.Context, option: click.Parameter, path: str | None) -> None:
    """Take what a TOML file holds for the options that are not given; refuse settings of an identification."""
    if options_from_toml(ctx, option, path) is not None:
        raise click.UsageError(
            "--settings must be a file that ends in .toml and holds options, as order = 7; write one"
        )


TIME_UNIT = click.option(
    "--time-unit", metavar="UNIT", help="Unit of the time channel, as ms; by default its header's, or s."
)

CHANNELS = options_of(
    click.option("--angle", metavar="NAME", help="Channel of the angle, or a file that holds it alone."),
    click.option("--torque", metavar="NAME", help="Channel of the torque, or a file that holds it alone."),
    click.option(
        "--joint",
        metavar="NAME",
        help="Of a robot's log, instead: its position, its effort, its velocity and their stamps.",
    ),
    click.option("--angle-scale", metavar="SCALE", help="Number or variable to multiply the angle by."),
    click.option("--torque-scale", metavar="SCALE", help="Number or variable to multiply the torque by."),
    click.option(
        "--angle-unit", metavar="UNIT", help="Unit of the angle, as deg or mm; by default its header's, or rad."
    ),
    click.option(
        "--torque-unit", metavar="UNIT", help="Unit of the torque, as 'N mm'; by default its header's, or N m."
    ),
    TIME_UNIT,
)

BESIDE = options_of(
    click.option(
        "--velocity", metavar="NAME", help="Channel, or file, of a measured velocity, beside the angle or in its place."
    ),
    click.option("--acceleration", metavar="NAME", help="The same for a measured acceleration."),
)

PERIOD = click.option(
    "--period",
    metavar="PERIOD",
    help="Period of a wrapped angle, in the unit of the file: 360, or 2pi; it is unwrapped.",
)

TIME = options_of(
    click.option("--sample-rate", type=RATE, help="Samples per second."),
    click.option("--delta", type=PERIOD_IN_TIME_UNIT, help="Sample period in seconds."),
    click.option("--time", "time_channel", metavar="NAME", help="Channel that holds the time in seconds."),
)


def _keep_marks(ctx: click.Context, _: click.Parameter, marks: tuple[float, ...]) -> None:
    """Keep what marks missing values for whatever reads a file."""
    ctx.meta["tvident.missing"] = marks


MISSING = click.option(
    "--missing",
    type=float,
    multiple=True,
    expose_value=False,
    callback=_keep_marks,
    metavar="NUMBER",
    help="Number that marks values that are missing, as -9999; repeat it for several.",
)

WORK = options_of(
    click.option("--step", type=int, default=1, show_default=True, help="Every how many samples a result is wanted."),
    click.option("--workers", type=int, help="Threads; by default all processors."),
    click.option("--progress/--no-progress", default=None, help="Show progress; by default on a terminal."),
)


class OutputPath(click.Path):
    """A file, or a folder that holds arrays of Zarr."""

    def convert(
        self, value: str | os.PathLike[str], param: click.Parameter | None, ctx: click.Context | None
    ) -> str | bytes | os.PathLike[str]:
        """Return the path; refuse a folder of another kind."""
        is_zarr = Path(value).suffix.lower() == ".zarr"
        return click.Path().convert(value, param, ctx) if is_zarr else super().convert(value, param, ctx)


RUN = options_of(
    WORK,
    click.option(
        "-o",
        "--output",
        type=OutputPath(dir_okay=False),
        help="File for the results: .csv, .npz, .parquet, .h5, .mat or .xlsx, or - for CSV here.",
    ),
    click.option("--plot", type=click.Path(dir_okay=False), help="Picture of the results: PNG, PDF or SVG."),
)

CRITERION = click.option(
    "--criterion", type=click.Choice(get_args(Criterion)), help="Criterion that chooses the order."
)
