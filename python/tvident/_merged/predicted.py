"""The torques that identified equations predict, beside those that were recorded, as averages over the test function."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion import Expansion
from tvident._merged.elements import Element
from tvident._results import correlated_with, kernels_of, touched_by

Array: TypeAlias = npt.NDArray[np.float64]

TrialArrays: TypeAlias = tuple[Any, Any, Any, Any, Any, Any]
"""Angles, torques and terms, one a row, a mask, positions in the result, and weights, as the core takes them."""


@dataclass(frozen=True)
class Equations:
    """Equations that share unknowns, and what was recorded of them.

    Parameters
    ----------
    elements : sequence of Element
    numbers : sequence of int
        Which of the masses they are of.
    trials : sequence of TrialArrays
    """

    elements: Sequence[Element]
    numbers: Sequence[int]
    trials: Sequence[TrialArrays]

    @property
    def expansions(self) -> dict[str, Expansion]:
        """Elements that are sums of functions, by name."""
        return {one.name: one.expansion for one in self.elements if one.expansion is not None}

    @property
    def in_windows(self) -> Equations:
        """The equations with windows in the place of functions."""
        return replace(self, elements=[one.in_windows for one in self.elements])

    def of_sizes(self, sizes: Mapping[str, Any]) -> Equations:
        """Return the equations with as many functions as these."""
        elements = [
            replace(one, value=replace(one.expansion, size=sizes[one.name])) if one.expansion is not None else one
            for one in self.elements
        ]
        return replace(self, elements=elements)


def predicted(
    equations: Equations, trial: int, values: Mapping[str, Array], form: tuple[int, int], period: float
) -> tuple[Array, Array]:
    """Return recorded and predicted torques of one trial, shape (equations, n); NaN where the test function touches what is missing.

    Parameters
    ----------
    equations : Equations
    trial : int
    values : mapping of str to ndarray, shape (samples,)
        Of every element, along the result.
    form : (int, int)
        Window length and exponent of the test function.
    period : float
        Seconds from one sample to the next.
    """
    angles, torques, terms, _, position, _ = equations.trials[trial]
    half, kernels = form[0] // 2, kernels_of(form[0] // 2, form[1], period)
    channels = [np.asarray(one, np.float64) for one in angles]
    given = [] if terms is None else [np.asarray(one, np.float64) for one in terms]
    measured = [np.asarray(one, np.float64) for one in torques]
    there = np.isfinite(np.stack([*channels, *given, *measured])).all(axis=0)
    touched = touched_by(np.asarray(~there), half)
    motion = [correlated_with(np.nan_to_num(one), kernels) for one in channels]
    averages = [correlated_with(np.nan_to_num(one), kernels[2:])[0] for one in given]
    places = np.arange(channels[0].size) if position is None else position
    found = np.zeros((len(torques), channels[0].size))
    for element in equations.elements:
        along = np.interp(places, np.arange(values[element.name].size), values[element.name])
        for equation, of, channel, factor in element.entries:
            found[equation] += factor * along * (averages[channel] if of is None else motion[channel][of])
    recorded = np.stack([correlated_with(np.nan_to_num(one), kernels[2:])[0] for one in measured])
    return np.where(touched, np.nan, recorded), np.where(touched, np.nan, found)
