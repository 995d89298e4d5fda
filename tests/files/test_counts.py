"""Numbers of samples under a name that says microseconds: they were times of a recording at 1 MHz, without a word."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import tvident
from tvident import recordings
from tvident._command_line import main


def written(folder: Path, header: str, times: np.ndarray[tuple[int], np.dtype[np.int64]]) -> str:
    rig = tvident.simulate_torsional_rig(duration=2.0)
    rows = zip(times.tolist(), rig.angle.tolist(), rig.torque.tolist(), strict=True)
    (folder / "x.csv").write_text(f"{header},angle,torque\n" + "".join(f"{t},{a!r},{m!r}\n" for t, a, m in rows))
    return str(folder / "x.csv")


@pytest.mark.parametrize(("header", "rate"), [("t [us]", "1e\\+06"), ("time_ns", "1e\\+09"), ("Time (µs)", "1e\\+06")])
def test_whole_numbers_that_go_up_by_one_are_asked_for(tmp_path: Path, header: str, rate: str) -> None:
    """Inertia was a millionth of what it is."""
    with pytest.warns(
        recordings.FileWarning, match=f"goes up by one from sample to sample, which is read as {rate} Hz"
    ):
        tvident.read_recording(written(tmp_path, header, np.arange(2000)))
    told = CliRunner().invoke(
        main, ["identify", str(tmp_path / "x.csv"), "--angle", "angle", "--torque", "torque", "--time", "0"]
    )
    assert "if it counts samples, give --sample-rate in place of its times" in told.stderr


@pytest.mark.parametrize(("header", "step"), [("t [us]", 1000), ("t [ms]", 1), ("t [us]", 2), ("sample", 1)])
def test_other_times_are_not(tmp_path: Path, header: str, step: int) -> None:
    place = written(tmp_path, header, step * np.arange(2000))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tvident.read_recording(place)


def test_series_that_are_called_so_are_asked_for_their_unit() -> None:
    rig = tvident.simulate_torsional_rig(duration=2.0)
    counts = pd.Series(np.arange(rig.time.size), name="t [us]")
    with pytest.raises(ValueError, match="the time must say its unit where its name says 'us'"):
        tvident.identify(rig.angle, rig.torque, t=counts)
    result = tvident.identify(rig.angle, rig.torque, t=1000 * counts)
    assert result.value("inertia").value == pytest.approx(0.0123, rel=0.02)
    assert tvident.identify(rig.angle, rig.torque, t=counts, time_unit="ms").value("inertia") == result.value("inertia")
