"""What the values of options mean."""

from __future__ import annotations

import math
import sys
from importlib.util import find_spec
from typing import Any

import click


def length(text: str) -> int | str:
    """Return a number of samples, or a duration as it is."""
    return int(text) if text.strip().lstrip("+-").isdigit() else text


def period_of(text: str | None) -> float | None:
    """Return a period from a number, or from a multiple of π such as ``2pi``."""
    if text is None:
        return None
    number, of_pi, rest = text.strip().lower().replace("π", "pi").partition("pi")
    try:
        value = float(number or (of_pi and 1))
    except ValueError:
        value = math.nan
    if rest or not (math.isfinite(value) and value > 0):
        raise click.UsageError(
            f"--period must be a number above zero, or a multiple of pi such as 2pi; got {text!r}; repair it"
        )
    return value * math.pi if of_pi else value


def given(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that were given."""
    return {name: value for name, value in options.items() if value is not None}


def wanted_progress(wanted: bool | None) -> bool:  # noqa: FBT001 - an option's value
    """Return whether to show progress: on a terminal and if there are bars, unless told otherwise."""
    return sys.stderr.isatty() and find_spec("tqdm") is not None if wanted is None else wanted


def check_time(sample_rate: float | None, delta: float | None, time_channel: str | None) -> bool:
    """Return whether the sample period was given; refuse several."""
    ways = {"--sample-rate": sample_rate, "--delta": delta, "--time": time_channel}
    given = [name for name, value in ways.items() if value is not None]
    if len(given) > 1:
        raise click.UsageError(f"give only one of {', '.join(ways)}; got {' and '.join(given)}; drop all but one")
    return bool(given)
