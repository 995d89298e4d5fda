"""A machine that nothing pulls back: that its stiffness is not told from zero is said, with what to do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tvident

WORDS = "the stiffness is not told from zero"


def moved(stiffness: float, seed: int = 1) -> tuple[Any, Any]:
    """Give angle and torque of a motion of many frequencies."""
    rng, t = np.random.default_rng(seed), np.arange(8000) / 1000
    angle, velocity, acceleration = np.zeros((3, t.size))
    for frequency in rng.uniform(0.5, 6, 14):
        omega, phase = 2 * np.pi * frequency, rng.uniform(0, 2 * np.pi)
        angle += 0.02 * np.sin(omega * t + phase)
        velocity += 0.02 * omega * np.cos(omega * t + phase)
        acceleration -= 0.02 * omega**2 * np.sin(omega * t + phase)
    torque = 0.01 * acceleration + 0.05 * velocity + stiffness * angle
    return (
        angle + 1e-3 * angle.std() * rng.standard_normal(t.size),
        torque + 1e-2 * torque.std() * rng.standard_normal(t.size),
    )


@pytest.mark.parametrize("call", [{}, {"method": "paper"}, {"stiffness": "constant"}])
def test_a_machine_without_a_spring_is_asked_about(call: dict[str, Any]) -> None:
    angle, torque = moved(0.0)
    found = tvident.identify(angle, torque, sample_rate=1000.0, **call)
    assert sum(WORDS in line for line in found.advice) == 1
    without = tvident.identify(angle, torque, sample_rate=1000.0, stiffness=0.0, method=call.get("method", "auto"))
    assert not any(WORDS in line for line in without.advice)
    if not call:
        assert without.value("inertia").stderr < 0.8 * found.value("inertia").stderr


@pytest.mark.parametrize("stiffness", [0.05, 0.5, -0.15])
def test_a_soft_spring_is_one(stiffness: float) -> None:
    found = tvident.identify(*moved(stiffness), sample_rate=1000.0)
    assert not any(WORDS in line for line in found.advice)
