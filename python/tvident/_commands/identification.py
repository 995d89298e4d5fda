"""Options of ``tvident identify`` and of ``tvident report``, and the identification that they stand for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import click
import numpy as np
import numpy.typing as npt

import tvident
from tvident import recordings
from tvident._commands.channels import channel_of, check_has_times, mask_of, source_of, times_of
from tvident._commands.equation import lag_of, parameter_of, terms_of
from tvident._commands.given import check_time, given, period_of, wanted_progress
from tvident._commands.method import NAMES, method_of
from tvident._commands.output import RECORDING
from tvident._commands.own_clocks import check_beside, check_own_clocks
from tvident._commands.rates import say_other_rate
from tvident._commands.scales import scaled
from tvident._commands.settings import read_settings
from tvident._commands.words import units_assumed
from tvident._equation import COEFFICIENTS
from tvident._units import axis_of


def inputs(file: str | None, options: Mapping[str, Any]) -> dict[str, str | None]:
    """Return the files that are read, by what messages call them."""
    named = {
        "the velocity": "velocity",
        "the acceleration": "acceleration",
        "the mask": "mask",
        "the weights": "weights",
        "the instrument": "instrument",
        "earlier settings": "settings",
    }
    return {
        RECORDING: file,
        "the angle": options["angle"],
        "the torque": options["torque"],
        **{words: options[name] for words, name in named.items()},
    }


# Options that need work before they are passed on are parameters of their own.
def identified(
    channels: recordings.Channels,
    file: str | None,
    *,
    angle: str | None,
    velocity: str | None,
    acceleration: str | None,
    torque: str,
    angle_scale: str | None,
    torque_scale: str | None,
    period: str | None,
    time_channel: str | None,
    method: str | None,
    terms: tuple[str, ...],
    instrument: str | None,
    lag: str | None,
    torque_time: str | None,
    align: str | None,
    mask: str | None,
    weights: str | None,
    settings: str | None,
    progress: bool | None,
    **options: Any,
) -> tvident.Identification:
    """Return what is identified from the channels of a file with these options."""
    is_given = check_time(options["sample_rate"], options["delta"], time_channel)
    of_method = {name: value for name, value in given(options).items() if name in NAMES}
    turn = None if period is None else scaled(np.asarray(period_of(period)), angle_scale, channels, file)
    motion = {"angle": angle, "velocity": velocity, "acceleration": acceleration}
    named = {name: channel for name, channel in motion.items() if channel is not None}
    has_rate = is_given and time_channel is None
    check_own_clocks(channels, [*named.values(), torque], time_channel, torque_time, file, has_rate=has_rate)
    beside: dict[str, str | None] = {f"--{name}": one for name, one in list(named.items())[1:]}
    beside |= {"--instrument": instrument, "--mask": mask, "--weights": weights}
    check_beside(channels, next(iter(named.values()), torque), beside, file)
    check_has_times("an identification needs", is_given, channels, file)
    recorded = [source_of(channels, name, file) for name in (*named.values(), torque)]
    times = times_of(channels, time_channel, next(iter(named.values())), file)
    signals = dict(zip(named, recorded, strict=False))
    if "angle" in signals:
        signals["angle"] = scaled(
            signals["angle"], angle_scale, channels, file, quantity="angle", unit=options.get("angle_unit")
        )
    signals["torque"] = scaled(
        recorded[-1], torque_scale, channels, file, quantity="torque", unit=options.get("torque_unit")
    )
    scales = {"angle": angle_scale, "torque": torque_scale}
    say_other_rate(channels, options, recorded[0].shape, file)
    _say_assumed({name: one for name, one in signals.items() if scales.get(name) is None}, times, options)
    result = tvident.identify(
        signals.get("angle"),
        signals["torque"],
        velocity=signals.get("velocity"),
        acceleration=signals.get("acceleration"),
        method=method_of(method, of_method, has_settings=settings is not None),
        t=times if torque_time is None else _both(times, channel_of(channels, torque_time, file)),
        align=_align_of(align),
        instrument=None if instrument is None else source_of(channels, instrument, file),
        period=None if turn is None else abs(float(turn)),
        lag=None if lag is None else lag_of(lag),
        mask=None if mask is None else mask_of(source_of(channels, mask, file)),
        weights=None if weights is None else source_of(channels, weights, file),
        settings=None if settings is None else read_settings(settings),
        terms=terms_of(terms),
        progress=wanted_progress(progress),
        **{
            name: parameter_of(value, channels, file) if name in COEFFICIENTS else value
            for name, value in given(options).items()
            if name not in NAMES
        },
    )
    if "times" in result.settings:
        click.echo(f"Times: {result.reasons[0]}", err=True)
    return result


def _say_assumed(signals: Mapping[str, Any], times: Any, options: Mapping[str, Any]) -> None:
    """Say of which channels neither the file nor an option has the unit, and what they are taken for."""
    given = {name: options.get(name) for name in ("angle_unit", "torque_unit", "time_unit")}
    axis = axis_of(signals.get("angle"), signals.get("torque"), times, **given)
    there = {"angle": "angle" in signals, "torque": "torque" in signals, "time": times is not None}
    assumed = {name: axis.system.units[name] for name, is_there in there.items() if is_there and name in axis.assumed}
    if assumed:
        click.echo(units_assumed(assumed), err=True)


def _both(times: npt.NDArray[Any] | None, of_torque: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Return the times of both channels."""
    if times is None:
        raise click.UsageError("--torque-time needs the times of the angle, too; got none; give --time")
    return times, of_torque


def _align_of(text: str | None) -> Literal["offset", "drift"] | float | None:
    """Return how clocks are aligned: a word, or a time that is given as a lag is."""
    if text is None:
        return None
    if text == "offset":
        return "offset"
    if text == "drift":
        return "drift"
    wrong = click.UsageError(f"align must be offset, drift, seconds or a time such as '2 ms'; got {text!r}; repair it")
    try:
        found = lag_of(text)
    except click.UsageError:
        raise wrong from None
    if isinstance(found, str):
        raise wrong
    return found
