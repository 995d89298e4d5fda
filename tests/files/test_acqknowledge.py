"""Texts of AcqKnowledge (BIOPAC): period, names and units in lines of their own, and a row that says how many samples there are."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import tvident
from tvident import recordings

COUNT = 200
TIME = np.arange(COUNT) / 500
ANGLE, TORQUE = np.degrees(np.sin(30 * TIME)), np.cos(30 * TIME)


def written(unit: str | None, factor: float, between: str, count: int = COUNT, *, lengths: bool = True) -> str:
    head = "run1.acq\n2 msec/sample\n2 channels\nElbow, left\ndegrees\nTorque\nN-m\n"
    times = [] if unit is None else [unit]
    lines = [[*times, "CH1", "CH2", ""]]
    lines += [[*[""] * len(times), str(count), str(count), ""]] if lengths else []
    for t, a, m in zip(TIME, ANGLE, TORQUE, strict=True):
        lines.append([*([] if unit is None else [f"{t * factor:.9g}"]), f"{a:.8g}", f"{m:.8g}", ""])
    return head + "".join(between.join(line) + "\n" for line in lines)


@pytest.mark.parametrize("between", ["\t", ","])
@pytest.mark.parametrize(("unit", "factor"), [("min", 1 / 60), ("sec", 1.0), ("milliSec", 1e3), (None, 1.0)])
@pytest.mark.parametrize("lengths", [True, False])
def test_the_row_of_lengths_is_no_sample(
    tmp_path: Path, unit: str | None, factor: float, between: str, *, lengths: bool
) -> None:
    """It was the first sample, all others came one later, and names and units were lost without a word."""
    (tmp_path / "x.txt").write_text(written(unit, factor, between, lengths=lengths))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = tvident.read_recording(tmp_path / "x.txt")
    names = ["time", "Elbow  left" if between == "," else "Elbow, left", "Torque"]
    assert list(found) == names
    assert [found.units[name] for name in names[1:]] == ["degrees", "N-m"]
    assert found.sample_rate == pytest.approx(500)
    np.testing.assert_allclose(found["Torque"], TORQUE, atol=1e-7)
    np.testing.assert_allclose(found[names[1]], ANGLE, rtol=1e-7, atol=1e-6)


def test_samples_that_are_lost_are_said(tmp_path: Path) -> None:
    (tmp_path / "x.txt").write_text(written("sec", 1.0, "\t", COUNT + 7))
    with pytest.warns(recordings.FileWarning, match="there are 207 samples of each channel, and has 200"):
        tvident.read_recording(tmp_path / "x.txt")
    (tmp_path / "x.txt").write_text(written("sec", 1.0, "\t").replace("\tCH1", ""))
    with pytest.raises(recordings.FileError, match="must name each of 2 channels"):
        tvident.read_recording(tmp_path / "x.txt")
    (tmp_path / "x.txt").write_text("run1.acq\n2 msec/sample\n2 channels\nElbow\n")
    with pytest.raises(recordings.FileError, match="the file ends before"):
        tvident.read_recording(tmp_path / "x.txt")
    broken = written("sec", 1.0, "\t").split("\n")
    broken[20] = "0.02\tx\t1\t"
    (tmp_path / "x.txt").write_text("\n".join(broken))
    with pytest.raises(recordings.FileError, match="line 21 must hold numbers; it has 'x'"):
        tvident.read_recording(tmp_path / "x.txt")


def test_a_column_without_a_name_and_with_a_unit_of_times_is_of_times(tmp_path: Path) -> None:
    """Biodex writes so; it had no unit, and there was no channel of times."""
    rows = "".join(f"{1e3 * t:.0f}\t{m:.6f}\t{a:.6f}\n" for t, a, m in zip(TIME, ANGLE, TORQUE, strict=True))
    (tmp_path / "x.txt").write_text(f"Biodex Medical Systems\n\n\tTORQUE\tPOSITION\n mSec\tN-M\tDEGREES\n{rows}")
    found = tvident.read_recording(tmp_path / "x.txt")
    assert found.units == {"time": "mSec", "TORQUE": "N-M", "POSITION": "DEGREES"}
    assert found.sample_rate == pytest.approx(500)
