"""One clock for two channels that have clocks of their own, as their file says."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

import tvident
from commands import run

LATE = 40
"""Samples."""


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    made = tvident.simulate_torsional_rig(duration=3.0)
    start = np.datetime64("2024-01-01T10:00:00.5")
    later = start + np.timedelta64(LATE, "ms")
    common = {"wf_increment": 1e-3, "wf_start_offset": 0.0}
    with TdmsWriter("rig.tdms") as writer:
        writer.write_segment(
            [
                ChannelObject(
                    "rig", "angle", made.angle[:-LATE], {**common, "wf_start_time": start, "unit_string": "rad"}
                ),
                ChannelObject("rig", "torque", made.torque[LATE:], {**common, "wf_start_time": later, "units": "N m"}),
                ChannelObject(
                    "rig", "together", made.torque[:-LATE], {**common, "wf_start_time": start, "units": "N m"}
                ),
            ]
        )


@pytest.mark.usefixtures("rig")
def test_one_clock_for_two_is_refused() -> None:
    """A torque that began 40 ms after the angle was taken as of the same times, without a word."""
    command = ["identify", "rig.tdms", "--angle", "angle", "--torque", "torque", "--method", "weak", "--step", "100"]
    refused = run(*command, "--time", "rig.time")
    assert refused.returncode == 2
    assert "give --time rig.time --torque-time rig.time_2, or the same for both" in refused.stderr
    assert "inertia" in run(*command, "--time", "rig.time", "--torque-time", "rig.time_2").stdout
    assert "clocks of their own" in run(*command, "--sample-rate", "1000").stderr
    alike = ["together" if one == "torque" else one for one in command]
    assert "clocks of their own" not in run(*alike, "--time", "rig.time").stderr
    assert "and got none; give --time rig.time --torque-time rig.time_2" in run(*command).stderr
    compare = ("compare", "rig.tdms", "--angle", "angle", "--torque", "torque", "--time", "rig.time")
    refused = run(*compare)
    assert refused.returncode == 2
    assert "give --time rig.time --torque-time rig.time_2, or the same for both" in refused.stderr
    compared = run(*compare, "--torque-time", "rig.time_2", "--model", "none", "--model", "offset")
    assert compared.returncode == 0, compared.stderr
    assert "2 models" in compared.stdout
    refused = run(*compare, "--methods")
    assert refused.returncode == 2
    assert "methods are compared on channels of one clock; rig.tdms has rig.time and rig.time_2" in refused.stderr


def test_a_clock_is_that_of_the_group_of_the_angle(tmp_path: Path) -> None:
    """Of topics that are called angle and torque, `--time time` was asked which of two it were."""
    made = tvident.simulate_torsional_rig(duration=3.0)
    named = {"angle.time": made.time, "angle.data": made.angle, "torque.time": made.time, "torque.data": made.torque}
    np.savez(tmp_path / "rig.npz", **named)  # type: ignore[arg-type]
    command = ("identify", tmp_path / "rig.npz", "--angle", "angle.data", "--torque", "torque.data", "--time", "time")
    assert "known to" in run(*command).stdout


COMMAND = ("--angle", "a.angle", "--torque", "b.torque", "--method", "weak", "--step", "100")


@pytest.mark.parametrize("late", [0.04, 1e-3, 2e-6, 1e-12])
def test_groups_of_a_file_have_clocks(tmp_path: Path, late: float) -> None:
    """Two groups of HDF5 whose times differ by 40 ms were one clock; stamps that differ by rounding are."""
    made = tvident.simulate_torsional_rig(duration=3.0)
    with h5py.File(tmp_path / "rig.h5", "w") as file:
        for name, values in {"a/time": made.time, "a/angle": made.angle, "b/time": made.time + late}.items():
            file[name] = values
        file["b/torque"] = made.torque
    done = run("identify", tmp_path / "rig.h5", *COMMAND, "--time", "a.time")
    if late < 1e-5:
        assert "known to" in done.stdout
    else:
        assert done.returncode == 2
        assert "rig.h5 has a.time and b.time, and got --time a.time for both" in done.stderr


def test_a_recorded_channel_called_time_is_no_clock(tmp_path: Path) -> None:
    """Between angle and torque it was the torque's."""
    made = tvident.simulate_torsional_rig(duration=3.0)
    period = {"wf_increment": 1e-3}
    channels = {"angle": (made.angle, "rad"), "time": (made.time + 100, "s"), "torque": (made.torque, "N m")}
    with TdmsWriter(str(tmp_path / "rig.tdms")) as writer:
        writer.write_segment(
            [ChannelObject("rig", name, one, {**period, "unit_string": unit}) for name, (one, unit) in channels.items()]
        )
    command = ("identify", tmp_path / "rig.tdms", "--angle", "angle", "--torque", "torque", "--method", "weak")
    assert "known to" in run(*command, "--step", "100", "--time", "time").stdout


@pytest.mark.parametrize("option", ["--instrument", "--mask", "--weights", "--velocity"])
def test_what_lies_beside_the_motion_has_its_clock(tmp_path: Path, option: str) -> None:
    """A mask or an instrument that began 40 ms later was taken in without a word."""
    made = tvident.simulate_torsional_rig(duration=3.0)
    named = {"a.time": made.time, "a.angle": made.angle, "a.torque": made.torque, "a.ok": np.ones_like(made.time)}
    named |= {"b.time": made.time + 0.04, "b.ok": np.ones_like(made.time)}
    np.savez(tmp_path / "rig.npz", **named)  # type: ignore[arg-type]
    command = ("identify", tmp_path / "rig.npz", "--angle", "a.angle", "--torque", "a.torque", "--time", "a.time")
    refused = run(*command, option, "b.ok")
    assert refused.returncode == 2
    assert f"{option} must have a sample for each of the motion" in refused.stderr
    assert "rig.npz has a.time for that and b.time for b.ok" in refused.stderr
    if option in ("--mask", "--weights"):
        assert "known to" in run(*command, option, "a.ok", "--method", "weak", "--step", "100").stdout
