"""Logs of robots on the command line: a joint by its name, whatever its channels are called, and the clock beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from click.testing import CliRunner

import tvident
from tvident._command_line import main

RIG = tvident.simulate_torsional_rig(duration=5.0, sample_rate=500.0)


def written(path: Path, **columns: npt.NDArray[np.float64]) -> str:
    names = [name.replace("__", "/") for name in columns]
    np.savetxt(path, np.stack(list(columns.values()), axis=1), delimiter=",", header=",".join(names), comments="")
    return str(path)


def test_a_joint_and_its_only_clock_are_all_that_is_named(tmp_path: Path) -> None:
    """It had no channel 'elbow.position'."""
    file = written(
        tmp_path / "run.csv",
        t_us=RIG.time * 1e6,
        __arm__wrist__position=RIG.torque,
        __arm__wrist__effort=RIG.angle,
        __arm__elbow__position=RIG.angle,
        __arm__elbow__velocity=0 * RIG.angle,
        __arm__elbow__effort=RIG.torque,
    )
    done = CliRunner().invoke(main, ["identify", file, "--joint", "elbow", "--inertia", "constant"])
    assert done.exit_code == 0, done.output
    expected = tvident.identify(RIG.angle, RIG.torque, sample_rate=500, inertia="constant").value("inertia").value
    line = next(one for one in done.output.splitlines() if one.startswith("inertia ="))
    assert float(line.split()[2]) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("clocks", "words"),
    [
        (("log_time", "robot_time"), "it may be --time log_time or --time robot_time"),
        (
            ("tick",),
            "'tick' goes up by 1 from sample to sample: if it counts milliseconds, give --time tick --time-unit ms",
        ),
    ],
)
def test_clocks_that_are_no_choice_are_named(tmp_path: Path, clocks: tuple[str, ...], words: str) -> None:
    count = np.arange(RIG.time.size, dtype=np.float64)
    file = written(tmp_path / "run.csv", **dict.fromkeys(clocks, count), q_0=RIG.angle, tau_0=RIG.torque)
    done = CliRunner().invoke(main, ["identify", file, "--joint", "0"])
    assert done.exit_code == 2
    assert words in done.output


def test_a_clock_that_is_named_and_is_not_there_is_no_other(tmp_path: Path) -> None:
    file = written(tmp_path / "run.csv", stamp=RIG.time, q_0=RIG.angle, tau_0=RIG.torque)
    assert CliRunner().invoke(main, ["identify", file, "--joint", "0"]).exit_code == 0
    done = CliRunner().invoke(main, ["identify", file, "--joint", "0", "--time", "time"])
    assert done.exit_code == 2
    assert "no channel 'time'" in done.output


def test_compare_takes_a_joint_too(tmp_path: Path) -> None:
    file = written(tmp_path / "run.csv", time=RIG.time, q_0=RIG.angle, tau_J_0=RIG.torque)
    done = CliRunner().invoke(main, ["compare", file, "--joint", "0"])
    assert done.exit_code == 0
    assert "coulomb" in done.output
