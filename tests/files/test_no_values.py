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
from tvident._advice.marks import Numbers, marks_that_stay
from tvident._arguments import marks_in

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
    in_pieces = run("identify", path, *named, "--missing", "-9999", "--in-pieces", "-o", tmp_path / "o.npy")
    assert in_pieces.returncode == 0
    missing = tmp_path / "missing.csv"
    written = tvident.FileRecording({"time [s]": RIG.time, "angle [rad]": np.where(angle == -9999, np.nan, angle)})
    tvident.FileRecording({**written, "torque [N m]": RIG.torque}).write(missing)
    run("identify", missing, *named, "--in-pieces", "-o", tmp_path / "p.npy")
    first, second = (np.load(tmp_path / f"{one}.npy")["stiffness"] for one in "op")
    np.testing.assert_array_equal(first, second)


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
    assert marks_that_stay([Numbers("torque", torque)], 1e-3) == []
    both = np.select([number // 250 % 4 == 0, number // 250 % 4 == 2], [level, -level], noise[0])
    assert marks_that_stay([Numbers("torque", both)], 1e-3) == []
    one_by_one = [np.where(is_on, -level, noise[0]), np.where(number // 500 == 3, level, noise[0])]
    for missing in (*one_by_one, np.where(is_on, 1e20, noise[0])):
        assert len(marks_that_stay([Numbers("torque", missing)], 1e-3)) == 1


NOISE = np.random.default_rng(4).standard_normal(RIG.angle.size)


@pytest.mark.parametrize(
    ("marks", "found"),
    [
        ((9999.0, -9999.0), (-9999.0, 9999.0)),
        ((-999.25, 1e20), (-999.25, 1e20)),
        ((32767.0, -32768.0), (-32768.0, 32767.0)),
    ],
)
def test_marks_of_both_signs_are_asked_for(tmp_path: Path, marks: tuple[float, ...], found: tuple[float, ...]) -> None:
    """Neither was far from all others, of which the other was one."""
    values = NOISE.copy()
    values[100:110], values[300:330] = marks
    assert [one for one, _ in marks_in(values)] == list(found)
    np.savez(tmp_path / "x.npz", a=values)
    with pytest.warns(recordings.FileWarning) as said:
        recordings.read(tmp_path / "x.npz")
    assert len(said) == 2
    np.testing.assert_array_equal(np.isnan(recordings.read(tmp_path / "x.npz", missing=marks)["a"]).sum(), 40)


@pytest.mark.parametrize(
    "values",
    [
        np.tile([-32768.0, 0.0, 32767.0], 100),  # a converter of three levels
        np.where(np.arange(300) < 10, 32768.0, 33000 + 20 * NOISE[:300]),  # binary with an offset, at rest first
        np.where(np.arange(300) < 10, 65535.0, 65000 + 20 * NOISE[:300]),
        np.tile([0.0, 9999.0, 5.0], 100),
        np.where(NOISE > 2, 1000.0, NOISE),  # a limit, which was taken for 999.999
        np.where(NOISE > 2, -100_000.0, NOISE),
    ],
)
def test_levels_and_offsets_are_no_marks(values: np.ndarray) -> None:
    assert marks_in(values) == []


def test_an_encoder_that_wraps_stands_anywhere_within_a_turn() -> None:
    """Counts of an encoder are 0 to 65535, so 65535 beside 0 to 8 marks nothing where period= says that it wraps."""
    counts = (np.round(4.6 * np.sin(9 * RIG.time)) + 4) % 65536
    assert marks_that_stay([Numbers("angle", counts)], 1e-3)
    assert marks_that_stay([Numbers("angle", counts, turn=65536.0)], 1e-3) == []


@pytest.mark.parametrize("channel", ["angle", "torque"])
@pytest.mark.parametrize("pattern", ["second", "third", "tenth", "random"])
def test_marks_among_samples_are_not_trusted(channel: str, pattern: str) -> None:
    """At every second sample the stiffness was half of the true one, "known to ± 0.38 %"; at every third nothing was asked."""
    number = np.arange(RIG.angle.size)
    every = {"second": 2, "third": 3, "tenth": 10}
    where = NOISE > 1.5 if pattern == "random" else number % every[pattern] == 1
    channels = {"angle": RIG.angle.copy(), "torque": RIG.torque.copy()}
    channels[channel][where] = -9999
    result = tvident.identify(channels["angle"], channels["torque"], sample_rate=1000)
    assert result.summary().startswith("do not trust: ")
    assert any(f"the {channel} is -9999 at " in one for one in result.advice)


def test_readings_that_failed_now_and_then_are_left_out_and_not_asked_for() -> None:
    torque = np.where(NOISE > 2.6, -9999.0, RIG.torque)
    result = tvident.identify(RIG.angle, torque, sample_rate=1000)
    assert "known to" in result.summary().splitlines()[0]
    np.testing.assert_allclose(np.nanmedian(result.stiffness / RIG.stiffness), 1, atol=0.01)


@pytest.mark.parametrize("channel", ["angle", "torque"])
@pytest.mark.parametrize("where", [slice(0, 200), slice(1000, 1400)])
def test_marks_that_a_mask_leaves_out_are_missing(channel: str, where: slice) -> None:
    """A mask says where equations may be, so marks spoilt those beside it, and the noise: "explains nothing of the torque"."""
    channels = {"angle": RIG.angle.copy(), "torque": RIG.torque.copy()}
    channels[channel][where] = -9999
    mask = channels[channel] != -9999
    result = tvident.identify(channels["angle"], channels["torque"], sample_rate=1000, mask=mask)
    channels[channel][where] = np.nan
    missing = tvident.identify(channels["angle"], channels["torque"], sample_rate=1000, mask=mask)
    np.testing.assert_array_equal(result.stiffness, missing.stiffness)
    count = where.stop - where.start
    said = f"the {channel} is -9999 at {count} samples, which mask= leaves out: they are taken as missing"
    assert result.reasons[0] == said
    assert not any("-9999" in one for one in result.advice)


def test_marks_of_trials_masses_and_what_is_known_are_asked_for() -> None:
    """No word said so: trials did "not share offset"."""
    rigs = [tvident.simulate_torsional_rig(duration=1.0, seed=seed) for seed in range(12)]
    angles, torques = (np.stack([getattr(one, name) for one in rigs]) for name in ("angle", "torque"))
    torques[3, 200:400] = -9999
    result = tvident.identify(angles, torques, sample_rate=1000, ensemble_axis=0)
    assert result.advice[0].startswith("the torque of trial 3 is -9999 at 200 samples, first at 0.2 s, far from all")
    assert result.summary().startswith("do not trust: ")
    chain = tvident.Chain(2, springs=[("base", 0), (0, 1)])
    both = np.stack([RIG.angle, 0.5 * RIG.angle])
    forces = np.stack([RIG.torque, NOISE])
    both[1, 500:700] = -9999
    result = tvident.identify(both, forces, sample_rate=1000, dof_axis=0, structure=chain)
    assert any(one.startswith("the angle of channel 1 is -9999 at 200 samples") for one in result.advice)
    stiffness = RIG.stiffness.copy()
    stiffness[5] = -9999
    alone = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, stiffness=stiffness)
    assert any(one.startswith("the stiffness is -9999 at 1 sample,") for one in alone.advice)
    instrument = np.where(np.arange(RIG.angle.size) == 700, -9999.0, RIG.torque)
    alone = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, instrument=instrument)
    assert any(one.startswith("the instrument is -9999 at 1 sample,") for one in alone.advice)
