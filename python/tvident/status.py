"""What happened in one window."""

from __future__ import annotations

import enum
from typing import Any

import numpy as np
import numpy.typing as npt


class Status(enum.IntFlag):
    """Flags of one window; 0 is good.

    Data never raises: a window that something is wrong with gets a status, and the rest of the record goes on. Arrays hold the flags
    as ``uint16``, so ``fit.status & Status.EDGE`` works on whole arrays.

    Examples
    --------
    >>> from tvident import Status
    >>> Status(9)
    <Status.INVALID|LOWEST_ORDER: 9>
    >>> print(Status.LOWEST_ORDER.advice)
    the lowest order was chosen: the signal hardly changes within the window, a longer one would be less noisy
    """

    INVALID = 1
    """There is no number: it is NaN. The only flag that goes with NaN. Look for missing values, or for what the other flags say."""

    EDGE = 2
    """Near an end of the record: evaluated off the centre of its window, or with fewer equations. Errors are larger there."""

    LOWEST_ORDER = 8
    """The lowest candidate order was chosen. The signal hardly changes within the window: a longer window would be less noisy."""

    HIGHEST_ORDER = 16
    """The highest candidate order was chosen. The signal may change more than a polynomial can follow: shorten the window."""

    EXACT = 32
    """The residual is at the floor set by rounding or quantisation, so there was no noise to weigh orders against."""

    RANK_DEFICIENT = 64
    """The equations do not determine the parameters (goes with INVALID). Excite the system, or leave a parameter out."""

    ILL_CONDITIONED = 128
    """The equations hardly tell the parameters apart. Look at the condition number, and at the standard errors before any value."""

    @property
    def advice(self) -> str:
        """What the flags mean and what to do, in words."""
        return "; ".join(_ADVICE[flag] for flag in Status if flag in self) or "all is well"


_ADVICE = {
    Status.INVALID: "no number: values are missing in the window, too few equations near an end, or see the other flags",
    Status.EDGE: "near an end of the record: errors are larger there",
    Status.LOWEST_ORDER: (
        "the lowest order was chosen: the signal hardly changes within the window, a longer one would be less noisy"
    ),
    Status.HIGHEST_ORDER: (
        "the highest order was chosen: the signal may change more than a polynomial can follow, shorten the window"
    ),
    Status.EXACT: "the residual is rounding or quantisation: there was no noise to weigh orders against",
    Status.RANK_DEFICIENT: "the equations do not determine the parameters: excite the system, or leave a parameter out",
    Status.ILL_CONDITIONED: "the equations hardly tell the parameters apart: look at the standard errors first",
}


def describe(status: npt.NDArray[Any]) -> list[str]:
    """Return a line for every flag that occurs: how often, and what it means."""
    if not status.size:
        return ["no samples"]
    good = float(np.mean(status == 0))
    lines = [f"{good:6.1%}  good"]
    for flag in Status:
        share = float(np.mean(status & flag != 0))
        if share > 0:
            lines.append(f"{share:6.1%}  {flag.name}: {flag.advice}")
    return lines
