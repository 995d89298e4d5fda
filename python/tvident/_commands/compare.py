"""The command ``tvident compare``."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt

import tvident
from tvident import baselines, recordings
from tvident._commands import plain
from tvident._commands.channels import (
    channel_of,
    channels_in,
    check_has_times,
    mask_of,
    source_of,
    times_of,
)
from tvident._commands.equation import lag_of, parameter_of, terms_of
from tvident._commands.given import check_time, given
from tvident._commands.named import named, with_joint
from tvident._commands.output import PICTURE, RECORDING, RESULTS, check_outputs, give, save_figure
from tvident._commands.own_clocks import check_own_clocks
from tvident._commands.rates import say_other_rate
from tvident._commands.scales import scaled
from tvident._commands.words import in_options
from tvident._equation import COEFFICIENTS
from tvident._units import axis_of


# Options that need work before they are passed on are parameters of their own.
def compare(
    file: str | None,
    angle_scale: str | None,
    torque_scale: str | None,
    models: tuple[str, ...],
    lag: str | None,
    torque_time: str | None,
    mask: str | None,
    output: str | None,
    plot: str | None,
    *,
    methods: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Compare candidates for the equation of motion of the angle and torque in FILE."""
    options = named(options, file)
    check_outputs(
        {RESULTS: output, PICTURE: plot},
        {RECORDING: file, "the angle": options["angle"], "the torque": options["torque"], "the mask": mask},
    )
    channels = channels_in(file)
    options = with_joint(options, channels, file)
    angle, torque, time_channel = (options.pop(name) for name in ("angle", "torque", "time_channel"))
    check_own_clocks(channels, [angle, torque], time_channel, torque_time, file, has_rate=False, takes_both=not methods)
    check_has_times("compare needs", check_time(options["sample_rate"], options["delta"], time_channel), channels, file)
    common: dict[str, Any] = {
        name: parameter_of(value, channels, file) if name in COEFFICIENTS else value
        for name, value in given(options).items()
    }
    if methods and (models or plot or lag or mask or torque_time):
        raise click.UsageError(
            "--methods compares methods alone; got options of models; leave --model, --plot, --lag, --torque-time and --mask out"
        )
    scales = {"angle": angle_scale, "torque": torque_scale}
    signals = [
        scaled(
            source_of(channels, one, file), scales[name], channels, file, quantity=name, unit=common.get(f"{name}_unit")
        )
        for name, one in (("angle", angle), ("torque", torque))
    ]
    say_other_rate(channels, options, np.shape(signals[0]), file)
    times = times_of(channels, time_channel, angle, file)
    if methods:
        _methods(channels, [*signals, times], common, output, as_json=as_json)
        return
    if lag is not None:
        common["lag"] = lag_of(lag)
    if mask is not None:
        common["mask"] = mask_of(source_of(channels, mask, file))
    if torque_time is not None and times is None:
        raise click.UsageError("--torque-time needs the times of the angle, too; got none; give --time")
    if times is not None:
        common["t"] = times if torque_time is None else (times, channel_of(channels, torque_time, file))
    result = tvident.compare_models(
        *signals,
        models={name: {"terms": terms_of(tuple(name.split(",")))} for name in models} or None,
        **common,
    )
    units = next(iter(result.results.values())).units
    words = plain.as_json(_content(result, units)) if as_json else result.summary()
    give(result.table, {"residual_std": units["residual_std"]}, words, output)
    if plot is not None:
        save_figure(result.plot(), Path(plot))
    if not np.any(result.table["weight"]):
        click.get_current_context().exit(1)


def _content(result: tvident.ModelComparison, units: Mapping[str, str]) -> dict[str, Any]:
    """Return what the summary says."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of what is NaN everywhere
        averaged = {
            name: {"value": np.nanmedian(value), "stderr": np.nanmedian(error), "unit": units.get(name, "")}
            for name, (value, error) in result.averaged.items()
        }
    return {
        "verdict": in_options(result.summary().splitlines()[-1]),
        "best": result.best if np.any(result.table["weight"]) else None,
        "observations": result.observations,
        "models": _rows(result.table),
        "averaged": averaged,
    }


def _rows(table: Mapping[str, npt.NDArray[Any]]) -> list[dict[str, Any]]:
    return [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)]


def _methods(
    channels: recordings.Channels,
    signals: Sequence[Any],
    common: Mapping[str, Any],
    output: str | None,
    *,
    as_json: bool,
) -> None:
    """Compare methods on one recording, in rad, N m and s, as a truth that the file may hold is."""
    angle, torque, times = signals
    axis = axis_of(
        angle, torque, times, **{name: common.get(name) for name in ("angle_unit", "torque_unit", "time_unit")}
    )
    rate = common.get("sample_rate") or (1 / (axis.time * common["delta"]) if "delta" in common else None)
    rate = rate or 1 / (axis.time * float(np.median(np.diff(np.asarray(times, np.float64)))))
    known = {}
    for name in COEFFICIENTS:
        with suppress(KeyError):
            known[name] = np.asarray(channel_of(channels, name, None))
    truth = known if len(known) == len(COEFFICIENTS) else None
    found = baselines.compare_methods(
        np.asarray(angle) * axis.angle, np.asarray(torque) * axis.torque, sample_rate=rate, truth=truth
    )
    give(found.table, {}, plain.as_json({"methods": _rows(found.table)}) if as_json else found.summary(), output)
