"""What single numbers of a recording tell of its sample rate: samples per second, or seconds per sample."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._files.names import printable
from tvident._units import UnitError, factor_between, named_unit, unit_said

_RATES = re.compile(r"fs|fsamp|fsample|sampl(e|ing)(rate|frequency)|rate")
_PERIODS = re.compile(r"ts|dt|deltat|tsamp(le)?|sampl(e|ing)(time|period|interval)")
"""What they are called, without blanks and lines."""

NOTABLE = 0.01
"""Of a rate: times have few digits, and recorders round what they state."""


class RatesDifferError(ValueError):
    """Single numbers of a file tell different sample rates."""


def told_rates(channels: Mapping[str, npt.NDArray[Any]], *, most: int = 1) -> dict[str, float]:
    """Return the samples per second that numbers tell, by their names.

    Parameters
    ----------
    channels : mapping of str to ndarray
        Units are in names, or said by the channels.
    most : int, optional
        Equal numbers that tell one rate: of trials each may say the same.
    """
    told = {name: _rate_of(name, values) for name, values in _numbers(channels, most)}
    return {name: rate for name, rate in told.items() if rate is not None and 0 < rate < math.inf}


def no_rate_told(channels: Mapping[str, npt.NDArray[Any]]) -> str:
    """Return that a single number which is called as a sample rate or period is cannot be one; nothing where none is such."""
    for name, values in _numbers(channels, 1):
        rate = _rate_of(name, values)
        if rate is not None and not 0 < rate < math.inf:
            return f"{printable(name, 40)} says {float(values.reshape(-1)[0]):g}, which is no sample rate or period"
    return ""


def differ(told: Mapping[str, float]) -> bool:
    """Return whether rates are not one."""
    return bool(told) and max(told.values()) > (1 + NOTABLE) * min(told.values())


def check_alike(told: Mapping[str, float], source: str) -> None:
    """Refuse rates that differ.

    Raises
    ------
    RatesDifferError
        If they do: the message names all.
    """
    if differ(told):
        rates = " and ".join(f"{printable(name)} says {rate:.7g} Hz" for name, rate in told.items())
        raise RatesDifferError(
            f"single numbers must tell one sample rate; of {source} {rates}: give sample_rate= with the right one"
        )


def _numbers(channels: Mapping[str, npt.NDArray[Any]], most: int) -> list[tuple[str, npt.NDArray[Any]]]:
    return [
        (name, values)
        for name, values in channels.items()
        if values.dtype.kind in "iuf" and 0 < values.size <= most and np.unique(values).size == 1
    ]


def _rate_of(name: str, values: npt.NDArray[Any]) -> float | None:
    """Return the samples per second that a number says, also one that is none; None where it is called otherwise."""
    plain, unit = named_unit(name)
    bare = re.sub(r"[\s_-]", "", plain.rpartition(".")[2]).casefold()
    unit, number = unit or unit_said(values), float(values.reshape(-1)[0])
    for pattern, of_unit, is_rate in ((_RATES, "Hz", True), (_PERIODS, "s", False)):
        if pattern.fullmatch(bare):
            try:
                scaled = number * (factor_between(unit, of_unit, name=name) if unit else 1.0)
            except UnitError:  # such as degrees
                return None
            return scaled if is_rate else 1 / scaled if scaled else math.inf
    return None
