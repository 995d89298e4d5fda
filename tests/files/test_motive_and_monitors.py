"""Exports of OptiTrack's Motive, and what Arduino's monitor writes with stamps: names, units and times as they stand there."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from tvident import recordings
from tvident._units import named_unit

COUNT = 200
ANGLE, TORQUE = np.sin(np.arange(COUNT) / 9), np.cos(np.arange(COUNT) / 7)


def motive(identifiers: str, rotation: str, length: str = "Millimeters") -> str:
    head = [
        f"Format Version,1.23,Take Name,Take 1,Capture Frame Rate,1000.000000,Rotation Type,{rotation},Length Units,{length}",
        "",
        ",,Rigid Body,Rigid Body,Rigid Body,Device",
        ",,upper arm,upper arm,hand,load",
        f",,{identifiers}",
        ",,Rotation,Position,Rotation,Torque",
        "Frame,Time (Seconds),X,X,X,Mz",
    ]
    rows = [f"{place},{place / 1000:.6f},{ANGLE[place]:.9f},1.5,2.5,{TORQUE[place]:.9f}" for place in range(COUNT)]
    return "\n".join([*head, *rows, ""])


@pytest.mark.parametrize("identifiers", ["1,1,2,3", '"3A2F9","3A2F9","77B1","9C"'])
def test_bodies_of_motive_are_in_the_names(tmp_path: Path, identifiers: str) -> None:
    """Numbers of bodies were a line of numbers, and the file was refused: "line 6 must hold numbers"; names of bodies were lost."""
    path = tmp_path / "take.csv"
    path.write_text(motive(identifiers, "XYZ"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        recording = tvident.read_recording(path)
    assert recording.units == {
        "Frame": "",
        "time": "s",
        "upper arm.Rotation.X": "deg",
        "upper arm.Position.X": "mm",
        "hand.Rotation.X": "deg",
        "load.Torque.Mz": "",
    }
    assert recording.sample_rate == 1000
    np.testing.assert_allclose(recording["upper arm.Rotation.X"], ANGLE, atol=1e-9)
    np.testing.assert_allclose(recording["Mz"], TORQUE, atol=1e-9)


def test_parts_of_a_quaternion_are_no_degrees(tmp_path: Path) -> None:
    path = tmp_path / "take.csv"
    path.write_text(motive("1,1,2,3", "Quaternion", "Meters"))
    recording = tvident.read_recording(path)
    assert recording.units["hand.Rotation.X"] == ""
    assert recording.units["upper arm.Position.X"] == "m"


def test_an_export_of_motive_without_names_says_what_it_lacks(tmp_path: Path) -> None:
    path = tmp_path / "take.csv"
    path.write_text("Format Version,1.23,Take Name,Take 1\n\n1,2,3\n1,2,4\n")
    with pytest.raises(recordings.FileError, match="must have a line that begins with Frame"):
        recordings.read(path)


@pytest.mark.parametrize("between", [",", "\t", ";", " "])
@pytest.mark.parametrize("head", ["", "angle [deg]{0}torque [Nm]\n", "10:00:00.000 -> angle [deg]{0}torque [Nm]\n"])
def test_stamps_of_a_monitor_are_times(tmp_path: Path, between: str, head: str) -> None:
    """It held "no numbers"."""
    head = head.replace(" [", "_").replace("]", "") if between == " " else head
    rows = [
        f"10:00:{place // 50:02d}.{place % 50 * 20:03d} -> {ANGLE[place]:.9f}{between}{TORQUE[place]:.9f}"
        for place in range(COUNT)
    ]
    path = tmp_path / "monitor.log"
    path.write_text(head.format(between) + "\n".join(rows) + "\n")
    with pytest.warns(recordings.FileWarning, match="holds times: read as seconds of a clock"):
        recording = tvident.read_recording(path)
    assert list(recording)[1:] == (["angle", "torque"] if head else ["1", "2"])
    assert list(recording.units.values()) == (["s", "deg", "Nm"] if head else ["s", "", ""])
    times, angle, _ = recording.values()
    np.testing.assert_allclose(times - times[0], np.arange(COUNT) / 50, atol=1e-9)
    np.testing.assert_allclose(angle, ANGLE, atol=1e-9)


def test_turns_at_the_end_of_a_name_are_a_unit_and_rev_is_asked_for() -> None:
    """`angle_rev` beside `torque_inlb` was rad without a word in Python: an inertia 6.28 times too large."""
    assert named_unit("angle_turns") == ("angle", "turns")
    assert named_unit("Position revs") == ("Position", "revs")
    assert named_unit("angle_prev") == ("angle_prev", "")
    assert named_unit("angle [rev]") == ("angle", "rev")
    rig = tvident.simulate_torsional_rig(2.0)
    recording = tvident.FileRecording({"angle_rev": rig.angle / (2 * np.pi), "torque": rig.torque})
    call: Any = {"torque": recording["torque"], "sample_rate": 1000}
    with pytest.raises(
        ValueError, match="rev for revolutions, or a name that says reversed; give angle_unit='rev', or another"
    ):
        tvident.identify(recording["angle"], **call)
    found = tvident.identify(recording["angle"], **call, angle_unit="rev")
    assert found.value("inertia").value == pytest.approx(0.0123, rel=0.02)


def test_counts_of_an_encoder_are_told_what_to_multiply_by() -> None:
    rig = tvident.simulate_torsional_rig(2.0)
    for unit in ("inc", "cnt", "counts", "ticks"):
        with pytest.raises(ValueError, match="multiply counts of an encoder by 2π over those of a turn"):
            tvident.identify(tvident.Channel(rig.angle, unit), rig.torque, sample_rate=1000)
