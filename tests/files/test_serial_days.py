"""Columns of days, as datenum of MATLAB and spreadsheets count them: recognised, said, and read as times."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

import tvident
from tvident import recordings

COUNT = 2000
ANGLE, TORQUE = np.sin(np.arange(COUNT) / 9), np.cos(np.arange(COUNT) / 7)
SAID = "counts days, as datenum of MATLAB and spreadsheets do: its unit is taken to be days"


def _written(path: Path, head: str, times: list[str]) -> Path:
    rows = (f"{time},{one:.6f},{other:.6f}" for time, one, other in zip(times, ANGLE, TORQUE, strict=True))
    path.write_text(f"{head},angle,torque\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("name", ["Time", "t", "Date", "DateTime", "datenum", "Datum", "Date/Time"])
@pytest.mark.parametrize("first", [738000.5, 45300.25])
@pytest.mark.parametrize("rate", [5, 250])
def test_days_are_times(tmp_path: Path, name: str, first: float, rate: int) -> None:
    """At 5 Hz they were seconds at 432 kHz without a word; a column called Date held no times."""
    days = first + np.arange(COUNT) / rate / 86_400
    path = _written(tmp_path / "x.csv", name, [f"{day:.16g}" for day in days])
    with pytest.warns(recordings.FileWarning, match=f"'{name}' {SAID}"):
        recording = tvident.read_recording(path)
    assert recording.sample_rate == pytest.approx(rate)
    assert recording.units[name] == "days"


def test_days_of_a_structure_are_times(tmp_path: Path) -> None:
    days = 738000.5 + np.arange(COUNT) / 1000 / 86_400
    savemat(tmp_path / "x.mat", {"run": {"Date": days, "angle": ANGLE}})
    with pytest.warns(recordings.FileWarning, match=SAID):
        assert tvident.read_recording(tmp_path / "x.mat").sample_rate == pytest.approx(1000)


def test_a_time_of_the_day_beside_its_date_is_part_of_a_day(tmp_path: Path) -> None:
    """It was seconds at 864 kHz without a word."""
    parts = [f"45300,{0.25 + number / 10 / 86_400:.12f}" for number in range(COUNT)]
    path = _written(tmp_path / "x.csv", "Date,Time", parts)
    with pytest.warns(recordings.FileWarning, match=f"'Time' {SAID}"):
        assert tvident.read_recording(path).sample_rate == pytest.approx(10)


@pytest.mark.parametrize(
    ("name", "first", "rate"),
    [
        ("Time", 45300.0, 1000.0),  # seconds of the day
        ("uptime", 45300.0, 96e3),
        ("time [s]", 45300.0, 86_400.0),
        ("position", 45300.0, 86_400.0),
        ("Date", 1.0, 1000.0),
        ("Time", 0.0, 192e3),
    ],
)
def test_what_counts_no_days_stays(tmp_path: Path, name: str, first: float, rate: float) -> None:
    channels: dict[str, Any] = {name: first + np.arange(COUNT) / rate, "angle": ANGLE}
    np.savez(tmp_path / "x.npz", **channels)
    with warnings.catch_warnings():
        warnings.simplefilter("error", recordings.FileWarning)
        recording = tvident.read_recording(tmp_path / "x.npz")
    assert "days" not in recording.units.values()
    if name in {"Time", "uptime", "time [s]"}:
        assert recording.sample_rate == pytest.approx(rate)


def test_steps_of_days_are_asked_about_where_times_are_taken() -> None:
    """An array of times has no file that tells more: 10 Hz were 864 kHz, and inertia 7e9 times too small."""
    rig = tvident.simulate_torsional_rig(duration=3.0)
    result = tvident.identify(rig.angle, rig.torque, t=45300.25 + np.arange(rig.angle.size) / 10 / 86_400)
    assert "is the time in days? Then give time_unit='days'" in result.summary()
