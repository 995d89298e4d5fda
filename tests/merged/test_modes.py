"""Modes of masses over time: two that cross keep their names, and errors are as large as is said."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from merged.simulated import coupled
from merged.test_masses import OPTIONS
from parameters import long
from tvident._merged import modal

Array = npt.NDArray[np.float64]

identify: Any = tvident.identify
"""Its type is that of a single record."""

SAMPLES = 5000

INERTIA, DAMPING = np.diag([0.02, 0.03]), np.diag([0.03, 0.06])


def crossing(t: Array) -> Array:
    """Give springs of two masses that do not touch: the first becomes stiffer, until its mass is the faster one."""
    stiffness = np.zeros((2, 2, t.size))
    stiffness[0, 0], stiffness[1, 1] = 10 + 1.2 * t, 18.5
    return stiffness


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [range(2), *long(range(24))])
def test_modes_that_cross_are_not_exchanged(seeds: range) -> None:
    deviations: list[Array] = []
    shape = {"inertia": "diagonal", "damping": "diagonal", "stiffness": "symmetric"}
    for seed in seeds:
        simulated = coupled(crossing, INERTIA, DAMPING, SAMPLES, seed=seed)
        matrices = {name: tvident.Matrix(one) for name, one in shape.items()}  # type: ignore[arg-type]
        found = identify(simulated.angle[0], simulated.torque[0], **matrices, **OPTIONS)
        inertia, damping = np.diag(INERTIA)[:, np.newaxis], np.diag(DAMPING)[:, np.newaxis]
        pulsation = np.sqrt(np.diagonal(simulated.stiffness).T / inertia)
        frequency, ratio = pulsation / (2 * np.pi), damping / (2 * inertia * pulsation)
        assert frequency[0, 0] < 0.95 * frequency[1, 0]
        assert frequency[0, -1] > 1.05 * frequency[1, -1]
        # A mode is the same mass's at all times. Where both frequencies are one, so are all shapes of an undamped system.
        shapes = np.abs(found.modes.shapes)
        assert (shapes[[1, 0], [0, 1]] < 0.2).all()
        of_frequency = (found.natural_frequency - frequency) / found.modes.natural_frequency_stderr
        of_ratio = (found.damping_ratio - ratio) / found.modes.damping_ratio_stderr
        deviations.append(np.concatenate([of_frequency, of_ratio]))
    # Three of the four are one number a record, which two standard errors hold in 95 %; seeds 0 to 23: 96.0 %.
    inside = np.abs(np.stack(deviations)) < 2
    assert inside.mean() > 0.95 - 3 * np.sqrt(0.95 * 0.05 / (4 * len(seeds)))
    assert (np.abs(np.stack(deviations)) < 4.5).all()
    if len(seeds) > 2:
        assert 0.8 < np.sqrt(np.mean(np.square(deviations))) < 1.2


def test_a_mode_is_followed_across_times_at_which_none_is_known() -> None:
    t = np.linspace(0, 10, 200)
    springs = [np.full(t.size, 20.0), np.where((t > 4) & (t < 6), np.nan, 10 + 2 * t)]
    patterns = [np.diag([1.0, 0.0]), np.diag([0.0, 1.0])]
    nothing = np.zeros((2, 2))
    elements = [
        modal.ModalElement((nothing, nothing, one), spring) for one, spring in zip(patterns, springs, strict=True)
    ]
    mass = modal.ModalElement((np.eye(2) * 0.02, nothing, nothing), np.ones(t.size))
    found = modal.modes_of([mass, *elements], np.zeros((t.size, 3, 3)), np.arange(t.size), t.size)
    # The second spring is the softer one before the gap, and the stiffer one behind it.
    known = np.isfinite(springs[1])
    expected = np.sqrt(np.stack([springs[1], springs[0]])[:, known] / 0.02) / (2 * np.pi)
    np.testing.assert_allclose(found.natural_frequency[:, known], expected, rtol=1e-12)
    assert np.isnan(found.natural_frequency[:, ~known]).all()
