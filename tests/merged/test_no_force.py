"""A base that is known moves masses on which no force acts; inertias that are negative."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from merged.simulated import Masses, chain
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]


def stepping(t: Array) -> Array:
    return np.where(t < 3.7, 12.0, 15.0)


def falling(t: Array) -> Array:
    return np.where(t < 4.6, 18.0, 11.0)


def swinging(t: Array) -> Array:
    return np.asarray(12 + 3 * np.sin(0.9 * t))


def growing(t: Array) -> Array:
    return np.asarray(12 + 0.5 * t)


def held(t: Array) -> Array:
    return 18 + 0 * t


def identified(masses: Masses, torque: Array | None = None, **options: Any) -> Any:
    count = len(masses.angle)
    springs: list[tuple[Any, int]] = [("base" if mass == 0 else mass - 1, mass) for mass in range(count)]
    structure = tvident.Chain(count, springs, base=masses.base)
    torque = np.zeros_like(masses.torque) if torque is None else torque
    identify: Any = tvident.identify
    return identify(masses.angle, torque, structure=structure, sample_rate=1000, dof_axis=0, **options)


@pytest.mark.parametrize(
    ("changes", "masses", "noise"),
    [
        (stepping, 2, 1e-3),
        (swinging, 2, 1e-3),
        *long((falling, 2, 1e-3), (growing, 2, 1e-3), (stepping, 2, 1e-4), (swinging, 2, 1e-2), (stepping, 3, 1e-3)),
    ],
)
@pytest.mark.parametrize("seed", [41, *long(42, 43)])
def test_a_spring_that_changes_is_followed_where_a_base_moves_alone(
    changes: Callable[[Array], Array], masses: int, noise: float, seed: int
) -> None:
    # The test function was as wide as the motion is slow: stiffness 8 to 24 % off around a step, inertia negative, and trusted.
    springs = [changes, *[held] * (masses - 1)]
    simulated = chain(springs, 8000, seed=seed, driven=(), base=True, angle_noise=noise)
    found = identified(simulated, inertia={masses - 1: 0.03})
    true = simulated.stiffness[0]
    error = found.elements["stiffness_base_0"] - true
    assert np.sqrt(np.mean(error**2)) < 0.015 * np.mean(true)
    assert np.median(np.abs(error)) < 0.01 * np.mean(true)
    assert np.mean(np.abs(error) < 2.5 * found.stderr["stiffness_base_0"]) > 0.75
    np.testing.assert_allclose(np.median(found.elements["inertia_0"]), 0.02, rtol=0.02)
    assert found.elements["inertia_0"].min() > 0
    assert found.trusted.mean() > 0.9
    if changes in {stepping, falling}:
        assert len(found.jumps) == 1
        assert abs(found.jumps[0] - (3.7 if changes is stepping else 4.6)) < 0.05


@pytest.mark.parametrize("seed", [44, *long(45)])
def test_an_expansion_knows_its_errors_where_a_base_moves_alone(seed: int) -> None:
    # The noise of a torque that is zero counted as 1 N m: standard errors of 14 %, and inertia a third too small.
    simulated = chain([swinging, held], 8000, seed=seed, driven=(), base=True)
    found = identified(simulated, inertia={1: 0.03}, stiffness=[tvident.Expansion("bspline"), "constant"])
    error = found.elements["stiffness_base_0"] - simulated.stiffness[0]
    assert np.sqrt(np.mean(error**2)) < 1e-3 * 12
    assert np.median(found.stderr["stiffness_base_0"]) < 1e-3 * 12
    assert np.mean(np.abs(error) < 2.5 * found.stderr["stiffness_base_0"]) > 0.8
    value, stderr = found.constants["inertia_0"]
    assert abs(value - 0.02) < 4 * stderr < 1e-3


def test_nothing_is_trusted_beside_an_inertia_that_is_negative() -> None:
    # A torque whose sign is wrong: the verdict said so, and all samples were trusted.
    simulated = chain([held, held], 4000, seed=46)
    assert identified(simulated, simulated.torque).trusted.all()
    rigs = [tvident.simulate_torsional_rig(duration=1.0, seed=seed) for seed in range(4)]
    identify: Any = tvident.identify
    trials = identify(
        np.stack([rig.angle for rig in rigs]),
        -np.stack([rig.torque for rig in rigs]),
        sample_rate=1000,
        ensemble_axis=0,
    )
    for found in (identified(simulated, -simulated.torque), trials):
        assert "is negative" in found.summary().splitlines()[0]
        assert found.record_status & Status.ILL_CONDITIONED
        assert not found.trusted.any()
