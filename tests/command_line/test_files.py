"""Recordings from ROS bags and from standard input."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.interpolate import make_interp_spline

import recorded_files
import tvident
from tvident._command_line import main

RIG = tvident.simulate_torsional_rig(duration=4.0, pattern="constant", seed=5)
EXPECTED = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, stiffness="constant")


DIGITS = 1e-7
"""Of a number that is printed with eight."""


def constant(output: str, name: str) -> float:
    return float(output.rsplit(f"\n{name} = ", 1)[1].split(maxsplit=1)[0])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of the library that writes bags
def test_a_joint_of_a_bag_is_all_that_is_named(tmp_path: Path) -> None:
    recorded_files.mcap(tmp_path / "run.mcap", RIG.time, RIG.angle, RIG.torque)
    call = ["identify", str(tmp_path / "run.mcap"), "--joint", "elbow", "--stiffness", "constant"]
    done = CliRunner().invoke(main, call)
    assert done.exit_code == 0, done.output
    assert constant(done.output, "stiffness") == pytest.approx(EXPECTED.constants["stiffness"][0], rel=1e-6)
    assert "scatter" not in done.output
    both = CliRunner().invoke(main, [*call, "--angle", "elbow.position"])
    assert both.exit_code == 2
    assert "--joint stands for --angle and --torque" in both.output
    neither = CliRunner().invoke(main, ["identify", "x.csv", "--angle", "angle"])
    assert neither.exit_code == 2
    assert "Missing option '--torque'" in neither.output


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("write", [recorded_files.mcap, recorded_files.bag])
def test_the_velocity_of_a_joint_is_used_where_something_measured_it(
    tmp_path: Path, write: Callable[..., None]
) -> None:
    generator = np.random.default_rng(1)
    velocity = RIG.true_velocity + 0.001 * RIG.true_velocity.std() * generator.standard_normal(RIG.time.size)
    expected = tvident.identify(RIG.angle, RIG.torque, velocity=velocity, sample_rate=1000, stiffness="constant")
    for name, measured, constants in (
        ("run", velocity, expected.constants),
        ("at-rest", np.zeros_like(velocity), EXPECTED.constants),
    ):
        (tmp_path / name).mkdir()
        place = tmp_path / name / f"run{'.bag' if write is recorded_files.bag else '.mcap'}"
        write(place, RIG.time, RIG.angle, RIG.torque, measured)
        done = CliRunner().invoke(main, ["identify", str(place), "--joint", "elbow", "--stiffness", "constant"])
        assert done.exit_code == 0, done.output
        assert ("velocity_bias" in done.output) == (name == "run")
        assert constant(done.output, "inertia") == pytest.approx(constants["inertia"][0], rel=1e-6)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_stamps_that_scatter_are_evened_out_and_said(tmp_path: Path) -> None:
    generator = np.random.default_rng(0)
    times = RIG.time[10:-10] + generator.uniform(-2e-4, 2e-4, RIG.time.size - 20)
    angle, torque = (make_interp_spline(RIG.time, channel, k=5)(times) for channel in (RIG.angle, RIG.torque))
    recorded_files.mcap(tmp_path / "run.mcap", times + 1, angle, torque)
    call = ["identify", str(tmp_path / "run.mcap"), "--joint", "elbow", "--stiffness", "constant"]
    done = CliRunner().invoke(main, call)
    assert done.exit_code == 0, done.output
    assert "steps of time scatter by 0.41 of a step: the channels were brought onto a uniform grid" in done.output
    # Within the standard errors of both.
    value, error = EXPECTED.constants["stiffness"]
    assert constant(done.output, "stiffness") == pytest.approx(value, abs=3 * error)


@pytest.mark.parametrize("ending", [".csv", ".npz"])
def test_a_recording_may_come_from_standard_input(tmp_path: Path, ending: str) -> None:
    RIG.save(tmp_path / f"x{ending}")
    content = (tmp_path / f"x{ending}").read_bytes()
    call = "identify - --angle angle --torque torque --sample-rate 1000 --stiffness constant"
    done = CliRunner().invoke(main, call.split(), input=content)
    assert done.exit_code == 0, done.output
    assert constant(done.output, "stiffness") == pytest.approx(EXPECTED.constants["stiffness"][0], rel=DIGITS)
    nothing = CliRunner().invoke(main, ["info", "-"], input=b"")
    assert nothing.exit_code == 1
    assert "standard input: holds no numbers" in nothing.output
