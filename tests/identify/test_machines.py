"""Machines that rest between moves, and servos whose encoders ripple: what the record does not say is left out, whatever its scale."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long

Array = npt.NDArray[np.float64]

JOINT = {"inertia": 0.5, "damping": 3.0, "coulomb": 2.5}
FRICTION = 0.05
"""What friction may be wrong by; 4 to 25 % before, and up to 8 errors, where rests are shorter than half a typical move."""

INERTIA, DAMPING = 2e-4, 1e-4
SERVO = 0.5
"""What a servo's inertia may be wrong by: it was nothing, "± 0.02 %", where the encoder's ripple is all that narrow test functions see."""


def moves_with_rests(seed: int, rate: float, seconds: float = 60.0) -> tuple[Array, Array]:
    """Return angle and torque of a joint that goes from place to place, and often rests for 0.3 to 0.8 s, held by friction anywhere."""
    rng = np.random.default_rng(seed)
    parts, at, place = [], 0, 0.0
    friction = []
    while at < seconds * rate:
        length, way = int(rng.uniform(0.6, 3) * rate), rng.uniform(-1.5, 1.5)
        u = np.arange(length) / length
        velocity = way * rate / length * 30 * u**2 * (1 - u) ** 2
        acceleration = way * (rate / length) ** 2 * 60 * u * (1 - u) * (1 - 2 * u)
        parts.append((place + way * u**3 * (10 - 15 * u + 6 * u**2), velocity, acceleration))
        friction.append(JOINT["coulomb"] * np.sign(velocity))
        place += way
        rest = int(rng.uniform(0.3, 0.8) * rate) if rng.uniform() < 0.7 else 0
        parts.append((np.full(rest, place), np.zeros(rest), np.zeros(rest)))
        friction.append(np.full(rest, rng.uniform(-0.9, 0.9) * JOINT["coulomb"]))
        at += length + rest
    angle, velocity, acceleration = (np.concatenate(channel) for channel in zip(*parts, strict=True))
    torque = JOINT["inertia"] * acceleration + JOINT["damping"] * velocity + np.concatenate(friction) + 0.1
    return np.round(angle / 1e-4) * 1e-4, torque + 0.05 * rng.standard_normal(torque.size)


@pytest.mark.first(1)
@pytest.mark.parametrize(("seed", "rate"), [(0, 125.0), *long((1, 250.0), (2, 125.0), (3, 500.0))])
def test_short_rests_say_nothing_of_friction(seed: int, rate: float) -> None:
    angle, torque = moves_with_rests(seed, rate)
    call: dict[str, Any] = {"terms": [("coulomb", "constant"), ("offset", "constant")], "stiffness": 0}
    found = tvident.identify(angle, torque, sample_rate=rate, inertia="constant", damping="constant", **call)
    for name in ("damping", "coulomb"):
        value, error = found.constants[name]
        assert value == pytest.approx(JOINT[name], rel=FRICTION), name
        assert abs(value - JOINT[name]) < 4 * error, name


def servo(seed: int, rate: float, seconds: float) -> tuple[Array, Array]:
    """Return angle and torque of a servo that turns at 25 to 60 rad/s under steps of the torque; its encoder of 1000 counts ripples."""
    rng = np.random.default_rng(seed)
    n, decay = int(seconds * rate), np.exp(-DAMPING / INERTIA / rate)
    level = np.full(n, 50 * DAMPING)
    for part in (0.15, 0.4, 0.7):
        level[int(n * part) :] = DAMPING * rng.uniform(25, 60)
    velocity, angle = np.full(n + 1, 50.0), np.zeros(n + 1)
    for sample in range(n):
        end = level[sample] / DAMPING
        velocity[sample + 1] = end + (velocity[sample] - end) * decay
        fall = (velocity[sample] - end) * (1 - decay) * INERTIA / DAMPING
        angle[sample + 1] = angle[sample] + end / rate + fall
    angle, count = angle[:n], 2 * np.pi / 1000
    ripple = count * (2 * np.sin(2 * angle + 1) + np.sin(13 * angle))
    torque = level + 0.02 + 5e-3 * rng.standard_normal(n) + 2e-3 * np.sin(6 * angle)
    return np.round((angle + ripple) / count) * count, torque


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [0, *long(*range(1, 8))])
def test_a_servo_is_not_believed_to_be_without_inertia(seed: int) -> None:
    angle, torque = servo(seed, 1000.0, 16.0)
    found = tvident.identify(angle, torque, sample_rate=1000, stiffness=0, terms=["offset"])
    value, error = found.constants.get("inertia", (np.nan, np.nan))
    is_known = abs(value / INERTIA - 1) < SERVO and abs(value - INERTIA) < 4 * error
    assert is_known or not found.trusted.any()
