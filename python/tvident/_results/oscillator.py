"""Natural frequency and damping ratio, with standard errors by the delta method."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._equation import COEFFICIENTS
from tvident._results.estimates import Estimates

Array = npt.NDArray[np.float64]

_BLOCK = 1 << 14
"""Samples whose intermediate values stay in the cache."""


class Oscillator:
    """What follows from inertia, damping and stiffness, computed when asked for.

    It stands apart from the result, so that nothing in a result leads back to it: a circle would keep hundreds of megabytes until the
    garbage collector comes by.
    """

    def __init__(
        self,
        found: Estimates,
        errors: Mapping[str, Array],
    ) -> None:
        self._inertia, self._damping, self._stiffness = (found.values[name] for name in COEFFICIENTS)
        self._errors = errors
        self._covariances = found.covariances
        self._factors = found.factors

    @cached_property
    def natural_frequency(self) -> Array:
        inertia, stiffness = self._inertia, self._stiffness
        return self._in_blocks(lambda some: np.sqrt(stiffness[some] / inertia[some]) / (2 * np.pi))

    @cached_property
    def damping_ratio(self) -> Array:
        inertia, damping, stiffness = self._inertia, self._damping, self._stiffness
        return self._in_blocks(lambda some: damping[some] / (2 * np.sqrt(stiffness[some] * inertia[some])))

    def natural_frequency_error(self) -> Array:
        f, inertia, stiffness = self.natural_frequency, self._inertia, self._stiffness
        return self._propagate(
            {
                "inertia": lambda some: -f[some] / (2 * inertia[some]),
                "stiffness": lambda some: f[some] / (2 * stiffness[some]),
            }
        )

    def damping_ratio_error(self) -> Array:
        ratio, inertia, stiffness = self.damping_ratio, self._inertia, self._stiffness
        return self._propagate(
            {
                "inertia": lambda some: -ratio[some] / (2 * inertia[some]),
                "damping": lambda some: 1 / (2 * np.sqrt(stiffness[some] * inertia[some])),
                "stiffness": lambda some: -ratio[some] / (2 * stiffness[some]),
            }
        )

    def _propagate(self, gradient: dict[str, Callable[[Any], Array]]) -> Array:
        """Return the standard error of a function with the given gradient: the delta method."""
        errors = {name: self._errors[name] for name in gradient}
        pairs = {pair: covariance for pair, covariance in self._covariances.items() if pair <= gradient.keys()}

        def error(some: Any) -> Array:
            slopes = {name: slope(some) for name, slope in gradient.items()}
            variance = sum((slope * errors[name][some]) ** 2 for name, slope in slopes.items())
            for pair, covariance in pairs.items():
                one, other = pair
                factor = self._factors.get(one, 1.0) * self._factors.get(other, 1.0)
                variance = variance + 2 * slopes[one] * slopes[other] * factor * covariance[some]
            return np.asarray(np.sqrt(variance))

        return self._in_blocks(error)

    @np.errstate(all="ignore")
    def _in_blocks(self, function: Callable[[Any], Array]) -> Array:
        """Return what a function gives of all samples, computed a block at a time."""
        result = np.empty(self._inertia.shape)
        for first in range(0, self._inertia.shape[-1], _BLOCK):
            some: Any = (..., slice(first, first + _BLOCK))
            result[some] = function(some)
        return result
