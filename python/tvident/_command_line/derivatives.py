"""The command ``tvident derivatives``."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import click
import numpy as np
import numpy.typing as npt

import tvident
from tvident import _arguments as arguments
from tvident._command_line.channels import channel_of, channels_in
from tvident._command_line.group import main
from tvident._command_line.options import (
    CRITERION,
    PERIOD,
    PICTURE,
    RECORDING,
    RESULTS,
    RUN,
    TIME,
    check_outputs,
    check_time,
    given,
    length,
    period_of,
    wanted_progress,
)
from tvident._command_line.output import figures_on_file, give, save_figure
from tvident._derivatives import Selection
from tvident._status import describe
from tvident._units import times_in_seconds


# Every option is a parameter: so click passes them.
@main.command(epilog="Example: tvident derivatives rig.csv --channel angle --time time -o derivatives.csv")
@click.argument("file", type=click.Path())
@click.option("--channel", required=True, metavar="NAME", help="Channel to differentiate.")
@click.option(
    "--window-length",
    default="auto",
    show_default=True,
    help="Samples, odd, a duration such as '0.2 s', or auto: chosen.",
)
@TIME
@click.option("--max-order", type=int, default=15, show_default=True, help="Highest candidate order.")
@click.option("--order", type=int, help="Fixes the order.")
@CRITERION
@click.option(
    "--selection", type=click.Choice(get_args(Selection)), help="Whose criterion: the window's, or its neighbours' too."
)
@PERIOD
@click.option("--quantisation", type=float, help="Step that the channel was rounded to; looked for if not given.")
@click.option("--max-deriv", type=int, default=2, show_default=True, help="Highest derivative.")
@click.option(
    "--nan-policy",
    type=click.Choice(get_args(arguments.NanPolicy)),
    default="propagate",
    show_default=True,
    help="Missing values.",
)
@RUN
def derivatives(
    file: str,
    channel: str,
    window_length: str,
    sample_rate: float | None,
    delta: float | None,
    time_channel: str | None,
    period: str | None,
    output: str | None,
    plot: str | None,
    progress: bool | None,  # noqa: FBT001 - click passes options by name
    **options: Any,
) -> None:
    """Differentiate a channel of FILE with a polynomial order chosen in every window."""
    check_outputs({RESULTS: output, PICTURE: plot}, {RECORDING: file})
    if not check_time(sample_rate, delta, time_channel):
        raise click.UsageError("derivatives need the sample period; got none; give --sample-rate, --delta or --time")
    channels = channels_in(file)
    samples = channel_of(channels, channel, file)
    times = None if time_channel is None else times_in_seconds(channel_of(channels, time_channel, file))
    fit = tvident.fit_local_polynomials(
        samples,
        length(window_length),
        delta=delta,
        sample_rate=sample_rate,
        t=times,
        period=period_of(period),
        progress=wanted_progress(progress),
        **given(options),
    )
    seconds = arguments.sample_period(samples.size, delta=delta, sample_rate=sample_rate, t=times)
    start = 0.0 if times is None else float(times[0])
    step = int(options["step"])
    names = ["value", *(f"derivative_{d}" for d in range(1, fit.derivatives.shape[0]))]
    columns: dict[str, npt.NDArray[Any]] = {"time": start + np.arange(0, samples.size, step) * seconds}
    for name, values, errors in zip(names, fit.derivatives, fit.stderr, strict=True):
        columns |= {name: values, f"{name}_stderr": errors}
    columns |= {"sigma": fit.sigma, "order": fit.order, "status": fit.status}
    counts = np.bincount(fit.order.ravel())
    orders = ", ".join(f"{order}: {count / fit.order.size:.0%}" for order, count in enumerate(counts) if count)
    windows = ", ".join(str(length) for length in np.atleast_1d(fit.window_length))
    words = [f"{samples.size} samples, windows of {windows}; orders {orders}", "", *describe(fit.status)]
    if splits := fit.settings.get("splits"):
        words.append(
            f"{len(splits)} gaps do not say how often the angle went round in them, the first before sample {splits[0]}: from there on "
            "the value may be wrong by whole periods"
        )
    give(columns, {"time": "s"}, "\n".join(words), output)
    if plot is not None:
        save_figure(figures_on_file().plot_derivatives(columns["time"], fit, channel), Path(plot))
