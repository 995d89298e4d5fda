"""The command ``tvident info``."""

from __future__ import annotations

from typing import Any

import click
import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._clocks import grid_of
from tvident._commands import plain
from tvident._commands.channels import channels_in, stated_in
from tvident._files import aligned, increasing_times, printable, time_channels
from tvident._units import ROTARY, is_convertible, named_unit, unit_of, unit_said

_SELDOM = 0.5
"""Steps of a clock that do not go on."""


def info(file: str, as_json: bool) -> None:  # noqa: FBT001 - click passes options by name
    """List the channels of FILE: how many samples, their range, and what is missing."""
    channels = channels_in(file)
    if as_json:
        click.echo(plain.as_json({"file": file, "channels": [_numbers(*one) for one in channels.items()]}))
        return
    rows: list[tuple[str, ...]] = [
        ("channel", "type", "samples", "mean", "std", "least", "greatest", "missing", "remark")
    ]
    for name, recorded in channels.items():
        found = _numbers(name, recorded)
        measured = (found[one] for one in ("mean", "std", "least", "greatest"))
        shown = ["" if np.isnan(one) else f"{one:.5g}" for one in measured]
        counts = str(found["samples"]), *shown, str(found["missing"])
        rows.append((printable(name, 60), found["type"], *counts, found["remark"]))
    click.echo("\n".join(aligned(rows)))
    stated = "" if time_channels(channels) or increasing_times(channels) else stated_in(file)
    if stated:
        click.echo(f"no channel holds times{stated}")


def _numbers(name: str, recorded: npt.NDArray[Any]) -> dict[str, Any]:
    """Return what there is to say of a channel."""
    # Half and integer types are too narrow for sums of squares.
    values = recorded.astype(np.float64)
    finite = values[np.isfinite(values)]
    with np.errstate(over="ignore", invalid="ignore"):
        measured = (finite.mean(), finite.std(), finite.min(), finite.max()) if finite.size else (np.nan,) * 4
    return {
        "name": name,
        "unit": named_unit(name)[1] or unit_said(recorded),
        "type": str(recorded.dtype),
        "samples": values.size,
        **{one: float(number) for one, number in zip(("mean", "std", "least", "greatest"), measured, strict=True)},
        "missing": values.size - finite.size,
        "remark": _remark(name, values),
    }


def _remark(name: str, values: npt.NDArray[Any]) -> str:
    """Return what a channel looks like: uniform time, a single number, a constant, nothing at all."""
    if values.ndim == 0:
        return "a number"
    if not np.isfinite(values).any():
        return "holds no numbers"
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        steps = np.diff(values)
        if steps.size and (steps > 0).all():
            period = (values[-1] - values[0]) / steps.size
            grid = values[0] + period * np.arange(values.size)
            if np.abs(values - grid).max() <= 1e-3 * period:
                return f"uniform: {_rate(name, period)}"
            return _steps(name, values)
    if steps.size and not steps.any():
        return "constant"
    return _turns(name, steps)


def _turns(name: str, steps: npt.NDArray[np.float64]) -> str:
    """Return how often a clock goes back or stands; nothing of what is no clock: times mostly increase."""
    back, stands = (int(np.count_nonzero(one)) for one in (steps < 0, steps == 0))
    is_clock = time_channels([name]) or _is_time(name)
    if not is_clock or not (back or stands) or back + stands > _SELDOM * steps.size:
        return ""
    first = int(np.flatnonzero(steps <= 0)[0]) + 1
    often = "once" if back == 1 else f"{back} times"
    words = [f"goes back {often}"] if back else []
    words += [f"stands {'once' if stands == 1 else f'{stands} times'}"] if stands else []
    return f"{', '.join(words)}, first at sample {first}"


def _is_time(name: str) -> bool:
    return is_convertible(ROTARY, "time", named_unit(name)[1])


def _rate(name: str, period: float) -> str:
    """Return the sample rate of a channel: in Hz where its unit is one of time."""
    unit = unit_of(named_unit(name)[1])
    if unit is None or not _is_time(name):
        return f"{1 / period:.6g} per unit"
    return f"{1 / (period * unit.factor):.6g} Hz"


def _steps(name: str, times: npt.NDArray[np.float64]) -> str:
    """Return in words how increasing times are spaced."""
    try:
        grid = grid_of(times)
    except ValueError:
        return "increasing, mostly gaps"
    if grid.samples > times.size:
        try:
            period = arguments.sample_period(times.size, t=times)
        except ValueError:
            pass
        else:  # of few digits
            return f"uniform within its digits: {_rate(name, period)}"
    gaps = int(np.count_nonzero(np.diff(grid.places) > grid.bridged))
    words = f"increasing: {_rate(name, grid.period)}"
    if grid.jitter:
        words += f", steps scatter by {grid.jitter:.2g} of a step"
    elif grid.samples > times.size:
        words += f", {grid.samples - times.size} samples lost"
    return words + (f", {gaps} gaps" if gaps else "")
