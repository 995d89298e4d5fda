"""What a file says of its sample rate, beside its channels: in attributes, as a single number, or above the numbers of a text."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tvident._files import FileRecording, RatesDifferError, check_alike, no_rate_told, told_rates


@dataclass(frozen=True)
class SaidOfRate:
    """What a file says of its sample rate.

    Parameters
    ----------
    rate : float or None
        Samples per second, where it says them.
    remarks : tuple of str
        What it says of them that is not read.
    text : Path, optional
        The text above whose numbers it stands: there times come before it.
    """

    rate: float | None
    remarks: tuple[str, ...] = ()
    text: Path | None = None
    wrong: str = ""
    """What it says of them that is no sample rate."""


NOTHING_SAID = SaidOfRate(None)


def said_of_rate(attributes: Callable[[list[str]], Iterator[tuple[str, Any]]], single: Mapping[str, Any]) -> SaidOfRate:
    """Return what attributes say, or else single numbers by their names with units: what ``read_recording`` has as ``sample_rate``.

    The attributes are given as a channel by a function, which adds to a list what it does not read.
    """
    remarks: list[str] = []
    numbers = FileRecording({**dict(attributes(remarks)), **single})
    rates = told_rates(numbers)
    try:
        check_alike(rates, "the file")
    except RatesDifferError as error:
        return SaidOfRate(None, (*map(str, remarks), str(error)))
    return SaidOfRate(next(iter(rates.values()), None), tuple(map(str, remarks)), wrong=no_rate_told(numbers))
