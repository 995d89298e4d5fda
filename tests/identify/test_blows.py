"""Machines that a hammer strikes now and then: between blows the torque is noise, and the equation says nothing of its scale."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import Status

Array = npt.NDArray[np.float64]

RATE = 250.0
INERTIA, DAMPING, STIFFNESS = 2.6e-4, 7e-4, 0.105
FINER = 16


def struck(
    seed: int, *, lasting: int, growth: float = 0.0, angle_noise: float = 8e-5, torque_noise: float = 0.02
) -> tuple[Array, Array, Array]:
    """Return angle, torque and inertia of an oscillator of 3.2 Hz that is struck 25 times in 32 s, for so many samples each.

    The torque goes along straight lines from sample to sample; the inertia grows by a part of it.
    """
    generator = np.random.default_rng(seed)
    torque = np.zeros(8000)
    for first in generator.integers(0, torque.size - lasting, 25):
        torque[first : first + lasting] += generator.choice([-1, 1]) * np.hanning(lasting) * 0.0126
    fine = np.arange(torque.size * FINER) / FINER
    driven = np.interp(fine, np.arange(torque.size), torque).tolist()
    inertia = INERTIA * (1 + growth * fine / torque.size)
    masses, step = inertia.tolist(), 1 / (RATE * FINER)
    angle, velocity, angles = 0.0, 0.0, np.empty(fine.size)
    for sample, (now, mass) in enumerate(zip(driven, masses, strict=True)):
        angles[sample] = angle
        # The midpoint rule, of second order.
        middle = velocity + step / 2 * (now - DAMPING * velocity - STIFFNESS * angle) / mass
        there = angle + step / 2 * velocity
        after = (now + driven[min(sample + 1, fine.size - 1)]) / 2
        angle += step * middle
        velocity += step * (after - DAMPING * middle - STIFFNESS * there) / mass
    clean = angles[::FINER]
    noisy = clean + angle_noise * clean.std() * generator.standard_normal(clean.size)
    return noisy, torque + torque_noise * torque.std() * generator.standard_normal(torque.size), inertia[::FINER]


@pytest.mark.parametrize("seed", [1, 2])
def test_blows_find_what_is_constant(seed: int) -> None:
    angle, torque, _ = struck(seed, lasting=16)
    result = tvident.identify(angle, torque, sample_rate=RATE)
    assert not result.record_status
    assert result.trusted.mean() > 0.98
    for name, truth in (("inertia", INERTIA), ("damping", DAMPING), ("stiffness", STIFFNESS)):
        found = result.value(name)
        assert abs(found.value - truth) < 4 * found.stderr, name
        assert found.stderr < 0.005 * truth
    assert not any("not tested" in reason for reason in result.reasons)


@pytest.mark.parametrize("seed", [1, 2])
def test_an_inertia_that_grows_between_blows_is_no_stiffness_that_falls(seed: int) -> None:
    angle, torque, inertia = struck(seed, lasting=47, growth=0.3)
    result = tvident.identify(angle, torque, sample_rate=RATE)
    assert result.value("inertia").kind != "constant"
    inside = slice(500, -500)
    assert np.max(np.abs(result.inertia / inertia - 1)[inside]) < 0.01
    assert np.max(np.abs(np.broadcast_to(result.stiffness, angle.shape) / STIFFNESS - 1)[inside]) < 0.01


@pytest.mark.parametrize("seed", [1, 2])
def test_widths_that_differ_by_less_than_a_thousandth_are_trusted_and_errors_hold_it(seed: int) -> None:
    # With next to no noise the straight lines of the torque are a difference beyond every error.
    angle, torque, _ = struck(seed, lasting=16, torque_noise=1e-4)
    result = tvident.identify(angle, torque, sample_rate=RATE)
    assert not result.record_status & Status.SCALES_DISAGREE
    assert any("which standard errors hold" in reason for reason in result.reasons)
    for name, truth in (("inertia", INERTIA), ("damping", DAMPING), ("stiffness", STIFFNESS)):
        found = result.value(name)
        assert abs(found.value - truth) < 3 * found.stderr, name
        assert found.stderr < 0.002 * truth
