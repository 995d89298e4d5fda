"""Channels of a recording as the options name them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt

from tvident import recordings
from tvident._files import full_name, listed, printable
from tvident._units import Channel, named_unit


def channel_of(channels: recordings.Channels, name: str, file: str | None) -> npt.NDArray[Any]:
    """Return a channel that holds one value a sample, with the unit of its header."""
    full = full_name(channels, name, file or "the command line")
    if channels[full].ndim != 1:
        raise click.UsageError(f"channel {name!r} must hold one value for every sample; it is a single number")
    return Channel(channels[full], named_unit(full)[1])


def source_of(channels: recordings.Channels, name: str, file: str | None) -> npt.NDArray[Any]:
    """Return a channel by name, or the only channel of a file of that name."""
    if file is not None:
        try:
            return channel_of(channels, name, file)
        except KeyError:
            if not _is_file(name):
                raise
    elif Path(name).suffix == "":
        raise click.UsageError(f"channel {name!r} needs a FILE to be in; name the file first")
    alone = recordings.read(name)
    if len(alone) != 1:
        raise click.UsageError(
            f"{printable(name)} must hold one channel; it has {listed(alone)}; give it as FILE and name the channel"
        )
    return channel_of(alone, next(iter(alone)), name)


def _is_file(name: str) -> bool:
    try:
        return Path(name).is_file()
    except OSError:  # the name of a channel may be too long for a file
        return False


def scaled(
    values: npt.NDArray[Any], scale: str | None, channels: recordings.Channels, file: str | None
) -> npt.NDArray[Any]:
    """Multiply by a number, or by a variable of the file."""
    if scale is None:
        return values
    try:
        factor: Any = float(scale)
    except ValueError:
        factor = recordings.channel(channels, scale, file or "the command line")
    else:
        if not np.isfinite(factor):
            raise click.UsageError(f"a scale must be finite; got {scale}; give a number such as 0.001")
    if np.ndim(factor) and factor.shape != values.shape:
        raise click.UsageError(
            f"a scale must be one number, or have one value for every sample; {scale!r} has {factor.size} values "
            f"for {values.size} samples; use another variable"
        )
    return np.asarray(np.asarray(values) * factor)


def mask_of(values: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Return where a channel is neither zero nor missing."""
    return np.asarray((values != 0) & np.isfinite(values))
