"""Exports of Vicon's Nexus: the rate in the second line, devices above names, units below, several tables in one file."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import tvident
from tvident import recordings

COUNT = 300
ANGLE, MOMENT = np.sin(np.arange(COUNT) / 9), np.cos(np.arange(COUNT) / 7)
PLACES = range(COUNT)


def devices(rate: str = "1000", kept: range | list[int] = PLACES, end: str = "\r\n") -> str:
    """Write what Nexus does of an encoder and a torque cell, ten samples a frame, from frame 21 on."""
    head = ["Devices", rate, ",,Encoder - Angle,Torque Cell - Torque,", "Frame,Sub Frame,Angle,Mz,", ",,deg,N.mm,"]
    rows = [f"{place // 10 + 21},{place % 10},{ANGLE[place]:.9f},{MOMENT[place]:.9f}," for place in kept]
    return end.join([*head, *rows, ""])


@pytest.mark.parametrize("end", ["\r\n", "\n"])
def test_the_rate_of_the_second_line_makes_times(tmp_path: Path, end: str) -> None:
    """No channel told the times, and the rate was lost."""
    path = tmp_path / "trial.csv"
    path.write_text(devices(end=end), newline="")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        recording = tvident.read_recording(path)
    assert recording.sample_rate == 1000
    units = {"Encoder - Angle.Angle": "deg", "Torque Cell - Torque.Mz": "N.mm"}
    assert recording.units == {"time": "s", "Frame": "", "Sub Frame": "", **units}
    np.testing.assert_allclose(recording["Angle"], ANGLE, atol=1e-9)
    np.testing.assert_allclose(recording["Mz"], MOMENT, atol=1e-9)
    np.testing.assert_allclose(recording["time"], np.arange(COUNT) / 1000, atol=1e-12)


def test_frames_that_are_lost_are_seen_in_the_times(tmp_path: Path) -> None:
    kept = [place for place in PLACES if not 100 <= place < 120]
    path = tmp_path / "trial.csv"
    path.write_text(devices(kept=kept))
    with pytest.warns(recordings.FileWarning, match="frames do not follow each other, first before frame 33"):
        time = tvident.read_recording(path).time
    assert time is not None
    np.testing.assert_allclose(time, np.array(kept) / 1000, atol=1e-12)


def test_a_first_frame_that_is_missing_leaves_the_times_of_the_others(tmp_path: Path) -> None:
    """All times were missing."""
    text = devices().replace("21,0,", ",,", 1)
    path = tmp_path / "trial.csv"
    path.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        time = tvident.read_recording(path).time
    assert time is not None
    np.testing.assert_allclose(time[1:], np.arange(1, COUNT) / 1000, atol=1e-12)


def test_the_first_of_several_tables_is_read_and_the_others_are_named(tmp_path: Path) -> None:
    """It was refused: "every line must have 4 cells; line 308 has 1: '100'"."""
    events = "Events\n100\nSubject,Context,Name,Time (s),Description\nS1,Left,Foot Strike,1.2,words\n\n"
    markers = "\nTrajectories\n100\n,,LASI,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n21,0,1.5,2.5,3.5\n22,0,1.5,2.5,3.5\n"
    path = tmp_path / "trial.csv"
    path.write_text(events + devices(end="\n") + markers)
    with pytest.warns(
        recordings.FileWarning, match="'Devices' is read; not read: Events at 100 Hz, Trajectories at 100 Hz"
    ):
        recording = tvident.read_recording(path)
    assert recording.sample_rate == 1000
    assert recording["Angle"].size == COUNT


def test_markers_have_the_names_above_their_coordinates(tmp_path: Path) -> None:
    head = "Model Outputs\n100\n,,S1:RKneeAngles,,,S1:RKneeMoment,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n,,deg,deg,deg,N.mm,N.mm,N.mm\n"
    path = tmp_path / "trial.csv"
    path.write_text(head + "".join(f"{place + 1},0,{ANGLE[place]},0,0,{MOMENT[place]},0,0\n" for place in PLACES))
    recording = tvident.read_recording(path)
    assert recording.sample_rate == 100
    assert recording["S1:RKneeMoment.X"].unit == "N.mm"
    np.testing.assert_allclose(recording["S1:RKneeAngles.X"], ANGLE)


def test_events_alone_are_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "trial.csv"
    path.write_text("Events\n100\nSubject,Context,Name,Time (s),Description\nS1,Left,Foot Strike,1.2,words\n")
    with pytest.raises(recordings.FileError, match="it holds events alone, and no samples"):
        tvident.read_recording(path)
