"""Options that several commands have, and what their values mean."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping
from functools import wraps
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar, get_args

import click

from tvident._command_line.output import figures_on_file
from tvident._derivatives import Criterion
from tvident._files import check_apart, check_folder, check_place, printable

Decorated = TypeVar("Decorated", bound=Callable[..., Any])


def options_of(*options: Callable[[Decorated], Decorated]) -> Callable[[Decorated], Decorated]:
    def decorate(function: Decorated) -> Decorated:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


def _named(function: Callable[..., Any]) -> Callable[..., Any]:
    """Put what a joint is recorded as in place of its name, and ask for channels where there is none."""

    @wraps(function)
    def call(*, joint: str | None = None, **options: Any) -> Any:
        missing = [name for name in ("angle", "torque") if options[name] is None]
        if joint is None and (options.get("velocity") or options.get("acceleration")):
            missing = [name for name in missing if name != "angle"]
        if joint is None and missing:
            raise click.UsageError(f"Missing option '--{missing[0]}'; name the channel, or a --joint of a ROS bag")
        if joint is not None:
            if len(missing) < 2:  # noqa: PLR2004 - angle and torque
                raise click.UsageError("--joint stands for --angle and --torque; got one of these too; drop it")
            options |= {"angle": f"{joint}.position", "torque": f"{joint}.effort"}
            if not any(options.get(name) for name in ("sample_rate", "delta", "time_channel")):
                options["time_channel"] = "time"
        return function(**options)

    return call


CHANNELS = options_of(
    click.option("--angle", metavar="NAME", help="Channel of the angle, or a file that holds it alone."),
    click.option("--torque", metavar="NAME", help="Channel of the torque, or a file that holds it alone."),
    click.option("--joint", metavar="NAME", help="Of a ROS bag, instead: its position, its effort and their stamps."),
    _named,
    click.option("--angle-scale", metavar="SCALE", help="Number or variable to multiply the angle by."),
    click.option("--torque-scale", metavar="SCALE", help="Number or variable to multiply the torque by."),
    click.option(
        "--angle-unit", metavar="UNIT", help="Unit of the angle, as deg or mm; by default its header's, or rad."
    ),
    click.option(
        "--torque-unit", metavar="UNIT", help="Unit of the torque, as 'N mm'; by default its header's, or N m."
    ),
    click.option("--time-unit", metavar="UNIT", help="Unit of the time channel, as ms; by default its header's, or s."),
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
    click.option("--sample-rate", type=float, help="Samples per second."),
    click.option("--delta", type=float, help="Sample period in seconds."),
    click.option("--time", "time_channel", metavar="NAME", help="Channel that holds the time in seconds."),
)

WORK = options_of(
    click.option("--step", type=int, default=1, show_default=True, help="Every how many samples a result is wanted."),
    click.option("--workers", type=int, help="Threads; by default all processors."),
    click.option("--progress/--no-progress", default=None, help="Show progress; by default on a terminal."),
)

RUN = options_of(
    WORK,
    click.option(
        "-o",
        "--output",
        type=click.Path(dir_okay=False),
        help="File for the results: .csv, .npz, .parquet, .h5, .mat or .xlsx, or - for CSV here.",
    ),
    click.option("--plot", type=click.Path(dir_okay=False), help="Picture of the results: PNG, PDF or SVG."),
)

RESULTS, PICTURE, SETTINGS, RECORDING = "results", "the picture", "the settings of this run", "the recording"
REPORT = "the report"
"""What messages call files."""

CRITERION = click.option(
    "--criterion", type=click.Choice(get_args(Criterion)), help="Criterion that chooses the order."
)


def length(text: str) -> int | str:
    """Return a number of samples, or a duration as it is."""
    return int(text) if text.strip().lstrip("+-").isdigit() else text


def period_of(text: str | None) -> float | None:
    """Return a period from a number, or from a multiple of π such as ``2pi``."""
    if text is None:
        return None
    number, of_pi, rest = text.strip().lower().replace("π", "pi").partition("pi")
    try:
        value = float(number or (of_pi and 1))
    except ValueError:
        value = math.nan
    if rest or not (math.isfinite(value) and value > 0):
        raise click.UsageError(
            f"--period must be a number above zero, or a multiple of pi such as 2pi; got {text!r}; repair it"
        )
    return value * math.pi if of_pi else value


def given(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that were given."""
    return {name: value for name, value in options.items() if value is not None}


def wanted_progress(wanted: bool | None) -> bool:  # noqa: FBT001 - an option's value
    """Return whether to show progress: on a terminal and if there are bars, unless told otherwise."""
    return sys.stderr.isatty() and find_spec("tqdm") is not None if wanted is None else wanted


def check_time(sample_rate: float | None, delta: float | None, time_channel: str | None) -> bool:
    """Return whether the sample period was given; refuse several."""
    ways = {"--sample-rate": sample_rate, "--delta": delta, "--time": time_channel}
    given = [name for name, value in ways.items() if value is not None]
    if len(given) > 1:
        raise click.UsageError(f"give only one of {', '.join(ways)}; got {' and '.join(given)}; drop all but one")
    return bool(given)


def check_outputs(outputs: Mapping[str, str | None], inputs: Mapping[str, str | None]) -> None:
    """Refuse what cannot be written, or would write over what is read, before any work is done.

    Keys are what messages call the files.
    """
    output, plot, settings = (outputs.get(name) for name in (RESULTS, PICTURE, SETTINGS))
    if output == "-" and sys.stdout is None:
        raise click.UsageError("-o - needs standard output; it is closed; open it, or give a file")
    if output is not None and output != "-":
        check_place(Path(output))
    if plot is not None:
        figures_on_file()
        if Path(plot).suffix.lower() not in {".png", ".pdf", ".svg"}:
            raise click.UsageError(f"--plot must end in .png, .pdf or .svg; got '{printable(plot)}'; rename it")
        check_folder(Path(plot))
    for place in (settings, outputs.get(REPORT)):
        if place is not None:
            check_folder(Path(place))
    files = {name: path for name, path in outputs.items() if (name, path) != (RESULTS, "-")}
    check_apart(files, inputs)
