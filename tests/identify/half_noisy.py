"""Records half of which is noisier: what weights promise of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

import tvident
from tvident._choices import Pattern

Array = npt.NDArray[np.float64]

SEEDS = range(8)

Identified = Callable[[int, bool], tuple[tvident.Identification, dict[str, float]]]
"""Identifies a record by its seed, with its weights or without, and gives the true inertia and stiffness beside it."""


class HalfNoisy:
    """A rig whose second half has ten times the noise in every channel, and the weights that say so."""

    def __init__(self, seed: int, duration: float, pattern: Pattern) -> None:
        self.known = tvident.simulate_torsional_rig(duration, seed=seed, pattern=pattern)
        self._generator = np.random.default_rng(seed)
        samples = self.known.time.size
        self._deviation = np.where(np.arange(samples) < samples // 2, 1.0, 10.0)
        self.weights = self._deviation**-2
        self.angle, self.torque = self.noisy(self.known.true_angle, 1e-3), self.noisy(self.known.true_torque, 2e-2)

    def noisy(self, channel: Array, level: float) -> Array:
        """Return a channel with noise of a part of its standard deviation."""
        noise = self._deviation * self._generator.standard_normal(channel.size)
        return np.asarray(channel + level * np.std(channel) * noise, np.float64)


def found_alike(one: tvident.Identification, other: tvident.Identification) -> None:
    for name in ("inertia", "damping", "stiffness", "status", "residual_std"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    for name, errors in one.stderr.items():
        np.testing.assert_array_equal(errors, other.stderr[name])
    assert one.record_status == other.record_status


def assert_weights_help(identified: Identified) -> None:
    """Assert that weights make errors of constants smaller, and that these are what they say, where half has ten times the noise."""
    errors: dict[bool, list[float]] = {False: [], True: []}
    standardised = []
    for seed in SEEDS:
        for has_weights, each in errors.items():
            found, truth = identified(seed, has_weights)
            each.append(found.constants["inertia"][0] / truth["inertia"] - 1)
        assert not found.record_status
        standardised += [(found.constants[name][0] - value) / found.constants[name][1] for name, value in truth.items()]
    rms = {has_weights: float(np.sqrt(np.mean(np.square(values)))) for has_weights, values in errors.items()}
    # Least squares have the mean of both variances, 50.5, weighted ones the inverse of the mean of their inverses, 1.98.
    assert rms[True] < rms[False] / 3, rms
    # Sixteen squares of mean one: beyond these limits in 1 of 1000 cases, were they independent.
    assert 0.23 < np.mean(np.square(standardised)) < 2.4
