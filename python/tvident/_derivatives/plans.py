"""Tables for windows of one length, made once, and the step to which samples were rounded."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core

HIGHEST_ORDER = 15
"""No polynomial order above this is offered."""

SHORTEST_WINDOW = 5
"""Samples; fewer leave no choice of order."""

_LONGEST_SLIDING = 20_001
"""Samples of a window that slides, where the chosen one is all of a record."""


# All that tables depend on: the key of the cache.
@lru_cache(maxsize=8)
def _plan(
    window_length: int,
    order: int | None,
    max_order: int,
    criterion: str,
    selection: str,
    derivatives: tuple[int, ...],
    delta: float,
    noise: bool,  # noqa: FBT001 - the key of the cache
    quantisation: float,
    instructions: str,  # noqa: ARG001 - likewise: a plan is made for the instructions in force
) -> _core.LocalPolynomials:
    return _core.LocalPolynomials(
        window_length, order, max_order, criterion, selection, list(derivatives), delta, noise, quantisation
    )


# All that tables depend on.
def plan(
    window_length: int,
    *,
    order: int | None,
    max_order: int = HIGHEST_ORDER,
    criterion: str = "aicc",
    selection: str = "window",
    derivatives: tuple[int, ...],
    delta: float,
    noise: bool,
    quantisation: float = 0.0,
) -> _core.LocalPolynomials:
    """Return the tables for windows of one length, made once and kept for the next call."""
    return _plan(
        window_length,
        order,
        max_order,
        criterion,
        selection,
        derivatives,
        delta,
        noise,
        quantisation,
        _core.instructions(),
    )


def sliding_window(length: int, samples: int) -> int:
    """Return the length of windows that slide along a record: half of it where the chosen one is all of it.

    At the ends of a window lower orders may be taken, to which a derivative is zero with no error; at most half of a record is such an end.
    """
    return length if length <= samples // 2 else min(_LONGEST_SLIDING, (samples // 2 - 1) // 2 * 2 + 1)


def quantisation_step(samples: npt.NDArray[Any], given: float | None) -> float:
    """Return the step to which samples were rounded: what was given, or what is found in them; 0 for none."""
    if given is None:
        return _core.quantisation_step(samples)
    if arguments.real_number("quantisation", given) == 0:
        return 0.0
    return arguments.positive_number("quantisation", given, most=arguments.LARGEST)
