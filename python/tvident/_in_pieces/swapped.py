"""Whether the channels of a long record are swapped, where nothing of it is to be believed: asked of stretches, as in memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from tvident._equation import COEFFICIENTS, OFFSET
from tvident._identify import Held, Span, WeakForm, asked_of_exchanged, takes_work
from tvident._pieces import Given
from tvident._results import Identification

_MOST = 2
"""Stretches that are asked."""


def stretches_asked(spans: Sequence[Span]) -> Sequence[Span]:
    """Return which of some stretches are asked."""
    return spans[:: max(1, len(spans) // _MOST)][:_MOST]


def asked_if_swapped(
    given: Given, equation: Mapping[str, Any], read: Callable[[Sequence[Span]], Held], spans: Sequence[Span]
) -> list[str]:
    """Return the question whether channels are swapped where that explains a stretch in weak form; nothing otherwise, nor with weights."""
    if given.weighted or any(isinstance(equation.get(name), int | float) for name in COEFFICIENTS):
        return []
    weak = replace(given, method=WeakForm(), equation=equation, settings=None)
    for first, end in stretches_asked(spans):
        held = read([(first, end)])
        if takes_work(held.angle, held.torque):
            continue

        def exchanged(stiffness: str, held: Held = held) -> Identification:
            kinds = {"inertia": "constant", "damping": "constant", "stiffness": stiffness}
            other = replace(weak, equation={**kinds, "terms": [OFFSET]})
            return other.identified(Held(held.torque, held.angle, held.spans), diagnose=False)

        said = asked_of_exchanged(exchanged, lambda held=held: weak.identified(held, diagnose=False))  # type: ignore[misc] # mypy does not know the type of a default
        if said is not None:
            return [said if len(spans) == 1 else f"{said} (stretch at {first * given.period:.0f} s)"]
    return []
