"""Times that count days, as datenum of MATLAB and cells of spreadsheets do, in a channel whose name does not say so."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from tvident._arguments import is_called_time, may_be_days
from tvident._files.channels import Channels, Say
from tvident._files.names import printable
from tvident._files.statistics_below import half_digit
from tvident._units import named_unit, unit_said, with_unit

_DATE = re.compile(
    r"(date|datum|fecha|data|serial|excel|matlab)?[ _./-]?(date|datum|datenum|date[ _./-]?time|datetime|fecha|time|zeit|day)[ _.-]?\d*",
    re.IGNORECASE,
)
"""What they are called; ``data`` alone is anything."""

_SERIAL = ((20_000.0, 80_000.0), (690_000.0, 770_000.0))
"""Days of spreadsheets and of MATLAB from the years 1954 and 1889 to 2119 and 2108."""

_FEW = 8
"""Times of which the digits are looked at: one of ten ends in a zero."""

_ROUNDED = 2e-3
"""Part of a step that may be rounded at most: of 60 samples a second an eighth of one."""


def with_days(channels: Channels, say: Say) -> Channels:
    """Return channels, of which those that count days have that unit, which is said.

    Their numbers are those of days in our time, and they increase; those that are called as times are in seconds unless their steps
    are such as no recorder has.
    """
    found = {name for name, values in channels.items() if _counts_days(name, values)}
    if not found and any(map(_is_whole_day, channels.values())):
        found = {name for name, values in channels.items() if _is_part_of_day(name, values)}
    called = {name: with_unit(name, "days") if name in found else name for name in channels}
    if not found or len(set(called.values())) < len(called):
        return channels
    for name in found:
        say(
            f"'{printable(name, 40)}' counts days, as datenum of MATLAB and spreadsheets do: its unit is taken to be days"
        )
    return {called[name]: values for name, values in channels.items()}


def _counts_days(name: str, values: npt.NDArray[np.number]) -> bool:
    bare = named_unit(name)[0].rpartition(".")[2]
    is_time = is_called_time(bare)
    if not (is_time or _DATE.fullmatch(bare)) or not _goes_on(name, values):
        return False
    return any(least <= values[0] and values[-1] < most for least, most in _SERIAL) and (
        not is_time or _has_steps_of_days(values)
    )


def _is_part_of_day(name: str, values: npt.NDArray[np.number]) -> bool:
    """Return whether a channel is the time of the day beside its date, as a part of a day."""
    is_time = is_called_time(named_unit(name)[0].rpartition(".")[2])
    return is_time and _goes_on(name, values) and values[0] >= 0 and values[-1] < 1 and _has_steps_of_days(values)


def _is_whole_day(values: npt.NDArray[np.number]) -> bool:
    if values.ndim != 1 or values.dtype.kind not in "iuf" or values.size < 2:  # noqa: PLR2004 - a step
        return False
    is_day = any(least <= values[0] < most for least, most in _SERIAL)
    return bool(is_day and values[0] % 1 == 0 and (values == values[0]).all())


def _goes_on(name: str, values: npt.NDArray[np.number]) -> bool:
    """Return whether a channel of fractions without a unit never goes back."""
    if values.ndim != 1 or values.dtype.kind != "f" or values.size < 2 or named_unit(name)[1] or unit_said(values):  # noqa: PLR2004
        return False
    return bool((np.diff(values) >= 0).all() and values[-1] > values[0])


def _has_steps_of_days(values: npt.NDArray[np.number]) -> bool:
    """Return whether the mean step may be in days, as well as it is known from times of so many digits."""
    step = float(values[-1] - values[0]) / (values.size - 1)
    digit = max(2 * half_digit(float(one)) for one in values[-_FEW:])
    return may_be_days(step, min(_ROUNDED, digit / float(values[-1] - values[0])))
