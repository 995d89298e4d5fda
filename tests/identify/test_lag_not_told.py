"""A damping that grows, next to without noise, and lags beside it: where one does not settle, other errors hold what is not known of it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long

Array = npt.NDArray[np.float64]

RATE, SAMPLES = 1000.0, 20_000
NOISE = 1e-6
CLOSE = 4.0
MOSTLY = 0.9

SETTLED = 1e-4
"""Samples of a lag, or parts of an inertia, by which what settles is off at most: curves that are quadratics near a place leave as much."""


def with_growing_damping(seed: int) -> tuple[Array, Array, float]:
    """Give angle, torque and inertia of a rig that twelve sines drive and whose damping grows by half, next to without noise."""
    generator = np.random.default_rng([seed, 1054])
    inertia = 0.1 * np.exp(generator.uniform(-0.3, 0.3))
    stiffness = inertia * (2 * np.pi * generator.uniform(1.5, 3)) ** 2
    ratio = generator.uniform(0.08, 0.35)
    frequencies = 2 * np.pi * np.exp(generator.uniform(np.log(0.3), np.log(8), 12))
    phases = generator.uniform(0, 2 * np.pi, 12)
    time = np.arange(4 * SAMPLES + 1) / (4 * RATE)
    torque = np.sqrt(1 / 6) * sum(np.sin(f * time + p) for f, p in zip(frequencies, phases, strict=True))
    damping = 2 * ratio * np.sqrt(stiffness * inertia) * (1 + 0.5 * (time / time[-1] - 0.5))
    angle, state, h = np.empty(SAMPLES), np.zeros(2), 0.5 / RATE

    def rate(state: Array, moment: int) -> Array:
        left = torque[moment] - damping[moment] * state[1] - stiffness * state[0]
        return np.array([state[1], left / inertia])

    for half in range(2 * SAMPLES):
        if half % 2 == 0:
            angle[half // 2] = state[0]
        one = rate(state, 2 * half)
        two = rate(state + h / 2 * one, 2 * half + 1)
        three = rate(state + h / 2 * two, 2 * half + 1)
        four = rate(state + h * three, 2 * half + 2)
        state = state + h / 6 * (one + 2 * two + 2 * three + four)
    noise = NOISE * generator.standard_normal((2, SAMPLES))
    recorded = np.asarray(torque[::4][:SAMPLES])
    return angle + np.std(angle) * noise[0], recorded + np.std(recorded) * noise[1], inertia


def errors_off(result: tvident.Identification, inertia: float) -> float:
    """Give by how many of its standard errors the inertia is off, rms."""
    off = ((result.inertia - inertia) / result.stderr["inertia"])[result.trusted]
    return float(np.sqrt(np.mean(off**2)))


@pytest.mark.parametrize("seed", [5])
def test_errors_hold_what_is_not_told_of_a_lag(seed: int) -> None:
    """A search that goes on by little at each choice says nothing of where it ends, and other parameters are off by more than they know."""
    angle, torque, inertia = with_growing_damping(seed)
    result = tvident.identify(angle, torque, sample_rate=RATE, lag="auto")
    assert result.settings["lag"] == 0
    (untold,) = result.settings["lag_untold"]
    assert untold > 0.001
    assert any(f"errors hold one of {untold:.1g} samples" in line for line in result.reasons)
    assert errors_off(result, inertia) < CLOSE
    again = tvident.identify(angle, torque, sample_rate=RATE, settings=result.settings)
    assert again.settings["lag_untold"] == [untold]
    np.testing.assert_allclose(again.stderr["inertia"], result.stderr["inertia"], rtol=1e-6)


@pytest.mark.parametrize("seed", [7, *long(2, 3)])
def test_a_lag_settles_beside_what_grows(seed: int) -> None:
    """Nearly all rows were beyond the largest square that counts, so it was chosen by next to nothing, and "not determined"."""
    angle, torque, inertia = with_growing_damping(seed)
    result = tvident.identify(angle, torque, sample_rate=RATE, lag="auto")
    assert "lag_untold" not in result.settings
    assert abs(result.settings["lag"]) < SETTLED
    assert result.trusted.mean() > MOSTLY
    assert np.abs(result.inertia / inertia - 1).max() < SETTLED
    assert errors_off(result, inertia) < CLOSE


@pytest.mark.parametrize("seed", [1, *long(3, 5)])
def test_what_grows_has_a_wide_bandwidth_beside_next_to_no_noise(seed: int) -> None:
    """Curves with all equations of a row were narrow, and those of the inertia, which does not grow, left a tenth."""
    angle, torque, inertia = with_growing_damping(seed)
    result = tvident.identify(angle, torque, sample_rate=RATE)
    assert result.settings["kinds"]["damping"] == "varying"
    assert np.abs(result.inertia / inertia - 1).max() < SETTLED
    assert errors_off(result, inertia) < CLOSE
