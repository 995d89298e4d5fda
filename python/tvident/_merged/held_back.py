"""How much of the torques in parts that were held back the equations explain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._merged.merging import Merging, Part
from tvident._merged.predicted import Equations, predicted
from tvident._results import POOR, every_sample, parts_of, percent, where_held_back, without_gaps
from tvident._status import Status

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class HeldBackTorque:
    """What equations explain of samples that they were not fitted to.

    Parameters
    ----------
    predicted : ndarray, shape (equations,)
        Percent of the variance of every torque, as averages over the test function; NaN where it was not measured or nothing can be known.
    parts : int
        Parts of every trial whose last tenth was held back.
    why_not : str
        Why there are no numbers; empty if there are.
    """

    predicted: Array = field(default_factory=lambda: np.zeros(0))
    parts: int = 1
    why_not: str = ""

    def words(self) -> str:
        """Return it as a line."""
        known = self.predicted[np.isfinite(self.predicted)]
        if self.why_not or not known.size:
            return f"how much of a held-back part the equations explain is not known: {self.why_not or 'no torque is left there'}"
        shares = " to ".join(dict.fromkeys(percent(float(share)) for share in (known.min(), known.max())))
        which = "torque" if self.predicted.size == 1 else "torques"
        return (
            f"explains {shares} of the {which}, averaged over the test function, in {where_held_back(self.parts)}, held back "
            "from the fit"
        )


def held_back(merging: Merging) -> HeldBackTorque:
    """Return what the equations explain where they are fitted once more without the last tenth of every part."""
    if not merging.parts:
        return HeldBackTorque(why_not="the record was not kept with the result, or nothing of it can be known")
    count = max(merging.masses, 1)
    left, spread, samples, parts = np.zeros(count), np.zeros(count), np.zeros(count), 1
    for part in merging.parts:
        held = [_held(trial[0].shape[-1], part.found.window_length) for trial in part.equations.trials]
        parts = max(len(ends) for ends in held)
        values = _values_without(part, held, merging)
        for trial, ends in enumerate(held):
            form = (part.found.window_length, part.found.exponent)
            recorded, expected = predicted(part.equations, trial, values, form, merging.sampling.period)
            for place, equation in enumerate(part.equations.numbers):
                here = np.concatenate([np.arange(first, end) for first, end in ends])
                both = np.stack([recorded[place, here], expected[place, here]])
                both = both[:, np.isfinite(both).all(axis=0)]
                left[equation] += np.sum((both[0] - both[1]) ** 2)
                spread[equation] += np.sum((both[0] - both[0].mean()) ** 2) if both.size else 0.0
                samples[equation] += both.shape[1]
    with np.errstate(all="ignore"):
        shares = 100 * (1 - left / spread)
    return HeldBackTorque(np.where(samples > 0, shares, np.nan), parts)


def _held(samples: int, window_length: int) -> list[tuple[int, int]]:
    """Return first samples and ends of what is held back."""
    return [(first, end) for _, first, end in parts_of(samples, window_length)]


def _values_without(part: Part, held: Sequence[Sequence[tuple[int, int]]], merging: Merging) -> dict[str, Array]:
    """Return the elements, found without what is held back, at every sample of the result."""
    kinds: dict[str, Any] = {part.names[one.element]: one.kind for one in part.found.elements}
    elements = [one if one.is_known else replace(one, value=kinds[one.name]) for one in part.equations.elements]
    trials = []
    for (angles, *rest), ends in zip(part.equations.trials, held, strict=True):
        there = np.array(angles, np.float64)
        for first, end in ends:
            there[:, first:end] = np.nan
        trials.append((there, *rest))
    found = part.again(Equations(elements, part.equations.numbers, trials))
    values = {
        one.name: np.full(merging.samples, float(one.value)) for one in elements if not isinstance(one.value, str)
    }
    size = found.found.status.size
    beside = found.found.status & int(Status.GAP | Status.EDGE) != 0
    for one in found.found.elements:
        along = np.array(np.broadcast_to(one.values, size), np.float64)
        # Beside what is held back windows hold few equations: values between its sides are better than these.
        error = np.broadcast_to(one.stderr, size)
        usual = np.median(error[np.isfinite(error)]) if np.isfinite(error).any() else np.inf
        along[beside & (error > POOR * usual)] = np.nan
        values[found.names[one.element]] = every_sample(without_gaps(along), merging.samples, merging.step)
    return values
