"""A stiffness that jumps where samples are missing: nobody knows when, and standard errors hold that."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long

Array = npt.NDArray[np.float64]

INERTIA, DAMPING, STIFFNESS = 0.02, 0.2, 60.0
RATE, SAMPLES, JUMP = 800, 9_000, 5_000


def rig(seed: int, noise: float, factor: float) -> tuple[Array, Array, Array]:
    """Return the angle of a sum of sines of up to 17 Hz, the torque that it needs, and the stiffness, which jumps."""
    generator = np.random.default_rng(seed)
    time = np.arange(SAMPLES) / RATE
    angle, torque = np.zeros((2, SAMPLES))
    for frequency, phase in zip(generator.uniform(1, 17, 40), generator.uniform(0, 2 * np.pi, 40), strict=True):
        rate = 2j * np.pi * frequency
        others = INERTIA * rate**2 + DAMPING * rate
        wave = np.exp(rate * time + 1j * phase) / abs(others + STIFFNESS)
        angle, torque = angle + wave.real, torque + (others * wave).real
    stiffness = STIFFNESS * np.where(np.arange(SAMPLES) < JUMP, 1.0, factor)
    angle_noise, torque_noise = noise * generator.standard_normal((2, SAMPLES))
    torque += stiffness * angle
    return angle + angle_noise * angle.std(), torque + torque_noise * torque.std(), stiffness


@pytest.mark.parametrize("seed", [1, *long(2, 3)])
@pytest.mark.parametrize("noise", [1e-2, *long(1e-3)])
@pytest.mark.parametrize("missing", [60, *long(30, 200)])
def test_errors_hold_a_jump_in_a_gap(missing: int, noise: float, seed: int) -> None:
    """From half a test function before the gap to as much behind it stiffness was up to 27 % off, 4 to 30 errors, and trusted."""
    angle, torque, stiffness = rig(seed, noise, 1.3 if seed % 2 else 0.7)
    first = JUMP - missing // 2
    angle[first : first + missing] = np.nan
    found = tvident.identify(angle, torque, sample_rate=RATE)
    assert found.trusted.mean() > 0.9
    off = np.abs(found.stiffness - stiffness) / found.stderr["stiffness"]
    assert np.mean(off[found.trusted] > 4) < 1e-3
    near = np.arange(first - 5, first + missing + 5)
    assert np.median(found.stderr["stiffness"][near]) > 0.03 * STIFFNESS
    assert np.median(found.stderr["stiffness"]) < 0.01 * STIFFNESS


def test_what_does_not_change_in_a_gap_has_the_errors_of_its_windows() -> None:
    angle, torque, _ = rig(4, 1e-2, 1.0)
    slow = 12 * np.sin(np.arange(SAMPLES) / 1000)
    torque += slow * angle
    angle[JUMP : JUMP + 60] = np.nan
    found = tvident.identify(angle, torque, sample_rate=RATE)
    error = found.stderr["stiffness"]
    assert error[JUMP - 100 : JUMP + 160].max() < 4 * np.median(error)
