from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long
from tvident._simulate import motion


@pytest.mark.slow
@pytest.mark.parametrize("pattern", ["slider", *long("ramp", "square", "constant")])
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
        ({"duration": 1e18}, "duration times sample_rate must be at most 1e[+]08 samples; got 1e[+]21; shorten"),
        ({"duration": 1e300, "sample_rate": 1e29}, "at most 1e[+]08 samples; got inf; shorten"),
        ({"duration": 200, "sample_rate": 0.01}, "at most 100 rad in a sample period; got 7.54e[+]03 rad at 12 Hz"),
        (
            {"duration": 1e4, "torsional_rigidity": 1e4},
            "at most 1e[+]09 steps of integration; got .* shorten the recording",
        ),
        ({"duration": 0.1, "inertia": 1e-300}, "at most 100 rad in a sample period; got 8.25e[+]294 rad"),
        ({"duration": 0.1, "torsional_rigidity": 1e300}, "at most 100 rad in a sample period"),
        ({"duration": 0.1, "damping": 1e308}, "at most 100 rad in a sample period; got inf"),
        ({"sample_rate": 1e300}, "sample_rate must be between 1e-30 and 1e[+]30 Hz"),
        ({"damping": -0.1}, "damping must be at least 0; got -0.1; pass 0 or more"),
        ({"damping": np.nan}, "damping must be finite; got nan"),
        ({"torque_snr_db": np.nan}, "torque_snr_db must be finite; got nan"),
        ({"torque_snr_db": -(10**400)}, "torque_snr_db must be finite; got -1000"),
        ({"torque_snr_db": -1e4}, "torque_snr_db must be at least -200; got -10000.0"),
        ({"angle_noise": -1e-3}, "angle_noise must be at least 0; got -0.001"),
        ({"angle_noise": np.inf}, "angle_noise must be finite; got inf"),
        ({"angle_noise": 1e300}, "angle_noise must be at most 1e[+]10; got 1e[+]300"),
        ({"pattern": lambda t: t * np.nan}, "what pattern returns must be finite and positive; got nan at 0 s; repair"),
        ({"pattern": lambda t: 0.1 - t}, "what pattern returns must be finite and positive; got .* at 0.1"),
        ({"pattern": lambda t: np.where(t < 19, 1.0, np.inf)}, "finite and positive; got inf at 19"),
        ({"pattern": lambda t: np.ma.masked_less(1 + t, 2.0)}, "finite and positive; got nan at 0 s"),
        (
            {"pattern": lambda _: np.zeros(3)},
            r"one value for every time; got shape \(3,\) for times of shape \(",
        ),
        ({"inertia": lambda t: -t}, "what inertia returns must be finite and positive; got -0 at 0 s"),
        ({"damping": lambda t: -t}, "what damping returns must be finite and not negative; got "),
    ],
)
def test_misuse_says_the_rule_the_value_and_the_cure(call: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tvident.simulate_torsional_rig(**call)


@pytest.mark.parametrize("wrong", [lambda t: t + 1j, lambda _: None, lambda _: "far"])
def test_functions_return_real_numbers(wrong: Any) -> None:
    with pytest.raises(TypeError, match="what pattern returns must"):
        tvident.simulate_torsional_rig(pattern=wrong)


def test_a_function_that_writes_to_its_times_changes_nothing() -> None:
    def writing(t: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        t *= 0.0
        return t + 0.45

    rig = tvident.simulate_torsional_rig(1.0, pattern=writing)
    same = tvident.simulate_torsional_rig(1.0, pattern="constant")
    np.testing.assert_array_equal(rig.time, np.arange(1000) / 1000)
    np.testing.assert_array_equal(rig.angle, same.angle)


def test_heavy_damping_is_followed() -> None:
    # The velocity decays within an eighth of a sample, so it is the torque over the damping: inertia and stiffness change that by
    # the ratio of 813 000 rad/s to the 75 rad/s of the torque, and to the 27 rad/s at which the stiffness brings the rig back.
    r = tvident.simulate_torsional_rig(0.005, sample_rate=10_000, damping=1000.0)
    np.testing.assert_allclose(r.true_velocity[1:], r.true_torque[1:] / 1000, rtol=1e-3)


def test_few_samples_of_a_fast_clock_are_simulated() -> None:
    r = tvident.simulate_torsional_rig(1e-6, sample_rate=1e9)
    assert r.angle.shape == (1000,)
    assert np.isfinite(r.torque).all()


def test_the_truth_is_found_by_name() -> None:
    rig = tvident.simulate_torsional_rig(duration=1.0)
    assert list(rig.truth) == ["inertia", "damping", "stiffness"]
    assert all(value is getattr(rig, name) for name, value in rig.truth.items())
