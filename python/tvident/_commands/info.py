"""The command ``tvident info``."""

from __future__ import annotations

from typing import Any

import click
import numpy as np
import numpy.typing as npt

from tvident._clocks import grid_of
from tvident._commands.channels import channels_in
from tvident._files import aligned, printable
from tvident._units import ROTARY, named_unit, unit_of


def info(file: str) -> None:
    """List the channels of FILE: how many samples, their range, and what is missing."""
    channels = channels_in(file)
    rows: list[tuple[str, ...]] = [
        ("channel", "type", "samples", "mean", "std", "least", "greatest", "missing", "remark")
    ]
    for name, recorded in channels.items():
        # Half and integer types are too narrow for sums of squares.
        values = recorded.astype(np.float64)
        finite = values[np.isfinite(values)]
        with np.errstate(over="ignore", invalid="ignore"):
            numbers = (finite.mean(), finite.std(), finite.min(), finite.max()) if finite.size else ()
        shown = [f"{float(number):.5g}" for number in numbers] or [""] * 4
        rows.append(
            (
                printable(name, 60),
                str(recorded.dtype),
                str(values.size),
                *shown,
                str(values.size - finite.size),
                _remark(name, values),
            )
        )
    click.echo("\n".join(aligned(rows)))


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
                return f"uniform: {1 / period:.6g} per unit{_in_hertz(name, period)}"
            return _steps(name, values)
    return "constant" if steps.size and not steps.any() else ""


def _in_hertz(name: str, period: float) -> str:
    """Return the sample rate of a channel whose unit is one of time."""
    unit = unit_of(named_unit(name)[1])
    if unit is None or unit.dimension != ROTARY.dimensions["time"]:
        return ""
    return f", {1 / (period * unit.factor):.6g} Hz"


def _steps(name: str, times: npt.NDArray[np.float64]) -> str:
    """Return in words how increasing times are spaced."""
    try:
        grid = grid_of(times)
    except ValueError:
        return "increasing, mostly gaps"
    gaps = int(np.count_nonzero(np.diff(grid.places) > grid.bridged))
    words = f"increasing: {1 / grid.period:.6g} per unit{_in_hertz(name, grid.period)}"
    if grid.jitter:
        words += f", steps scatter by {grid.jitter:.2g} of a step"
    elif grid.samples > times.size:
        words += f", {grid.samples - times.size} samples lost"
    return words + (f", {gaps} gaps" if gaps else "")
