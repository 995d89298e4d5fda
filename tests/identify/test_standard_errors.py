"""Standard errors of what is computed from several parameters, against what they are over many recordings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tvident
from calls import weak

RUNS = 150
# A standard deviation of so many draws scatters by 1/√(2 · 150) = 6 %; three of these, and 5 % for what the delta method leaves out.
SCATTER = 0.23
KINDS = ("inertia", "damping", "stiffness")


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize(
    "call",
    [
        {"regression_window": 1500},
        {"regression_window": 1500, "inertia": "constant", "damping": "constant"},
        {"inertia": "constant", "damping": "constant", "stiffness": "constant"},
    ],
    ids=["tested", "windowed", "constant"],
)
def test_errors_of_frequency_and_damping_ratio_are_those_of_many_recordings(call: dict[str, Any]) -> None:
    clean = tvident.simulate_torsional_rig(4.0, pattern="constant", torque_snr_db=200, angle_noise=1e-12)
    generator = np.random.default_rng(0)
    level = 0.1 * float(clean.torque.std())
    at = 2000
    found: dict[str, list[tuple[float, float]]] = {"natural_frequency": [], "damping_ratio": []}
    for _ in range(RUNS):
        torque = clean.torque + level * generator.standard_normal(clean.torque.size)
        result = tvident.identify(
            clean.angle, torque, sample_rate=1000, **weak(window_length=81, exponent=8, step=at, **call)
        )
        for name, pairs in found.items():
            pairs.append((float(getattr(result, name)[1]), float(result.stderr[name][1])))
    for name, pairs in found.items():
        values, errors = np.transpose(pairs)
        assert np.median(errors) == pytest.approx(np.std(values), rel=SCATTER), name
    truth = np.sqrt(clean.stiffness[at] / clean.inertia[at]) / (2 * np.pi)
    assert np.mean([value for value, _ in found["natural_frequency"]]) == pytest.approx(truth, rel=1e-3)


def test_errors_do_not_depend_on_the_way_the_equations_took() -> None:
    rig = tvident.simulate_torsional_rig(4.0, pattern="constant")
    kinds: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
    call: dict[str, Any] = {"sample_rate": 1000, "method": "paper", **kinds}
    # A mask, even one that leaves nothing out, is what rows are made one by one for.
    plain = tvident.identify(rig.angle, rig.torque, **call)
    masked = tvident.identify(rig.angle, rig.torque, mask=np.ones(rig.angle.size, dtype=bool), **call)
    for name in ("inertia", "stiffness", "natural_frequency", "damping_ratio"):
        expected = plain.stderr[name][2000]
        assert masked.stderr[name][2000] == pytest.approx(expected, rel=0.1), name


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("pattern", "angle_noise", "least"),
    # On the slider the stiffness bends within a window, and what inertia and stiffness take from each other has longer tails than a
    # normal distribution: 0.92 over 48 recordings.
    [("constant", 1e-3, 0.92), ("constant", 1e-2, 0.92), ("slider", 1e-3, 0.88)],
)
def test_errors_of_windows_in_strong_form_hold_that_equations_share_samples(
    pattern: Any, angle_noise: float, least: float
) -> None:
    # 12 recordings of 10 s hold some 400 windows that share no equation, so a share of 95 % scatters by 1.1 %.
    inside: dict[str, list[float]] = {"inertia": [], "damping": [], "stiffness": [], "natural_frequency": []}
    for seed in range(12):
        rig = tvident.simulate_torsional_rig(10.0, seed=seed, pattern=pattern, angle_noise=angle_noise)
        result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper", step=50)
        frequency = np.sqrt(rig.stiffness / rig.inertia) / (2 * np.pi)
        truth = {
            "inertia": rig.inertia,
            "damping": rig.damping,
            "stiffness": rig.stiffness,
            "natural_frequency": frequency,
        }
        good = result.status & (tvident.Status.INVALID | tvident.Status.EDGE) == 0
        for name, shares in inside.items():
            off = np.abs(getattr(result, name) - truth[name][::50]) / result.stderr[name]
            shares.append(float(np.mean(off[good] < 1.96)))
    for name, shares in inside.items():
        # The frequency gets the largest factor of inertia and stiffness, which is more than it needs.
        assert least < np.mean(shares) < (0.98 if name != "natural_frequency" else 1.0), name


@pytest.mark.parametrize("seconds", [0.7, 10.0], ids=["too short for differences", "long enough"])
def test_errors_do_not_depend_on_the_step(seconds: float) -> None:
    rig = tvident.simulate_torsional_rig(seconds, angle_noise=1e-2)
    call: dict[str, Any] = {"sample_rate": 1000, "method": "paper"}
    every = tvident.identify(rig.angle, rig.torque, **call)
    some = tvident.identify(rig.angle, rig.torque, step=7, **call)
    for name in every.stderr:
        np.testing.assert_array_equal(some.stderr[name], every.stderr[name][::7], err_msg=name)


def test_errors_of_constants_in_strong_form_hold_that_equations_share_samples() -> None:
    clean = tvident.simulate_torsional_rig(4.0, pattern="constant", torque_snr_db=200, angle_noise=1e-12)
    generator = np.random.default_rng(1)
    level = 0.01 * float(clean.angle.std())
    call: dict[str, Any] = {"sample_rate": 1000, "method": "paper", **dict.fromkeys(KINDS, "constant")}
    found = []
    for _ in range(RUNS // 3):
        angle = clean.angle + level * generator.standard_normal(clean.angle.size)
        found.append(tvident.identify(angle, clean.torque, **call).constants["stiffness"])
    values, errors = np.transpose(found)
    # 50 runs scatter by 10 %; three of these, and 5 % for the taper of the covariance. Ordinary least squares are off by a factor.
    assert np.median(errors) == pytest.approx(np.std(values), rel=0.35)
