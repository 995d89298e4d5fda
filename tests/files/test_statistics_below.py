"""Statistics below the samples of a text that no word tells from samples: spreadsheets' means, deviations and extremes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from click.testing import CliRunner

import tvident
from tvident import recordings
from tvident._command_line import main

RIG = tvident.simulate_torsional_rig(duration=4.0, sample_rate=500.0)
COLUMNS = np.stack([RIG.time, np.degrees(RIG.angle), RIG.torque], axis=1)


def _text(rows: npt.NDArray[Any], *, digits: int = 5, separator: str = ",", comma: bool = False) -> list[str]:
    lines = [separator.join(f"{one:.{digits}f}" for one in row) for row in rows]
    return [line.replace(".", ",") for line in lines] if comma else lines


@pytest.mark.parametrize(
    ("functions", "names"),
    [
        ([np.mean], "the last row holds the mean"),
        ([np.mean, np.std], "the last 2 rows hold the mean, standard deviation"),
        (
            [np.min, np.max, np.mean, np.median, lambda rows, axis: np.std(rows, axis, ddof=1), np.sum],
            "the last 6 rows hold the least, greatest, mean, median, standard deviation, sum",
        ),
    ],
)
@pytest.mark.parametrize("blank", ["", "\n"], ids=["below", "apart"])
@pytest.mark.parametrize("style", [{}, {"separator": ";", "comma": True}, {"digits": 12}], ids=str)
def test_rows_of_statistics_are_no_samples(
    tmp_path: Path, functions: list[Any], names: str, blank: str, style: dict[str, Any]
) -> None:
    """Each was counted, by ``tvident info`` and wherever times are not looked at."""
    rows = np.round(COLUMNS, 5)
    below = np.array([function(rows, axis=0) for function in functions])
    names_line = style.get("separator", ",").join(("time [s]", "angle [deg]", "torque [N m]"))
    lines = [names_line, *_text(rows, **style), *([""] if blank else []), *_text(below, **style)]
    path = tmp_path / "run.csv"
    path.write_text("\n".join(lines) + "\n")
    with pytest.warns(recordings.FileWarning, match=f"{names} of the rows above: not read"):
        recording = tvident.read_recording(path)
    np.testing.assert_allclose(recording["angle"], rows[:, 1], rtol=1e-12)
    assert recording.sample_rate == pytest.approx(500.0)
    done = CliRunner().invoke(main, ["info", str(path), "--json"])
    assert {one["samples"] for one in json.loads(done.stdout)["channels"]} == {len(rows)}


def test_means_below_an_empty_cell_of_the_times_are_none_either(tmp_path: Path) -> None:
    rows = np.round(COLUMNS, 5)
    path = tmp_path / "run.csv"
    mean = ",".join(("", *_text(rows[:, 1:].mean(axis=0)[None])))
    path.write_text("\n".join(["time [s],angle [deg],torque [N m]", *_text(rows), mean]))
    with pytest.warns(recordings.FileWarning, match="the last row holds the mean"):
        assert recordings.read(path)["angle [deg]"].size == len(rows)
    # Without times nothing tells such a row from a sample.
    path.write_text("\n".join(["angle [deg],torque [N m]", *_text(rows[:, 1:]), mean[1:]]))
    assert recordings.read(path)["angle [deg]"].size == len(rows) + 1


@pytest.mark.parametrize("functions", [[np.mean, np.std], [np.min, np.max, np.mean, np.std]], ids=["two", "four"])
def test_several_rows_of_statistics_need_no_times(tmp_path: Path, functions: list[Any]) -> None:
    """Nothing but times told them, and each was a sample."""
    rows = np.round(COLUMNS[:, 1:], 5)
    path = tmp_path / "run.csv"
    below = np.array([function(rows, axis=0) for function in functions])
    path.write_text("\n".join(["angle [deg],torque [N m]", *_text(rows), *_text(below)]))
    with pytest.warns(recordings.FileWarning, match=f"the last {len(functions)} rows hold the"):
        assert recordings.read(path)["angle [deg]"].size == len(rows)
    # The same one twice is what a machine at rest has.
    path.write_text("\n".join(["angle [deg],torque [N m]", *_text(rows), *_text(below[:1]), *_text(below[:1])]))
    assert recordings.read(path)["angle [deg]"].size == len(rows) + 2


def _slow_ramp() -> npt.NDArray[Any]:
    steps = np.minimum(np.arange(400) // 3, 132)
    return np.stack([steps * 1.0, steps * 2.0], axis=1)


def _rests_at_its_mean() -> npt.NDArray[Any]:
    rise = np.sin(np.arange(300) * 2 * np.pi / 100)[:, None] * [1.0, 2.0]
    return np.concatenate([rise, np.zeros((100, 2))])


def _ends_at_its_mean() -> npt.NDArray[Any]:
    """Zeros are written with any digits, and two sines that end there have both means."""
    turns = np.arange(1, 1001) * 2 * np.pi / 100
    return np.round(np.stack([30 * np.sin(turns), 150 * np.sin(2 * turns)], axis=1), 2) + 0.0


def _random(seed: int, digits: int) -> npt.NDArray[Any]:
    return np.round(np.random.default_rng(seed).normal(size=(400, 2)), digits)


@pytest.mark.parametrize(
    "rows",
    [
        _slow_ramp(),
        _rests_at_its_mean(),
        _ends_at_its_mean(),
        np.zeros((50, 3)),
        np.ones((50, 2)),
        *(_random(seed, 0) for seed in range(20)),
    ],
    ids=str,
)
def test_samples_stay(tmp_path: Path, rows: npt.NDArray[Any]) -> None:
    """The last ones may be the greatest, or near the mean, by chance."""
    path = tmp_path / "run.csv"
    path.write_text("\n".join(["angle,torque", *_text(rows[:, :2], digits=3)]))
    assert recordings.read(path)["angle"].size == len(rows)


def test_texts_of_few_digits_lose_no_sample_by_chance(tmp_path: Path) -> None:
    """Of 2000 records of small whole numbers, one in a few hundred ends where both means round to."""
    rng, lost = np.random.default_rng(7), 0
    path = tmp_path / "run.csv"
    for _ in range(300):
        rows = np.round(rng.normal(scale=3, size=(200, 2)))
        path.write_text("\n".join(["angle,torque", *_text(rows, digits=0)]))
        lost += recordings.read(path)["angle"].size < len(rows)
    assert lost == 0
