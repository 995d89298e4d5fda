from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest

import tvident
from tvident._simulate import motion


@pytest.mark.parametrize("pattern", ["slider", "ramp", "square", "constant"])
@pytest.mark.parametrize("excitation", ["multisine", "chirp", "random"])
def test_the_angle_does_not_change_with_finer_steps(
    pattern: Literal["slider", "ramp", "square", "constant"],
    excitation: Literal["multisine", "chirp", "random"],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    recording = tvident.simulate_torsional_rig(9.0, pattern=pattern, excitation=excitation)
    monkeypatch.setattr(motion, "_ANGLE_A_STEP", 0.003)
    finer = tvident.simulate_torsional_rig(9.0, pattern=pattern, excitation=excitation)
    assert np.abs(recording.true_angle - finer.true_angle).max() < 1e-10 * finer.true_angle.std()
    assert np.abs(recording.true_velocity - finer.true_velocity).max() < 1e-10 * finer.true_velocity.std()


def test_the_steady_state_under_a_constant_stiffness_is_the_known_one() -> None:
    recording = tvident.simulate_torsional_rig(60.0, pattern="constant", damping=0.1)
    # Multisine torque of period 4 s: divide its spectrum by that of the equation of motion.
    last = slice(-4000, None)
    spectrum = np.fft.rfft(recording.true_torque[last])
    omega = 2j * np.pi * np.fft.rfftfreq(4000, 1e-3)
    angle = np.fft.irfft(spectrum / (0.0123 * omega**2 + 0.1 * omega + 6.0 / 0.45), 4000)
    assert np.abs(recording.true_angle[last] - angle).max() < 1e-9 * angle.std()


def test_noise_is_what_was_asked_for() -> None:
    recording = tvident.simulate_torsional_rig(torque_snr_db=10, angle_noise=0.02)
    noise = recording.torque - recording.true_torque
    assert 10 * np.log10(recording.true_torque.var() / noise.var()) == pytest.approx(10, abs=0.2)
    assert (recording.angle - recording.true_angle).std() == pytest.approx(0.02 * recording.true_angle.std(), rel=0.03)
    steps = tvident.simulate_torsional_rig(encoder_counts=4096).angle / (2 * np.pi / 4096)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_a_seed_gives_the_same_recording_and_another_one_another() -> None:
    one, same, other = (tvident.simulate_torsional_rig(1.0, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.angle, same.angle)
    assert np.abs(one.angle - other.angle).max() > 0.01


def test_the_truth_obeys_the_equation_of_motion() -> None:
    r = tvident.simulate_torsional_rig(
        3.0, pattern=lambda t: 0.4 + 0.1 * t / 3, inertia=lambda t: 0.0123 * (1 + 0.1 * np.sin(t)), damping=0.01
    )
    np.testing.assert_allclose(r.stiffness, 6.0 / r.slider_position)
    balance = r.inertia * r.true_acceleration + r.damping * r.true_velocity + r.stiffness * r.true_angle
    np.testing.assert_allclose(balance, r.true_torque, atol=1e-12)
    numeric = np.gradient(r.true_velocity, r.time, edge_order=2)
    assert np.abs(numeric - r.true_acceleration).max() < 1e-2 * np.abs(r.true_acceleration).max()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"duration": -1.0}, "duration must be positive"),
        ({"duration": 1e-9}, "at least one sample"),
        ({"pattern": "spiral"}, "pattern must be 'slider'"),
        ({"excitation": "hammer"}, "excitation must be 'multisine'"),
        ({"encoder_counts": 0}, "encoder_counts must be at least 1"),
        ({"inertia": 0.0}, "inertia must be positive"),
    ],
)
def test_misuse_says_the_rule_the_value_and_the_cure(call: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tvident.simulate_torsional_rig(**call)
