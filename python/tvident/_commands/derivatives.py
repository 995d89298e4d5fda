"""The command ``tvident derivatives``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import tvident
from tvident._commands.channels import channel_of, channels_in, check_has_times, only_channel
from tvident._commands.given import check_time, given, length, period_of, wanted_progress
from tvident._commands.output import (
    PICTURE,
    RECORDING,
    RESULTS,
    check_outputs,
    end_without_result,
    figures_on_file,
    give,
    save_figure,
)
from tvident._commands.rates import say_other_rate
from tvident._status import describe
from tvident._units import ROTARY, derivative_units, factor_to, named_unit, times_in_seconds, unit_said


# Options that need work before they are passed on are parameters of their own.
def derivatives(
    file: str,
    channel: str | None,
    window_length: str,
    sample_rate: float | None,
    delta: float | None,
    time_channel: str | None,
    time_unit: str | None,
    period: str | None,
    weights: str | None,
    max_gap: str | None,
    output: str | None,
    plot: str | None,
    progress: bool | None,  # noqa: FBT001 - click passes options by name
    **options: Any,
) -> None:
    """Differentiate a channel of FILE with a polynomial order chosen in every window."""
    check_outputs({RESULTS: output, PICTURE: plot}, {RECORDING: file})
    channels = channels_in(file)
    if channel is None:
        channel = only_channel(channels, time_channel, file)
    check_has_times("derivatives need", check_time(sample_rate, delta, time_channel), channels, file)
    samples = channel_of(channels, channel, file)
    say_other_rate(channels, {"sample_rate": sample_rate, "delta": delta, "time_unit": time_unit}, samples.shape, file)
    times = None if time_channel is None else times_in_seconds(channel_of(channels, time_channel, file), time_unit)
    delta = None if delta is None else delta * factor_to(ROTARY, "time", time_unit, name="the time")
    fit = tvident.fit_local_polynomials(
        samples,
        length(window_length),
        delta=delta,
        sample_rate=sample_rate,
        t=times,
        period=period_of(period),
        weights=None if weights is None else channel_of(channels, weights, file),
        max_gap=None if max_gap is None else length(max_gap),
        progress=wanted_progress(progress),
        **given(options),
    )
    names = ["value", *(f"derivative_{d}" for d in range(1, fit.derivatives.shape[0]))]
    columns: dict[str, npt.NDArray[Any]] = {"time": fit.time}
    unit = unit_said(samples)
    units = {"time": "s", "sigma": unit}
    each = derivative_units(unit, len(names))
    for name, of_name, values, errors in zip(names, each, fit.derivatives, fit.stderr, strict=True):
        columns |= {name: values, f"{name}_stderr": errors}
        units |= {name: of_name, f"{name}_stderr": of_name}
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
    give(columns, units, "\n".join(words), output)
    if plot is not None:
        raw = samples[:: options["step"]]
        is_raw = period is None and raw.shape == fit.time.shape
        name = named_unit(channel)[0]
        drawn = figures_on_file().plot_derivatives(fit.time, fit, name, samples=raw if is_raw else None, unit=unit)
        save_figure(drawn, Path(plot))
    end_without_result(fit.status)
