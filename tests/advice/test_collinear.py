"""Unknowns that a record cannot tell apart are named first, with what would separate them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tvident
from tvident import Status

CONSTANT: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
GRAVITY = 1.5


def hanging(scale: float, seed: int, noise: float = 1e-4) -> tuple[Any, Any]:
    """Give a rig that is a pendulum, too, which moves through part of its angles."""
    rig = tvident.simulate_torsional_rig(duration=20, seed=seed, pattern="constant")
    angle = scale * rig.true_angle
    noisy = angle + noise * scale * np.random.default_rng(seed).standard_normal(angle.size)
    return noisy, scale * rig.torque + GRAVITY * np.sin(angle)


LONG = [
    pytest.param(scale, kinds, seed, noise, marks=pytest.mark.long)
    for scale in (0.03, 1.0)
    for kinds in ({}, {"stiffness": "constant"}, CONSTANT)
    for seed in (2, 11)
    for noise in (1e-4, 3e-3)
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scale", "kinds", "seed", "noise"),
    [(0.03, CONSTANT, 11, 1e-4), (1.0, {"stiffness": "constant"}, 2, 3e-3), (1.0, {}, 11, 1e-4), *LONG],
)
def test_gravity_and_a_spring_at_small_angles(scale: float, kinds: dict[str, Any], seed: int, noise: float) -> None:
    angle, torque = hanging(scale, seed, noise)
    result = tvident.identify(angle, torque, sample_rate=1000, terms=["gravity", "offset"], **kinds)
    assert int(result.record_status) & Status.ILL_CONDITIONED
    assert not result.trusted.any()
    first = result.advice[0]
    assert "gravity" in first
    assert "stiffness" in first
    assert "cannot be distinguished" in first
    assert "record larger angles" in first


def test_a_single_sine_asks_for_more_frequencies() -> None:
    time = np.arange(5000) / 1000
    generator = np.random.default_rng(3)
    angle = np.sin(2 * np.pi * 3 * time) + 1e-4 * generator.standard_normal(time.size)
    torque = 10 * angle + 0.01 * generator.standard_normal(time.size)
    result = tvident.identify(angle, torque, sample_rate=1000, **CONSTANT)
    assert "inertia and stiffness cannot be distinguished" in result.advice[0]
    assert "excite two or more" in result.advice[0]


def test_what_is_told_apart_is_not_named() -> None:
    rig = tvident.simulate_torsional_rig(duration=20, pattern="constant")
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, terms=["coulomb", "offset"], **CONSTANT)
    assert not any("distinguished" in line for line in result.advice)
