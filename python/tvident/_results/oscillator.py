"""Natural frequency and damping ratio, with standard errors by the delta method."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np
import numpy.typing as npt

from tvident._equation import COEFFICIENTS
from tvident._results.estimates import Estimates

Array = npt.NDArray[np.float64]


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
        with np.errstate(all="ignore"):
            f = self.natural_frequency
            return self._propagate({"inertia": -f / (2 * self._inertia), "stiffness": f / (2 * self._stiffness)})

    def damping_ratio_error(self) -> Array:
        with np.errstate(all="ignore"):
            ratio = self.damping_ratio
            gradient = {
                "inertia": -ratio / (2 * self._inertia),
                "damping": 1 / (2 * np.sqrt(self._stiffness * self._inertia)),
                "stiffness": -ratio / (2 * self._stiffness),
            }
            return self._propagate(gradient)

    def _propagate(self, gradient: dict[str, Array]) -> Array:
        """Return the standard error of a function with the given gradient: the delta method."""
        variance = sum((slope * self._errors[name]) ** 2 for name, slope in gradient.items())
        for pair, covariance in self._covariances.items():
            if pair <= gradient.keys():
                one, other = pair
                factor = self._factors.get(one, 1.0) * self._factors.get(other, 1.0)
                variance = variance + 2 * gradient[one] * gradient[other] * factor * covariance
        return np.asarray(np.sqrt(variance))
