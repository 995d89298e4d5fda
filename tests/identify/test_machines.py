"""Machines that rest between moves: friction is unknown there."""

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
