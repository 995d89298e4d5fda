"""How much of the torques in parts that were held back the equations explain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._arguments import explained_in_words
from tvident._merged.merging import Merging, Part
from tvident._merged.models import model_of
from tvident._merged.not_linear import NotLinear
from tvident._merged.predicted import Equations, predicted
from tvident._merged.simulated import bridged, rows_of
from tvident._results import POOR, every_sample, parts_of, where_held_back, without_gaps
from tvident._status import Status

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class HeldBackTorque:
    """What equations explain of samples that they were not fitted to.

    Parameters
    ----------
    predicted : ndarray, shape (equations,)
        Percent of the variance of every torque, as averages over the test function; NaN where none was measured or acts, or
        nothing can be known.
    simulated : ndarray, shape (masses,)
        Percent of the variance of every angle, simulated from the state before each held-back part, of equations that are linear or of one
        mass; empty for others, and where something cannot be known.
    parts : int
        Parts of every trial whose last tenth was held back.
    why_not : str
        Why there are no numbers; empty if there are.
    """

    predicted: Array = field(default_factory=lambda: np.zeros(0))
    simulated: Array = field(default_factory=lambda: np.zeros(0))
    parts: int = 1
    why_not: str = ""

    def words(self) -> str:
        """Return it as a line."""
        known = self.predicted[np.isfinite(self.predicted)]
        if self.why_not or not known.size:
            return f"how much of a held-back part the equations explain is not known: {self.why_not or 'no torque is left there'}"
        several = "" if self.predicted.size == 1 else "s"
        words = f"explains {_range(known)} of the torque{several}, averaged over the test function, "
        if self.simulated.size:
            words += f"and {_range(self.simulated)} of the angle{several} simulated, "
        return f"{words}in {where_held_back(self.parts)}, held back from the fit"


def _range(shares: Array) -> str:
    """Return the least and the greatest of some shares."""
    return " to ".join(dict.fromkeys(explained_in_words(float(share) / 100) for share in (shares.min(), shares.max())))


def held_back(merging: Merging) -> HeldBackTorque:
    """Return what the equations explain where they are fitted once more without the last tenth of every part."""
    if not merging.parts:
        return HeldBackTorque(why_not="the record was not kept with the result, or nothing of it can be known")
    count = max(merging.masses, 1)
    left, spread, samples, parts = np.zeros(count), np.zeros(count), np.zeros(count), 1
    everything: dict[str, Array] = {}
    for part in merging.parts:
        held = [_held(trial[0].shape[-1], part.found.window_length) for trial in part.equations.trials]
        parts = max(len(ends) for ends in held)
        values = _values_without(part, held, merging)
        everything |= values
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
    length = max(part.found.window_length for part in merging.parts)
    # Where no torque acts there is nothing to explain.
    return HeldBackTorque(
        np.where((samples > 0) & (spread > 0), shares, np.nan), _simulated(merging, everything, length), parts
    )


@np.errstate(all="ignore")
def _simulated(merging: Merging, values: Mapping[str, Array], window_length: int) -> Array:
    """Return how much of the angles a simulation explains; an empty array if it would take long, or cannot be done."""
    recorded, nothing = merging.recorded, np.zeros(0)
    whole = {one.name for one in merging.elements} == set(values) and all(
        np.isfinite(one).all() for one in values.values()
    )
    if recorded is None or recorded.own or not recorded.is_unchanged or not whole:
        return nothing
    left, spread = np.zeros((2, max(merging.masses, 1)))
    for trial in range(merging.trials):
        angles, base = rows_of(recorded.angles[trial]), recorded.bases[trial]
        places = np.arange(angles.shape[1]) if recorded.positions is None else recorded.positions[trial]
        along = {name: np.interp(places, np.arange(merging.samples), one) for name, one in values.items()}
        for begin, first, end in parts_of(angles.shape[1], window_length):
            some = slice(begin, end)
            try:
                moving = None if base is None else bridged(rows_of([base[some]]))[0]
                model = model_of(merging, {name: one[some] for name, one in along.items()}, moving)
                if isinstance(model, NotLinear):
                    return nothing
                recorded_angle = angles[:, some].copy()
                recorded_angle[:, first - begin :] = np.nan
                found, _ = model.respond(bridged(rows_of(recorded.torques[trial])[:, some]), None, recorded_angle)
            except ValueError:
                return nothing
            true, found = angles[:, first:end], found[:, first - begin :]
            there = np.isfinite(true) & np.isfinite(found)
            left += np.sum(np.where(there, (true - found) ** 2, 0.0), axis=1)
            counts = np.maximum(there.sum(axis=1, keepdims=True), 1)
            mean = np.sum(np.where(there, true, 0.0), axis=1, keepdims=True) / counts
            spread += np.sum(np.where(there, (true - mean) ** 2, 0.0), axis=1)
    shares = 100 * (1 - left / spread)
    return shares if np.isfinite(shares).all() else nothing


def _held(samples: int, window_length: int) -> list[tuple[int, int]]:
    """Return first samples and ends of what is held back."""
    return [(first, end) for _, first, end in parts_of(samples, window_length)]


def _values_without(part: Part, held: Sequence[Sequence[tuple[int, int]]], merging: Merging) -> dict[str, Array]:
    """Return the elements, found without what is held back, at every sample of the result."""
    kinds: dict[str, Any] = {part.names[one.element]: one.kind for one in part.found.elements}
    elements = [
        one if one.is_known or one.expansion is not None else replace(one, value=kinds[one.name])
        for one in part.equations.elements
    ]
    trials = []
    for (angles, *rest), ends in zip(part.equations.trials, held, strict=True):
        there = np.array(angles, np.float64)
        for first, end in ends:
            there[:, first:end] = np.nan
        trials.append((there, *rest))
    found = part.again(Equations(elements, part.equations.numbers, trials))
    values = {one.name: np.full(merging.samples, one.number) for one in elements if one.is_known}
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
