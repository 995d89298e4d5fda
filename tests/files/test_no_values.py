"""Words and numbers that stand where nothing was measured: read as missing, and asked for."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from commands import run
from tvident import recordings
from tvident._advice.marks import marks_that_stay

RIG = tvident.simulate_torsional_rig(duration=3.0)


def read_quietly(path: Path) -> recordings.Channels:
    """Read a file that nothing is said of."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return recordings.read(path)


@pytest.mark.parametrize("word", ["NaN", "NA", "#N/A", "-", "---", "--.--", "n.a.", "<NA>", "(null)", "nan(ind)"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_value_that_is_missing_is_no_surprise(tmp_path: Path, word: str, separator: str) -> None:
    path = tmp_path / "record.csv"
    rows = [["t [s]", "a"], ["0", word], ["0.1", "2.5"], ["0.2", word], ["0.3", "3.5"]]
    path.write_text("\n".join(separator.join(row) for row in rows) + "\n")
    np.testing.assert_array_equal(read_quietly(path)["a"], [np.nan, 2.5, np.nan, 3.5])


@pytest.mark.parametrize("word", ["1.#QNAN", "1.#QNAN0", "-1.#IND", "-1.#IND00", "1.#J", "-1.#R"])
def test_what_a_compiler_wrote_for_no_number(tmp_path: Path, word: str) -> None:
    """Zeros behind the word, or digits that were cut off, made a comment of it, and the line too short."""
    path = tmp_path / "record.csv"
    path.write_text(f"t [s],a,b\n0,1,{word}\n0.1,{word},2\n0.2,3,4\n")
    channels = read_quietly(path)
    np.testing.assert_array_equal(channels["a"], [1, np.nan, 3])
    np.testing.assert_array_equal(channels["b"], [np.nan, 2, 4])
    path.write_text("a\n1.#INF00\n2\n-1.#INF\n")
    np.testing.assert_array_equal(read_quietly(path)["a"], [np.inf, 2, -np.inf])


@pytest.mark.parametrize(
    "word", ["OVLD", "OL", "Over", "-OVER", "overflow", "out of range", "No Data", "invalid", "?", "."]
)
@pytest.mark.parametrize("first", [0, 2])
def test_a_word_of_an_instrument_is_a_missing_value(tmp_path: Path, word: str, first: int) -> None:
    """It was refused with its line, so that all cells had to be emptied by hand."""
    cells = ["1.5", "2.5", "3.5", "4.5"]
    cells[first] = cells[3] = word
    path = tmp_path / "record.csv"
    path.write_text("t [s];a\n" + "".join(f"{place};{cell}\n" for place, cell in enumerate(cells)))
    with pytest.warns(
        recordings.FileWarning, match="2 cells hold a word in place of a number, read as missing"
    ) as said:
        channels = recordings.read(path)
    assert f"line {first + 2}, column 'a'" in str(said[0].message)
    expected = [np.nan if cell == word else float(cell) for cell in cells]
    np.testing.assert_array_equal(channels["a"], expected)


def test_a_column_of_words_stays_one(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("t [s],state,a\n0,open,1\n1,shut,2\n2,open,3\n")
    with pytest.warns(recordings.FileWarning, match="'state': not read, it holds words"):
        assert list(recordings.read(path)) == ["t [s]", "a"]


@pytest.mark.parametrize("mark", [-9999, -999, 99999, -999.25, 1e20, 9.9e37, -32768, 3.4028235e38, -99])
@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_a_number_that_marks_missing_values_is_asked_for(tmp_path: Path, mark: float, ending: str) -> None:
    """-9999 was measured, without a word."""
    angle = RIG.angle.copy()
    angle[[3, 50, 51]] = mark
    path = tmp_path / f"record.{ending}"
    tvident.FileRecording({"time [s]": RIG.time, "angle [rad]": angle}).write(path)
    with pytest.warns(recordings.FileWarning, match=r"'angle \[rad\]' holds .* 3 times, far .* missing="):
        recording = tvident.read_recording(path)
    np.testing.assert_allclose(recording["angle"][3], mark, rtol=1e-7)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        recording = tvident.read_recording(path, missing=mark)
        both = recordings.read(path, missing=[mark, 1234.5])
    expected = RIG.angle.copy()
    expected[[3, 50, 51]] = np.nan
    np.testing.assert_array_equal(recording["angle"], expected)
    np.testing.assert_array_equal(both["angle [rad]"], expected)
    assert recording["angle"].unit == "rad"


@pytest.mark.parametrize(
    "values",
    [
        np.arange(9000.0, 10000.0),
        np.clip(np.linspace(-60000, 60000, 500), -32768, 32767),
        np.tile([0.0, 1.0, 99.0], 50),
        np.concatenate([np.linspace(-900, 900, 100), [-999.0]]),
        np.concatenate([np.sin(np.arange(100.0)), [-9998.0]]),
        np.full(100, -9999.0),
        np.where(np.arange(100) % 50 == 0, np.arange(100.0), -9999.0),
    ],
)
def test_what_was_measured_is_not_asked_for(tmp_path: Path, values: np.ndarray) -> None:
    path = tmp_path / "record.npz"
    np.savez(path, a=values)
    np.testing.assert_array_equal(read_quietly(path)["a"], values)


@pytest.mark.parametrize("missing", ["-9999", [None], {"a": 1}, True])
def test_marks_are_numbers(tmp_path: Path, missing: object) -> None:
    path = tmp_path / "record.npz"
    np.savez(path, a=np.arange(5.0))
    with pytest.raises(TypeError, match="missing must be a number"):
        recordings.read(path, missing=missing)  # type: ignore[arg-type]


def test_a_command_says_and_takes_marks(tmp_path: Path) -> None:
    angle = np.where(np.arange(RIG.angle.size) % 700 < 300, RIG.angle, RIG.angle)
    angle[1000:1300] = -9999
    path = tmp_path / "record.csv"
    tvident.FileRecording({"time [s]": RIG.time, "angle [rad]": angle, "torque [N m]": RIG.torque}).write(path)
    named = ("--angle", "angle", "--torque", "torque", "--time", "time")
    said = run("identify", path, *named)
    assert "read the file with --missing -9999" in said.stderr
    assert "does it mark values that are missing?" in said.stdout.replace("\n", " ")
    assert "degrees?" not in said.stdout
    marked = run("identify", path, *named, "--missing", "-9999")
    assert "-9999" not in marked.stdout + marked.stderr
    clean = tvident.identify(np.where(angle == -9999, np.nan, angle), RIG.torque, sample_rate=1000)
    assert clean.summary().splitlines()[0] == marked.stdout.splitlines()[0]
    assert "--missing" not in run("info", path, "--missing", "-9999").stderr
    refused = run("identify", path, *named, "--missing", "-9999", "--in-pieces", "-o", tmp_path / "o.npz")
    assert refused.returncode == 2
    assert "--in-pieces reads no marks" in refused.stderr


@pytest.mark.parametrize(("channel", "unit"), [("angle", "deg"), ("torque", "N mm")])
@pytest.mark.parametrize("where", [slice(0, 200), slice(1000, 1400), slice(2800, 3000)])
def test_advice_asks_for_marks_in_arrays(channel: str, unit: str, where: slice) -> None:
    """It asked whether the angle were in degrees, and whether the torque's sensor were linear."""
    channels = {"angle": RIG.angle.copy(), "torque": RIG.torque.copy()}
    factor = {"deg": np.pi / 180, "N mm": 1e-3}[unit]
    channels[channel] /= factor
    channels[channel][where] = -9999
    units: dict[str, Any] = {f"{channel}_unit": unit}
    result = tvident.identify(channels["angle"], channels["torque"], sample_rate=1000, **units)
    assert result.advice[0].startswith(f"the {channel} is -9999 at ")
    assert "missing=-9999" in result.advice[0]
    assert not any("degrees?" in one for one in result.advice)


@pytest.mark.parametrize("level", [999.0, 9999.0, 32767.0])
def test_a_torque_that_is_turned_on_and_off_is_no_mark(level: float) -> None:
    """A drive that stands at a number that programs write for nothing, again and again, was measured there."""
    number = np.arange(8000)
    noise = 1e-3 * np.random.default_rng(1).standard_normal((2, number.size))
    is_on = number // 500 % 2 == 0
    torque = np.where(is_on, level, noise[0])
    assert marks_that_stay({"torque": torque}, {"torque": 1.0}, 1e-3) == []
    for missing in (np.where(is_on, -level, noise[0]), np.where(number // 500 == 3, level, noise[0])):
        assert len(marks_that_stay({"torque": missing}, {"torque": 1.0}, 1e-3)) == 1
