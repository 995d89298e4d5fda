"""What a call of ``identify`` holds where numbers may mark missing values: channels, instruments, weights and what is known."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._advice import Numbers, marks_that_stay, without_masked_marks
from tvident._equation import COEFFICIENTS
from tvident._units import Axis

if TYPE_CHECKING:
    from tvident._merged import Masses, Trials

Array = npt.NDArray[np.number]


def without_marks(
    channels: Mapping[str, Array],
    factors: Mapping[str, float],
    call: Mapping[str, Any],
    turn: float | None,
    period: float,
) -> tuple[dict[str, Array], Array, list[tuple[int, str]], list[str]]:
    """Return the motion and the torque without marks that a mask leaves out, questions about others of records, and what was done.

    A turn, if the angle wraps, is in units of results, a period in seconds.
    """
    turns = {"angle": abs(turn or 0.0)}
    numbers = [Numbers(name, values, factors[name], turns.get(name, 0.0)) for name, values in channels.items()]
    mask = arguments.mask("mask", call["mask"], channels["torque"].shape)
    said: list[str] = []
    if mask is not None:
        found = [without_masked_marks(one, mask) for one in numbers]
        numbers = [replace(one, values=values) for one, (values, _) in zip(numbers, found, strict=True)]
        said = [line for _, words in found for line in words]
    left = {one.name: one.values for one in numbers}
    torques = left.pop("torque")
    return left, torques, marks_that_stay([*numbers, *_beside(call, torques.shape)], period), said


def _beside(call: Mapping[str, Any], shape: tuple[int, ...]) -> Iterator[Numbers]:
    """Give what is given for every sample beside the channels, in its own units: nothing of it is left out."""
    for name in ("instrument", "weights", *COEFFICIENTS):
        given = call[name]
        if given is None or isinstance(given, str | float | int) or not hasattr(given, "__len__"):
            continue
        try:
            values = np.asarray(arguments.plain(name, given))
        except (TypeError, ValueError):
            continue  # which is refused where it is used
        if values.dtype.kind in "iuf" and values.ndim and values.shape[-1] == shape[-1]:
            whole = values if values.shape == shape else values.reshape(-1, shape[-1])[:1]
            yield Numbers(name, whole, is_measured=False)


def without_masked(
    trials: Trials | None, masses: list[Masses], axis: Axis
) -> tuple[Trials | None, list[Masses], tuple[str, ...]]:
    """Return trials, or masses, without marks that their masks leave out, and what was done in words."""
    said: list[str] = []

    def cleared(name: str, values: Any, factor: float, mask: Any) -> Any:
        if values is None or mask is None:
            return values
        found, words = without_masked_marks(Numbers(name, values, factor), mask)
        said.extend(words)
        return found

    if trials is not None:
        masks: Sequence[Any] = trials.masks or [None] * len(trials.angles)
        changed: dict[str, Any] = {
            f"{name}s": [
                cleared(f"{name} of trial {place}", one, factor, mask)
                for place, (one, mask) in enumerate(zip(each, masks, strict=True))
            ]
            for name, each, factor in (("angle", trials.angles, axis.angle), ("torque", trials.torques, axis.torque))
        }
        return replace(trials, **changed), masses, tuple(said)
    left = [
        replace(
            one,
            angles=[
                cleared(f"angle of channel {place}", each, axis.angle, one.mask)
                for place, each in enumerate(one.angles)
            ],
            torques=[
                cleared(f"torque of channel {place}", each, axis.torque, one.mask)
                for place, each in enumerate(one.torques)
            ],
        )
        for one in masses
    ]
    return None, left, tuple(said)


def asked_of_trials(
    angles: Sequence[Array], torques: Sequence[Array], axis: Axis, period: float, *, has_masses: bool
) -> tuple[str, ...]:
    """Return questions about numbers in channels of trials, or of masses, that may mark missing values."""
    of = "channel" if has_masses else "trial"
    numbers = [
        Numbers(f"{name} of {of} {place}", one, factor)
        for name, each, factor in (("angle", angles, axis.angle), ("torque", torques, axis.torque))
        for place, one in enumerate(each)
    ]
    return tuple(dict.fromkeys(words for _, words in marks_that_stay(numbers, period)))
