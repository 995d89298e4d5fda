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
        with np.errstate(all="ignore"):
            return np.asarray(np.sqrt(self._stiffness / self._inertia) / (2 * np.pi))

    @cached_property
    def damping_ratio(self) -> Array:
        with np.errstate(all="ignore"):
            return np.asarray(self._damping / (2 * np.sqrt(self._stiffness * self._inertia)))

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

    @np.errstate(all="ignore")
    def _propagate(self, gradient: dict[str, Callable[[Any], Array]]) -> Array:
        """Return the standard error of a function with the given gradient: the delta method, a block of samples at a time."""
        errors = {name: self._errors[name] for name in gradient}
        pairs = {pair: covariance for pair, covariance in self._covariances.items() if pair <= gradient.keys()}
        result = np.empty(self._inertia.shape)
        for first in range(0, self._inertia.shape[-1], _BLOCK):
            some: Any = (..., slice(first, first + _BLOCK))
            slopes = {name: slope(some) for name, slope in gradient.items()}
            variance = sum((slope * errors[name][some]) ** 2 for name, slope in slopes.items())
            for pair, covariance in pairs.items():
                one, other = pair
                factor = self._factors.get(one, 1.0) * self._factors.get(other, 1.0)
                variance = variance + 2 * slopes[one] * slopes[other] * factor * covariance[some]
            result[some] = np.sqrt(variance)
        return result
