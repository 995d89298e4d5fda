"""Where a torque sensor has its zero, and the unit it counts in, change no decision."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long

Array = npt.NDArray[np.float64]

RATE = 200.0

SAME = 1e-6
"""How far values may be apart, relative: rounding of torques that are six times as large, amplified by differences of sums."""


def recording(seed: int) -> tuple[Array, Array]:
    """Return angle and torque of a rig whose drive is held from sample to sample: its equations leave more than its noise."""
    generator = np.random.default_rng(seed)
    t = np.arange(1500) / RATE
    stiffness = 15 * (1 + 0.3 * np.sin(2 * np.pi * t / t[-1])) if seed % 2 else np.where(t > t[-1] / 2, 20.0, 12.0)
    tones = [np.sin(2 * np.pi * f * t + generator.uniform(0, 6)) for f in (0.7, 1.9, 3.3, 5.1)]
    torque = np.sum(tones, axis=0)
    angle, place, velocity = np.empty(t.size), 0.0, 0.0
    for sample in range(t.size):
        for _ in range(10):
            velocity += 0.1 / RATE * (torque[sample] - 0.06 * velocity - stiffness[sample] * place) / 0.0123
            place += 0.1 / RATE * velocity
        angle[sample] = place
    angle += 1e-3 * angle.std() * generator.standard_normal(t.size)
    return angle, torque + 0.02 * torque.std() * generator.standard_normal(t.size)


def identify(angle: Array, torque: Array, **given: Any) -> tvident.Identification:
    found: tvident.Identification = tvident.identify(angle, torque, sample_rate=RATE, **given)
    return found


def decisions(result: tvident.Identification) -> list[Any]:
    chosen = [result.settings[name] for name in ("window_length", "regression_window", "exponent", "kinds")]
    return [*chosen, len(result.jumps)]


OPTIONS: list[dict[str, Any]] = [
    {},
    {"inertia": "auto", "damping": "auto"},
    {"loss": "huber"},
    {"terms": ["offset", "coulomb"]},
]


@pytest.mark.parametrize("given", OPTIONS)
@pytest.mark.parametrize("seed", [0, 1, *long(*range(2, 12))])
def test_an_offset_of_the_torque_changes_nothing(seed: int, given: dict[str, Any]) -> None:
    angle, torque = recording(seed)
    plain, moved = identify(angle, torque, **given), identify(angle, torque + 8, **given)
    assert decisions(moved) == decisions(plain)
    np.testing.assert_allclose(moved.stiffness, plain.stiffness, rtol=SAME)
    np.testing.assert_allclose(moved.stderr["stiffness"], plain.stderr["stiffness"], rtol=SAME)
    if plain.settings["kinds"]["offset"] == "constant":
        assert abs(moved.constants["offset"][0] - plain.constants["offset"][0] - 8) < 1e-6


@pytest.mark.parametrize("given", OPTIONS)
@pytest.mark.parametrize("seed", [0, 1, *long(*range(2, 12))])
def test_the_unit_of_the_torque_changes_nothing(seed: int, given: dict[str, Any]) -> None:
    angle, torque = recording(seed)
    plain = identify(angle, torque, **given)
    for scale in (2.0**20, 2.0**-20):
        other = identify(angle, torque * scale, **given)
        assert decisions(other) == decisions(plain)
        np.testing.assert_array_equal(other.stiffness / scale, plain.stiffness)
        np.testing.assert_array_equal(other.stderr["stiffness"] / scale, plain.stderr["stiffness"])
