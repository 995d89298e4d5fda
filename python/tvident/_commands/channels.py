"""Channels of a recording as the options name them."""

from __future__ import annotations

import shlex
import shutil
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt

from tvident import recordings
from tvident._files import (
    RatesDifferError,
    check_alike,
    counters,
    ending_by,
    full_name,
    increasing_times,
    listed,
    no_rate_stated,
    no_rate_told,
    printable,
    said_otherwise,
    stated_rate,
    time_channels,
    told_rates,
)
from tvident._units import Channel, named_unit

_FEW = 64
"""Numbers of trials that may all say one thing."""

_FEW_CLOCKS = 3
"""Channels of times that are named at most."""

_MOST_START = 4096

_STATED = "tvident.stated"
"""Where a command keeps what to type as lines of standard input state the sample rate, which are read once."""


def channel_of(channels: recordings.Channels, name: str, file: str | None) -> npt.NDArray[Any]:
    """Return a channel that holds one value a sample, with the unit of its header."""
    full = full_name(channels, name, file or "the command line")
    if channels[full].ndim != 1:
        raise click.UsageError(f"channel {name!r} must hold one value for every sample; it is a single number")
    return Channel(channels[full], named_unit(full)[1])


def only_channel(channels: recordings.Channels, time_channel: str | None, file: str) -> str:
    """Return the name of the only channel beside times, where none is named; refuse to choose between several."""
    times = "" if time_channel is None else full_name(channels, time_channel, file)
    recorded = [name for name, values in channels.items() if values.ndim == 1] or list(channels)
    others = [name for name in recorded if name != times and not time_channels([name])]
    if len(others) == 1:
        return others[0]
    raise click.UsageError(f"Missing option '--channel'; {printable(file)} has {listed(recorded)}; name the channel")


def times_of(channels: recordings.Channels, name: str | None, beside: str, file: str | None) -> npt.NDArray[Any] | None:
    """Return a channel of times; of several called ``time`` the one of the group that another channel is in."""
    if name is None:
        return None
    try:
        return channel_of(channels, name, file)
    except KeyError:
        try:
            group = named_unit(full_name(channels, beside, ""))[0].rpartition(".")[0]
        except KeyError:
            group = ""
        if not group:
            raise
        return channel_of(channels, f"{group}.{name}", file)


def check_has_times(who: str, given: bool, channels: recordings.Channels, file: str | None) -> None:  # noqa: FBT001 - said by its name
    """Refuse to begin without a sample period, and name the channel that may hold the times, or what the file states."""
    if given:
        return
    found = time_channels(channels) or [named_unit(name)[0] for name in increasing_times(channels)]
    shown = [f"--time {shlex.quote(printable(name))}" for name in dict.fromkeys(found)][:_FEW_CLOCKS]
    known = (
        f"; it may be {' or '.join(shown)}" if found else _rate_in(channels) or stated_in(file) or _counted_in(channels)
    )
    raise click.UsageError(f"{who} the sample period; got none; give --sample-rate, --delta or --time{known}")


def _counted_in(channels: recordings.Channels) -> str:
    """Return what to type where a channel counts ticks or samples; nothing elsewhere."""
    for name, step in counters(channels):
        bare = printable(named_unit(name)[0])
        each = f"'{bare}' goes up by {step} from sample to sample"
        return f"; {each}: if it counts milliseconds, give --time {shlex.quote(bare)} --time-unit ms"
    return ""


def _rate_in(channels: recordings.Channels) -> str:
    """Return what to type where numbers of a file tell a sample rate, also those of trials that all say the same; nothing elsewhere."""
    try:
        check_alike(told_rates(channels), "the file")
    except RatesDifferError as error:
        return f"; {str(error).replace('sample_rate=', '--sample-rate')}"
    for name, rate in told_rates(channels, most=_FEW).items():
        return f"; it may be --sample-rate {rate:.10g}, as {printable(name)} says"
    wrong = no_rate_told(channels)
    return f"; {wrong}" if wrong else ""


def stated_in(file: str | None) -> str:
    """Return what to type where a line above the numbers of a text states the sample rate; nothing elsewhere."""
    if file == "-":
        context = click.get_current_context(silent=True)
        return "" if context is None else str(context.meta.get(_STATED, ""))
    return "" if file is None else _stated(Path(file))


def _stated(path: Path) -> str:
    stated = stated_rate(path)
    if stated is not None:
        return f"; it may be --sample-rate {stated.rate:.10g}, as the file says: '{stated.words}'"
    wrong = no_rate_stated(path)
    return f"; {wrong}" if wrong else ""


def channels_in(file: str | None) -> recordings.Channels:
    """Return the channels of a file, of standard input where it is called ``-``, and none where there is none."""
    if file is None:
        return {}
    if file == "-":
        return _standard_input()
    found = recordings.read(file, missing=marks_missing())
    said = said_otherwise(Path(file), found)
    if said:
        click.echo(f"Warning: {printable(file)}: {said}", err=True)
    return found


def marks_missing() -> tuple[float, ...]:
    """Return the numbers that mark missing values, as --missing gave them."""
    context = click.get_current_context(silent=True)
    found: tuple[float, ...] = () if context is None else context.meta.get("tvident.missing", ())
    return found


def _standard_input() -> recordings.Channels:
    """Return the channels of what is piped in: its first bytes say what it is, text otherwise."""
    if sys.stdin is None:
        raise click.UsageError("the file - is standard input, which is closed; name a file")
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", recordings.FileWarning)
        content = Path(folder) / "content"
        with content.open("wb") as file:
            shutil.copyfileobj(sys.stdin.buffer, file)
        with content.open("rb") as file:
            start = file.read(_MOST_START)
        ending = ending_by(start) or ".csv"
        if ending == ".npz" and (b"xl/" in start or b"[Content_Types]" in start):
            ending = ".xlsx"
        named = content.rename(content.with_name(f"standard-input{ending}"))
        try:
            found = recordings.read(named, missing=marks_missing())
        except recordings.FileError as error:
            raise recordings.FileError(str(error).replace(str(named), "standard input")) from None
        otherwise, context = said_otherwise(named, found), click.get_current_context(silent=True)
        if context is not None:
            context.meta[_STATED] = _stated(named)
    if otherwise:
        click.echo(f"Warning: standard input: {otherwise}", err=True)
    for one in said:
        click.echo(f"Warning: {str(one.message).replace(str(named), 'standard input')}", err=True)
    return found


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
    alone = recordings.read(name, missing=marks_missing())
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


def mask_of(values: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Return where a channel is neither zero nor missing."""
    return np.asarray((values != 0) & np.isfinite(values))
