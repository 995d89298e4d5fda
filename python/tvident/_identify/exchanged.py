"""Whether the channels of angle and torque are swapped: each in the other's place, a machine explains next to everything."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from tvident._advice import SWAPPED
from tvident._arguments import percent
from tvident._identify.left_over import unexplained
from tvident._identify.offered import BEYOND_CHANCE, NEXT_TO_NOTHING, is_right
from tvident._results import TRIED, Identification

_MUCH_BETTER = 0.1
"""Swapped channels leave at most this part of what is unpredicted."""

_BLOCKS = 16
"""Blocks of a record whose work is compared."""


@np.errstate(all="ignore")  # of what is beyond doubles nothing is told
def takes_work(angle: npt.NDArray[Any], torque: npt.NDArray[Any], mask: npt.NDArray[np.bool_] | None = None) -> bool:
    """Return whether the torque does work on the motion beyond chance: with the channels exchanged damping would be negative.

    The integral of the angle by the torque is that of the torque by the angle with the other sign.
    """
    angle, torque = (channel.astype(np.float64) for channel in (angle, torque))
    work = torque[1:-1] * (angle[2:] - angle[:-2])
    is_there = np.isfinite(work) if mask is None else np.isfinite(work) & mask[1:-1]
    blocks = np.array([block.sum() for block in np.array_split(np.where(is_there, work, 0.0), _BLOCKS)])
    return bool(blocks.mean() > BEYOND_CHANCE * blocks.std(ddof=1) / np.sqrt(_BLOCKS))


def asked_of_exchanged(
    exchanged: Callable[[Literal["constant", "windowed"]], Identification], usual: Callable[[], Identification]
) -> str | None:
    """Return the question whether channels are swapped, where that explains next to everything with positive parameters.

    Of channels in their places exchanging gives a negative damping, however slow the motion is.

    Parameters
    ----------
    exchanged : callable
        Identifies the exchanged channels in weak form, with an offset, a stiffness of this kind and all else constant.
    usual : callable
        Identifies them as they are.
    """
    try:
        # Where constants alone predict nothing of it nothing is swapped, and to look for all that may change there takes long.
        if not unexplained(exchanged("constant")).share < 1:
            return None
        found = exchanged("windowed")
    except ValueError:
        return None
    left = unexplained(found).share
    if not (is_right(found) and left <= NEXT_TO_NOTHING):
        return None
    # Where they determine nothing as they are, nothing is explained.
    with suppress(ValueError):
        if left > _MUCH_BETTER * unexplained(usual()).share:
            return None
    return (
        f"{SWAPPED} With one in the other's place inertia, damping and stiffness are positive, "
        f"and {percent(1 - left)} {TRIED}: exchange them"
    )
