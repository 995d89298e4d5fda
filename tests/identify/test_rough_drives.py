"""Drives that reach the highest frequencies, as random signs do: what they hold there is no noise, of the torque or of the angle."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import cont2discrete, lfilter

import tvident
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]

TRUTH = {"inertia": 0.1, "damping": 0.8, "stiffness": 11.0}
RATE = 100.0
NOISE = 0.02


def random_signs(seed: int, angle_noise: float, seconds: float = 40.0) -> tuple[Array, Array]:
    """Give angle and torque of a rig that is driven by random signs, which change half way between samples."""
    generator = np.random.default_rng(seed)
    samples = int(seconds * RATE)
    held = int(0.3 * RATE)
    signs = np.repeat(generator.choice([-1.0, 1.0], samples // held + 2), held)[:samples]
    torque = 3.0 * np.concatenate([[signs[0]], np.repeat(signs, 2)[: 2 * samples - 1]])
    system = [1.0], [TRUTH["inertia"], TRUTH["damping"], TRUTH["stiffness"]]
    top, bottom, _ = cont2discrete(system, 0.5 / RATE)
    angle = lfilter(np.ravel(top), bottom, torque)
    noise = generator.standard_normal((2, samples))
    return angle[::2] + angle_noise * np.std(angle) * noise[0], torque[::2] + NOISE * noise[1]


@pytest.mark.parametrize("seed", [0, *long(*range(1, 12))])
@pytest.mark.parametrize("angle_noise", [0.0, 1e-4, 1e-3])
@pytest.mark.parametrize("stiffness", ["constant", "windowed"])
def test_what_random_signs_hold_at_high_frequencies_is_no_noise(seed: int, angle_noise: float, stiffness: Any) -> None:
    """Read from its highest frequencies the torque's noise was 20 times too large: errors were, too, and friction was not seen."""
    angle, torque = random_signs(seed, angle_noise)
    result = tvident.identify(angle, torque, sample_rate=RATE, stiffness=stiffness)
    (shown,) = result.settings["shown_noise"]
    assert np.sqrt(shown) < 4 * NOISE
    assert not any("feeds it back" in line for line in result.advice)
    if angle_noise >= 1e-3:  # beside less, what samples of jumps leave of the equations is seen: .1 % of the inertia
        assert not result.record_status & (Status.CHANNEL_SUSPECTED | Status.TERM_SUSPECTED)
    for name, truth in TRUTH.items():
        value, error, *_ = result.value(name)
        assert abs(value - truth) < 5 * error
        assert error < 0.02 * truth


@pytest.mark.parametrize("seed", [0, *long(1, 2, 3)])
def test_what_random_signs_move_is_no_noise_where_the_torque_is_late(seed: int) -> None:
    """Behind a lag of two samples the motion was taken for feedback (coherence .99), and errors were 100 times too large."""
    angle, torque = random_signs(seed, 0.0)
    late = 2
    result = tvident.identify(angle[late:], torque[:-late], sample_rate=RATE, lag=late / RATE)
    (shown,) = result.settings["shown_noise"]
    assert np.sqrt(shown) < 4 * NOISE
    assert not any("feeds it back" in line for line in result.advice)
    for name, truth in TRUTH.items():
        value, error, *_ = result.value(name)
        assert abs(value - truth) < 5 * error < 0.1 * truth


def test_by_how_much_widths_differ_is_said() -> None:
    """Whether tenths of a percent or half of a parameter are at stake decides what a reader does."""
    angle, torque = random_signs(0, 0.0, 8.0)
    result = tvident.identify(angle[2:], torque[:-2], sample_rate=RATE)
    said = r"shows where they differ \(from \d+ to \d+ samples inertia by ([\d.]+) % and damping by ([\d.]+) %\)"
    found = re.search(said, " ".join(result.advice))
    assert found is not None
    assert 5 < float(found[1]) < 20
    assert 1 < float(found[2]) < 10


def growing(seed: int) -> tuple[Array, Array, Array]:
    """Give angle, torque and damping of such a rig for a minute, whose damping grows by half."""
    generator = np.random.default_rng(seed)
    samples, held, part = 6000, 25, 50
    signs = np.repeat(generator.choice([-1.0, 1.0], samples // held + 2), held)[:samples]
    torque = 10 * np.concatenate([[signs[0]], np.repeat(signs, 2)[: 2 * samples - 1]])
    inertia, stiffness = TRUTH["inertia"], TRUTH["stiffness"]
    damping = np.repeat(TRUTH["damping"] * np.linspace(1, 1.5, samples // part), part)
    angle, state = np.empty(samples), np.zeros(2)
    for sample in range(samples):
        if sample % part == 0:
            change = np.array([[0.0, 1.0], [-stiffness / inertia, -damping[sample] / inertia]])
            system = change, np.array([[0.0], [1 / inertia]]), np.eye(2), np.zeros((2, 1))
            step, drive, *_ = cont2discrete(system, 0.5 / RATE)
        angle[sample] = state[0]
        for moment in (2 * sample, 2 * sample + 1):
            state = step @ state + drive[:, 0] * torque[moment]
    return angle, torque[::2] + 0.4 * generator.standard_normal(samples), damping


@pytest.mark.parametrize("seed", [2, *long(0, 1, 3)])
def test_a_lag_is_found_beside_a_damping_that_grows(seed: int) -> None:
    """A damping that was followed without the lag had taken a part of it: .5 of two samples was found, and an inertia 15 % too small."""
    angle, torque, damping = growing(seed)
    late = 2
    result = tvident.identify(angle[late:], torque[:-late], sample_rate=RATE, lag="auto")
    assert abs(RATE * result.settings["lag"] - late) < min(0.1, 5 * RATE * result.settings["lag_stderr"])
    value, error, *_ = result.value("inertia")
    assert abs(value - TRUTH["inertia"]) < min(0.05 * value, 5 * error)
    assert np.median(np.abs(result.damping / damping[late:] - 1)) < 0.02
