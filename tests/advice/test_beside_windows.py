"""What is weak beside parameters that change is seen where windows follow them."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

import tvident

RATE, SAMPLES = 1000.0, 20_000
FRICTION = 0.003


def driven(friction: float) -> tuple[Any, Any]:
    """Give angle and torque of a machine whose damping and stiffness change, by the rule of Runge and Kutta."""
    rng, t = np.random.default_rng(51), np.arange(2 * SAMPLES - 1) / (2 * RATE)
    frequencies, phases = np.exp(rng.uniform(np.log(0.3), np.log(12), 8)), rng.uniform(0, 6.28, 8)
    drive = sum(np.sin(2 * np.pi * f * t + p) for f, p in zip(frequencies, phases, strict=True)) / 2
    growth = 1 + 0.3 * np.sin(2 * np.pi / 11 * t + rng.uniform(0, 6))
    torques: list[float] = drive.tolist()
    factors: list[float] = growth.tolist()

    def acceleration(at: int, angle: float, velocity: float) -> float:
        moved = factors[at] * (0.4 * velocity + 15 * angle) + friction * math.tanh(velocity / 1e-3)
        return (torques[at] - moved) / 0.05

    angles, angle, velocity, half = [0.0], 0.0, 0.0, 0.5 / RATE
    for at in range(0, 2 * SAMPLES - 2, 2):
        v1, a1 = velocity, acceleration(at, angle, velocity)
        v2 = velocity + half * a1
        a2 = acceleration(at + 1, angle + half * v1, v2)
        v3 = velocity + half * a2
        a3 = acceleration(at + 1, angle + half * v2, v3)
        v4 = velocity + 2 * half * a3
        a4 = acceleration(at + 2, angle + 2 * half * v3, v4)
        angle += half / 3 * (v1 + 2 * v2 + 2 * v3 + v4)
        velocity += half / 3 * (a1 + 2 * a2 + 2 * a3 + a4)
        angles.append(angle)
    channels = (np.array(angles), drive[::2])
    angle_there, torque = (one + 1e-4 * one.std() * rng.standard_normal(SAMPLES) for one in channels)
    return angle_there, torque


@pytest.mark.parametrize("friction", [0.0, FRICTION])
def test_weak_friction_beside_a_damping_that_varies_is_named(friction: float) -> None:
    """Beside constants such a damping leaves so much that friction of .3 % of the torque explains next to nothing, and it was silent."""
    result = tvident.identify(*driven(friction), sample_rate=RATE)
    assert result.settings["kinds"]["damping"] == "varying"
    advised = [line for line in result.advice if "coulomb" in line]
    assert bool(advised) == bool(friction)
    if friction:
        told = re.search(r"dry friction of ([0-9.]+)", advised[0])
        assert told is not None
        assert float(told[1]) == pytest.approx(FRICTION, rel=0.1)
