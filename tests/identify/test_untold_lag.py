"""A lag of half a sample, as drives have that hold each torque until the next: found where the motion tells it, else said."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy.linalg import expm

import tvident
from parameters import long

Array = npt.NDArray[np.float64]

RATE, SAMPLES = 1000.0, 8000
INERTIA, FREQUENCY = 0.02, 5.0
STIFFNESS = INERTIA * (2 * np.pi * FREQUENCY) ** 2
HALF = -0.5 / RATE
"""The lag of a torque that is held and recorded when it begins."""

UNTOLD = "the record does not tell half a sample of lag"
CONDITION = "; errors hold if the model does: see what to do"
CLOSE = 4.0


def held(torque: Array, damping: float, noise: float, seed: int) -> Array:
    """Return the angle of an oscillator whose torque is held from each sample to the next."""
    system = np.zeros((3, 3))
    system[0, 1] = 1
    system[1] = np.array([-STIFFNESS, -damping, 1]) / INERTIA
    step = expm(system / RATE)[:2]
    state, angle = np.zeros(2), np.empty(SAMPLES)
    for k, value in enumerate(torque):
        angle[k] = state[0]
        state = step @ (*state, value)
    return np.asarray(angle + noise * angle.std() * np.random.default_rng(seed).standard_normal(SAMPLES))


def damping_of(ratio: float) -> float:
    return 2 * ratio * INERTIA * 2 * np.pi * FREQUENCY


def slow(seed: int) -> Array:
    """Return a torque far below the natural frequency, where inertia tells next to nothing, that grows from zero."""
    t = np.arange(SAMPLES) / RATE
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, 6)
    frequencies = (0.4, 0.5, 0.7, 0.9, 1.1, 1.3)
    begins = np.sin(np.clip(t / 2, 0, 1) * np.pi / 2) ** 2
    return np.asarray(begins * sum(np.sin(2 * np.pi * f * t + p) for f, p in zip(frequencies, phases, strict=True)))


def quick(seed: int) -> Array:
    """Return a torque of frequencies on both sides of the natural one."""
    t = np.arange(SAMPLES) / RATE
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, 9)
    return np.asarray(sum(np.sin(2 * np.pi * f * t + p) for f, p in zip(np.geomspace(0.7, 18, 9), phases, strict=True)))


def sweep() -> Array:
    t = np.arange(SAMPLES) / RATE
    seconds, first, growth = SAMPLES / RATE, 0.5, np.log(40)
    return np.asarray(np.sin(2 * np.pi * first * seconds / growth * (np.exp(t / seconds * growth) - 1)))


def is_said(result: tvident.Identification) -> bool:
    return any(line.startswith(UNTOLD) for line in result.advice)


@pytest.mark.parametrize("seed", [1, *long(2, 3)])
def test_what_half_a_sample_changes_is_said_where_nothing_tells_it(seed: int) -> None:
    damping = damping_of(0.03)
    torque = slow(seed)
    angle = held(torque, damping, 1e-3, seed)
    torque = torque + 5e-3 * torque.std() * np.random.default_rng(seed + 50).standard_normal(SAMPLES)
    result = tvident.identify(angle, torque, sample_rate=RATE)
    found, error = result.value("damping").value, result.value("damping").stderr
    assert abs(found - damping) > CLOSE * error  # this is what has to be said
    assert is_said(result)
    assert CONDITION in str(result.summary()).splitlines()[0]
    line = next(line for line in result.advice if line.startswith(UNTOLD))
    assert f"give lag={HALF:.3g} (seconds)" in line
    told = float(line.split("damping by ")[1].split(" %")[0]) / 100
    assert told == pytest.approx(abs(found - damping) / found, rel=0.2)
    for lag in (HALF, "auto"):
        again = tvident.identify(angle, torque, sample_rate=RATE, lag=lag)
        assert not is_said(again)
        assert abs(again.value("damping").value - damping) < CLOSE * again.value("damping").stderr


@pytest.mark.parametrize("seed", [1, *long(2, 3)])
def test_nothing_is_said_where_the_motion_tells_the_lag(seed: int) -> None:
    torque = quick(seed)
    angle = held(torque, damping_of(0.1), 1e-3, seed)
    result = tvident.identify(angle, torque, sample_rate=RATE, lag=HALF)
    assert not is_said(result)
    # The torque of the simulator is linear between samples.
    rig = tvident.simulate_torsional_rig(10.0, seed=seed, angle_noise=1e-3)
    assert not is_said(tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate))


@pytest.mark.parametrize("ratio", [0.3, *long(0.1, 0.6)])
def test_a_damping_that_would_follow_a_sweep_leaves_the_lag_to_the_torque(ratio: float) -> None:
    damping, torque = damping_of(ratio), sweep()
    result = tvident.identify(held(torque, damping, 1e-3, 1), torque, sample_rate=RATE, lag="auto")
    lag, error = result.settings["lag"] * RATE, result.settings["lag_stderr"] * RATE
    assert abs(lag + 0.5) < CLOSE * error < 0.1
    assert result.settings["kinds"]["damping"] == "constant"
    for name, true in (("inertia", INERTIA), ("damping", damping)):
        assert abs(result.value(name).value - true) < CLOSE * result.value(name).stderr
