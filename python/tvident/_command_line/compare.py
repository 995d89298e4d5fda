"""The command ``tvident compare``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

import tvident
from tvident._command_line.channels import at_even_times, channels_in, mask_of, scaled, source_of, times_of
from tvident._command_line.equation import lag_of, parameter_of, terms_of
from tvident._command_line.group import main
from tvident._command_line.options import CHANNELS, PICTURE, RECORDING, RESULTS, TIME, check_outputs, check_time, given
from tvident._command_line.output import give, save_figure
from tvident._equation import COEFFICIENTS, TERM_NAMES


# Every option is a parameter: so click passes them.
@main.command(epilog="Example: tvident compare rig.csv --angle angle --torque torque --time time")
@click.argument("file", type=click.Path(), required=False)
@CHANNELS
@TIME
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
    help=f"Terms of a candidate, of {', '.join(TERM_NAMES)}, or none; repeat it. By default eight candidates are compared.",
)
@click.option("--lag", metavar="TIME", help="Delay of the torque: seconds, '2 ms', or auto.")
@click.option("--mask", metavar="NAME", help="Channel, or file, that is not zero where a sample may be used.")
@click.option("--workers", type=int, help="Threads; by default all processors.")
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False),
    help="File for the table, of a kind by its ending, or - for CSV here.",
)
@click.option("--plot", type=click.Path(dir_okay=False), help="Picture of the weights: PNG, PDF or SVG.")
def compare(
    file: str | None,
    angle: str,
    torque: str,
    angle_scale: str | None,
    torque_scale: str | None,
    time_channel: str | None,
    models: tuple[str, ...],
    lag: str | None,
    mask: str | None,
    output: str | None,
    plot: str | None,
    **options: Any,
) -> None:
    """Compare candidates for the equation of motion of the angle and torque in FILE.

    Says which terms the recording supports, and parameters averaged over the models with errors that know of the choice.
    """
    check_outputs(
        {RESULTS: output, PICTURE: plot},
        {RECORDING: file, "the angle": angle, "the torque": torque, "the mask": mask},
    )
    if not check_time(options["sample_rate"], options["delta"], time_channel):
        raise click.UsageError("compare needs the sample period; got none; give --sample-rate, --delta or --time")
    channels = channels_in(file)
    common: dict[str, Any] = {
        name: parameter_of(value, channels, file) if name in COEFFICIENTS else value
        for name, value in given(options).items()
    }
    if lag is not None:
        common["lag"] = lag_of(lag)
    if mask is not None:
        common["mask"] = mask_of(source_of(channels, mask, file))
    signals = [source_of(channels, name, file) for name in (angle, torque)]
    times = times_of(channels, time_channel, angle, file)
    if times is not None:
        common["t"], signals = at_even_times(times, signals, file)
    result = tvident.compare_models(
        scaled(signals[0], angle_scale, channels, file),
        scaled(signals[1], torque_scale, channels, file),
        models={name: {"terms": terms_of(tuple(name.split(",")))} for name in models} or None,
        **common,
    )
    units = next(iter(result.results.values())).units
    give(result.table, {"residual_std": units["residual_std"]}, result.summary(), output)
    if plot is not None:
        save_figure(result.plot(), Path(plot))
