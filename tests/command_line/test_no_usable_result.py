"""Commands whose results hold nothing end with 1, whatever was written; what a file lacks is said."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from commands import run

RIG = tvident.simulate_torsional_rig(duration=1.0)
NAMED = ("--angle", "angle", "--torque", "torque", "--time", "time")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Give a folder with a recording of which the angle is missing."""
    nothing = np.full(RIG.time.size, np.nan)
    channels = {"time [s]": RIG.time, "angle [rad]": nothing, "torque [N m]": RIG.torque}
    tvident.FileRecording(channels).write(tmp_path / "nothing.npz")
    tvident.FileRecording({**channels, "angle [rad]": RIG.angle}).write(tmp_path / "rig.npz")
    return tmp_path


@pytest.mark.parametrize(
    "command",
    [
        ("identify", *NAMED),
        ("identify", *NAMED, "--inertia", "1.0"),
        ("report", *NAMED, "-o", "page.html"),
        ("compare", *NAMED),
        ("derivatives", "--channel", "angle", "--time", "time"),
    ],
)
def test_what_holds_nothing_ends_with_1(folder: Path, command: tuple[str, ...]) -> None:
    """A report, derivatives and a comparison of nothing ended with 0."""
    name, *options = command
    if name == "report":
        pytest.importorskip("plotly")
    assert run(name, "nothing.npz", *options, cwd=folder).returncode == 1
    done = run(name, "rig.npz", *options, cwd=folder)
    assert done.returncode == 0, done.stderr


def test_nothing_is_the_best_of_nothing(folder: Path) -> None:
    content = json.loads(run("compare", "nothing.npz", *NAMED, "--json", cwd=folder).stdout)
    assert content["best"] is None
    assert json.loads(run("compare", "rig.npz", *NAMED, "--json", cwd=folder).stdout)["best"]


def test_a_wrong_alignment_is_called_so(folder: Path) -> None:
    """The message was about a lag."""
    done = run("identify", "rig.npz", *NAMED, "--align", "foo", cwd=folder)
    assert done.returncode == 2
    assert "align must be offset, drift, seconds" in " ".join(done.stderr.split())


def test_info_says_where_a_clock_goes_back(folder: Path) -> None:
    twice: dict[str, Any] = {
        name: np.concatenate([values, values]) for name, values in (("time [s]", RIG.time), ("a", RIG.angle))
    }
    np.savez(folder / "twice.npz", **twice)
    assert f"goes back once, first at sample {RIG.time.size}" in run("info", "twice.npz", cwd=folder).stdout
    coarse = np.floor(RIG.time * 800) / 800
    slow: dict[str, Any] = {"time [s]": coarse, "a": RIG.angle}
    np.savez(folder / "coarse.npz", **slow)
    assert "stands 200 times, first at sample 1" in run("info", "coarse.npz", cwd=folder).stdout
    no_clock: dict[str, Any] = {"angle [rad]": RIG.angle, "a": -RIG.time}
    np.savez(folder / "none.npz", **no_clock)
    assert "goes back" not in run("info", "none.npz", cwd=folder).stdout


@pytest.mark.parametrize("first", [739_000.0, 45_000.5])
def test_times_in_days_tell_no_rate(first: float) -> None:
    """Of datenum 100 Hz were 8.6 MHz, without a word."""
    days = first + np.arange(500) / 100 / 86400
    recording = tvident.FileRecording({"t": days, "a": np.sin(days)})
    with pytest.raises(ValueError, match="time_unit='days', if it counts days"):
        _ = recording.sample_rate
    named = tvident.FileRecording({"t [days]": days, "a": np.sin(days)})
    assert named.sample_rate == pytest.approx(100, rel=1e-3)
