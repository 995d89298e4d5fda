"""Parameters, terms and lags of the equation of motion as the options give them."""

from __future__ import annotations

from typing import Any, Literal, get_args

import click

from tvident import _arguments as arguments
from tvident import recordings
from tvident._equation import Kind
from tvident._files import full_name
from tvident._units import Channel, named_unit


def parameter_of(value: str, channels: recordings.Channels, file: str | None) -> Any:
    """Return a kind, a number, or a channel."""
    if value in get_args(Kind):
        return value
    try:
        return float(value)
    except ValueError:
        pass
    try:
        full = full_name(channels, value, file or "the command line")
    except KeyError as error:
        raise click.UsageError(
            f"{error.args[0]}; or write one of {', '.join(get_args(Kind))}, or a number with a point, as 20.5"
        ) from None
    return Channel(channels[full], named_unit(full)[1])


def terms_of(texts: tuple[str, ...]) -> list[Any] | None:
    """Return terms from ``name`` or ``name:kind``; None if none are given, an empty list for ``none``."""
    if texts == ("none",):
        return []
    parts = [text.partition(":") for text in texts]
    return [(name, kind) if kind else name for name, _, kind in parts] or None


def lag_of(text: str) -> float | Literal["auto"]:
    """Return a time in seconds from a number, or from one with a unit; ``auto`` as it is."""
    if text == "auto":
        return "auto"
    try:
        return float(text)
    except ValueError:
        pass
    try:
        return arguments.delay("lag", text)
    except ValueError:
        raise click.UsageError(
            f"lag must be seconds, a time such as '2 ms', or 'auto'; got {text!r}; repair it"
        ) from None
