"""Recordings whose times are not uniform, from the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import commands
import tvident

RIG = tvident.simulate_torsional_rig(duration=4.0, pattern="constant", seed=6)


@pytest.fixture
def jittered(tmp_path: Path) -> Path:
    shift = np.random.default_rng(6).uniform(-1.5e-4, 1.5e-4, RIG.time.size - 20)
    times = RIG.time[10:-10] + shift
    columns = {"time [s]": times}
    for name, channel in (("angle [rad]", RIG.angle), ("torque [N m]", RIG.torque)):
        columns[name] = make_interp_spline(RIG.time, channel, k=5)(times)
    path = tmp_path / "jittered.csv"
    tvident.FileRecording(columns).write(path)
    return path


def run(*call: object) -> str:
    done = commands.run(*call)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_times_that_jitter_are_taken_and_what_was_done_is_said(jittered: Path) -> None:
    output = run(
        "identify", jittered, "--angle", "angle", "--torque", "torque", "--time", "time", "--stiffness", "constant"
    )
    assert "Times: steps of time scatter by 0.3 of a step: the channels were brought onto a uniform grid of" in output
    expected, error = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, stiffness="constant").constants[
        "stiffness"
    ]
    found = float(output.rsplit("\nstiffness = ", 1)[1].split(maxsplit=1)[0])
    assert abs(found - expected) <= 3 * error
    assert "steps scatter by 0.3 of a step" in run("info", jittered)


def test_derivatives_are_at_the_samples_own_times(jittered: Path, tmp_path: Path) -> None:
    output = tmp_path / "derivatives.csv"
    run(
        "derivatives",
        jittered,
        "--channel",
        "angle",
        "--time",
        "time",
        "--window-length",
        "0.1 s",
        "-o",
        output,
    )
    columns = tvident.read_recording(output)
    np.testing.assert_allclose(columns["time"], tvident.read_recording(jittered)["time"], rtol=1e-12)
    velocity = np.interp(columns["time"], RIG.time, RIG.true_velocity)
    assert np.std(columns["derivative_1"][100:-100] - velocity[100:-100]) < 0.02 * velocity.std()


def test_times_with_few_digits_are_listed_as_they_are_taken(tmp_path: Path) -> None:
    """Of 800 Hz with three digits `info` listed 1000 Hz and 1500 samples lost."""
    path = tmp_path / "x.csv"
    t = np.arange(6000) / 800
    np.savetxt(path, np.column_stack([t, np.sin(t)]), header="time [s],angle", comments="", fmt="%.3f", delimiter=",")
    assert "uniform within its digits: 800 Hz" in run("info", path)
