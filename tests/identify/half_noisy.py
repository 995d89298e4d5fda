"""Records half of which is noisier: what weights promise of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

import tvident

Array = npt.NDArray[np.float64]

SEEDS = range(8)

Identified = Callable[[int, bool], tuple[tvident.Identification, dict[str, float]]]
"""Identifies a record by its seed, with its weights or without, and gives the true inertia and stiffness beside it."""


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
