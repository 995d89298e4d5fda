"""What the options say of channels arrives at the library."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import tvident
from commands import run
from tvident import recordings


@pytest.mark.parametrize(("degrees", "period"), [(1.0, "2pi"), (180 / math.pi, "360")])
def test_a_wrapped_angle(tmp_path: Path, degrees: float, period: str) -> None:
    t = np.arange(2000) / 500
    angle = 3 * np.sin(9 * t) + 2 * np.sin(23 * t) + 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    torque = 3 * angle + 0.01 * (-243 * np.sin(9 * t) - 1058 * np.sin(23 * t))
    wrapped = (angle % (2 * math.pi)) * degrees
    np.savez(tmp_path / "rig.npz", angle=wrapped, torque=torque)
    time = ("--sample-rate", 500, "--period", period)
    scale = ("--angle-scale", 1 / degrees)
    done = run(
        "identify", "rig.npz", "--angle", "angle", "--torque", "torque", *time, *scale, "-o", "a.npz", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    found = recordings.read(tmp_path / "a.npz")["stiffness [N m/rad]"]
    expected = tvident.identify(wrapped / degrees, torque, sample_rate=500, period=2 * math.pi)
    np.testing.assert_allclose(found, expected.stiffness, rtol=1e-9)

    call = ("derivatives", "rig.npz", "--channel", "angle", "--window-length", 21, *time, "-o", "d.npz")
    assert run(*call, cwd=tmp_path).returncode == 0
    fit = tvident.fit_local_polynomials(wrapped, 21, sample_rate=500, period=2 * math.pi * degrees)
    rate = recordings.read(tmp_path / "d.npz")["derivative_1"]
    np.testing.assert_allclose(rate, fit.derivatives[1], rtol=1e-9, atol=1e-9 * degrees)


@pytest.mark.parametrize("period", ["0", "nan", "2pie", "-pi", "turn"])
def test_a_period_that_cannot_be_is_refused(tmp_path: Path, period: str) -> None:
    np.savez(tmp_path / "rig.npz", angle=np.zeros(100))
    call = ("derivatives", "rig.npz", "--channel", "angle", "--sample-rate", 1)
    done = run(*call, "--period", period, cwd=tmp_path)
    assert done.returncode == 2
    assert "--period must be a number above zero, or a multiple of pi such as 2pi" in done.stderr


@pytest.mark.slow
def test_a_velocity_beside_the_angle_or_in_its_place(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=4, sample_rate=500, seed=2)
    velocity = rig.true_velocity + 0.01 * np.random.default_rng(0).standard_normal(rig.angle.size)
    np.savez(
        tmp_path / "rig.npz", angle=rig.angle, torque=rig.torque, gyro=velocity, accelerometer=rig.true_acceleration
    )
    call = ("identify", "rig.npz", "--torque", "torque", "--sample-rate", 500, "-o", "out.npz")
    done = run(*call, "--angle", "angle", "--velocity", "gyro", "--acceleration", "accelerometer", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    expected = tvident.identify(
        rig.angle, rig.torque, sample_rate=500, velocity=velocity, acceleration=rig.true_acceleration
    )
    found = recordings.read(tmp_path / "out.npz")["stiffness [N m/rad]"]
    np.testing.assert_allclose(found, expected.stiffness, rtol=1e-9)
    assert "velocity_bias = " in done.stdout
    assert "rad/s" in done.stdout

    assert run(*call, "--velocity", "gyro", "--stiffness", "constant", cwd=tmp_path).returncode == 0
    none = run(*call, cwd=tmp_path)
    assert none.returncode == 2
    assert "Missing option '--angle'" in none.stderr
