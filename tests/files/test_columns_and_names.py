"""Names above columns in odd places: above one column alone, beside empty columns, numbers of columns, a comma for two things."""

from __future__ import annotations

import warnings
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

import tvident
from tvident import recordings


def written(folder: Path, text: str) -> Path:
    """Write a text as a recorder does."""
    path = folder / "record.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("line", "name", "unit"),
    [
        ("angle [deg]", "angle", "deg"),
        ("Crank angle (deg)", "Crank angle", "deg"),
        ('"Drehmoment [N m]"', "Drehmoment", "N m"),
        ("Torque N m", "Torque", "N m"),
        ("level [tics]", "level", "tics"),
    ],
)
def test_words_above_a_single_column_are_its_name(tmp_path: Path, line: str, name: str, unit: str) -> None:
    """The name was lost where it has a blank, and with it the unit."""
    path = written(tmp_path, f"{line}\n1.5\n2.5\n3.5\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        recording = tvident.read_recording(path)
    assert list(recording) == [name]
    assert recording[name].unit == unit
    np.testing.assert_array_equal(recording[name], [1.5, 2.5, 3.5])


def test_a_title_above_a_single_column_is_no_name(tmp_path: Path) -> None:
    path = written(tmp_path, "recorded on Monday\n1.5\n2.5\n")
    for title in ("recorded on Monday", "a test of the rig (second one)"):
        path.write_text(f"{title}\n1.5\n2.5\n")
        with pytest.warns(recordings.FileWarning, match="line 1 is not read as names"):
            assert list(recordings.read(path)) == ["0"]
    with pytest.warns(recordings.FileWarning, match="line 1 is not read as names"):
        assert list(recordings.read(path)) == ["0"]


@pytest.mark.parametrize("before", ["\t", "\t\t"])
def test_columns_without_a_name_that_hold_nothing_are_none(tmp_path: Path, before: str) -> None:
    """They were channels called 0, 1 and 3 without a number."""
    rows = ["t [s]\t\ta", "0.1\t\t2", "0.2\t\t3"]
    path = written(tmp_path, "".join(f"{before}{row}\n" for row in rows))
    assert list(recordings.read(path)) == ["t [s]", "a"]
    path = written(tmp_path, "t [s]\t\ta\n0.1\t7\t2\n0.2\t\t3\n")
    assert list(recordings.read(path)) == ["t [s]", "1", "a"]


@pytest.mark.parametrize("first", [0, 1])
def test_numbers_of_columns_are_no_sample(tmp_path: Path, first: int) -> None:
    """They were the first sample of every channel."""
    numbers = [str(first + one) for one in range(3)]
    path = written(tmp_path, ",".join(numbers) + "\n0.5,1.5,2.5\n0.6,1.6,2.6\n")
    with pytest.warns(recordings.FileWarning, match="line 1 is read as names of columns"):
        channels = recordings.read(path)
    assert list(channels) == numbers
    assert [values.size for values in channels.values()] == [2, 2, 2]
    # Whole numbers below may as well go on with these.
    path = written(tmp_path, ";".join(numbers) + "\n3;4;5\n6;7;8\n")
    assert next(iter(recordings.read(path).values())).size == 3


SAMPLES = "".join(f"{k / 100},{1.5 + k / 8},{2.5 - k / 16}\n" for k in range(1, 30))


@pytest.mark.parametrize(
    "above",
    [
        "time,angle,torque\n",
        "time,angle,torque\ns,rad,Nm\n",
        "# time,angle,torque\n",
        "Rig 7\n\ntime,angle,torque\n",
        "",
    ],
)
@pytest.mark.parametrize("first", [0, 1])
def test_a_first_sample_that_counts_is_a_sample(tmp_path: Path, above: str, first: int) -> None:
    """Below names it was refused as a line of words, and without names the sample at 0 s was lost."""
    below = SAMPLES if first == 0 else "".join(f"{line.replace('0.', '1.', 1)}\n" for line in SAMPLES.split())
    channels = recordings.read(written(tmp_path, above + f"{first},{first + 1},{first + 2}\n" + below))
    values = [one.tolist() for one in channels.values()]
    assert [len(one) for one in values] == [30, 30, 30]
    assert [one[0] for one in values] == [first, first + 1, first + 2]


@pytest.mark.parametrize("text", ["t,a,b\n0,1,1,5,2,5\n0,2,1,6,2,6\n", "t,a\n1,2,5\n2,2,6\n", "a\n1,5\n2,5\n"])
def test_a_comma_for_two_things_is_asked_for(tmp_path: Path, text: str) -> None:
    """It said that a name was missing for every other column."""
    with pytest.raises(recordings.FileError, match="where a comma is the decimal sign and separates cells, too"):
        recordings.read(written(tmp_path, text))


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_notes_beside_a_table_cost_no_row_and_no_name(tmp_path: Path, separator: str) -> None:
    """Blanks were taken for what separates cells, since empty cells are none then: names, units and two samples were lost."""
    rows = [["t [s]", "angle [deg]", "", "mean"]]
    notes = ["0.12", "std", "0.3"]
    rows += [[f"{place / 10}", f"{place / 4}", "", notes[place] if place < len(notes) else ""] for place in range(30)]
    path = written(tmp_path, "".join(separator.join(row) + "\n" for row in rows))
    with pytest.warns(recordings.FileWarning, match="column 'mean': not read, it holds words"):
        channels = recordings.read(path)
    assert list(channels) == ["t [s]", "angle [deg]"]
    np.testing.assert_array_equal(channels["angle [deg]"], np.arange(30) / 4)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("odd", ["2.5", "inf", "OVLD", "#DIV/0!"])
def test_a_row_of_separators_is_a_row(tmp_path: Path, separator: str, odd: str) -> None:
    """Where another cell was odd, so that rows were read one by one, a row of tabs was left out and all after it came earlier."""
    rows = [["a", "b"], ["0.5", "1.5"], ["", ""], ["1.5", odd], ["2.5", "3.5"]]
    path = written(tmp_path, "".join(separator.join(row) + "\n" for row in rows))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", recordings.FileWarning)
        np.testing.assert_array_equal(recordings.read(path)["a"], [0.5, np.nan, 1.5, 2.5])


@pytest.mark.parametrize("odd", ["1.5", "inf"])
@pytest.mark.parametrize("end", ["\n", ""])
@pytest.mark.parametrize("tabs", ["\t", " \t", "\t "])
@pytest.mark.parametrize("place", [1, 3, 5])
def test_fewer_tabs_than_columns_are_no_row(tmp_path: Path, place: int, tabs: str, end: str, odd: str) -> None:
    """Such a line was refused for its number of cells; as the last one it must not cost the row above it."""
    lines = ["t\ta\tb", *(f"{row}\t{row / 2}\t{odd}" for row in range(4))]
    lines.insert(place, tabs)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", recordings.FileWarning)
        np.testing.assert_array_equal(recordings.read(written(tmp_path, "\n".join(lines) + end))["t"], range(4))


@pytest.mark.parametrize(
    "name", ["unix_time", "Elapsed Time", "Running time", "rel. time", "Messzeit", "time_unix", "abs time"]
)
def test_a_clock_may_say_whose_it_is(name: str) -> None:
    clock = 1.7e9 + np.arange(200) / 50
    recording = tvident.FileRecording({name: clock, "a": np.sin(clock)})
    assert recording.sample_rate == pytest.approx(50)
    both = tvident.FileRecording({name: clock, "time": np.arange(200) / 50, "a": np.sin(clock)})
    assert both.time is not None
    assert both.time[0] == 0


@pytest.mark.parametrize("name", ["rise time", "time constant", "lifetime", "dead_time", "sometimes"])
def test_other_times_are_no_clocks(name: str) -> None:
    with pytest.raises(ValueError, match="needs a channel of times"):
        _ = tvident.FileRecording({name: np.arange(200) / 50, "a": np.ones(200)}).sample_rate


@pytest.mark.parametrize("padded", [True, False])
@pytest.mark.parametrize("day", ["", "2024-05-06 "])
def test_milliseconds_behind_a_colon_are_counted(tmp_path: Path, padded: bool, day: str) -> None:
    """Without zeros before them 5 and 50 ms were both half a second."""
    counts = range(0, 3000, 5)
    cells = [f"{day}12:30:{15 + one // 1000}:{one % 1000:{'03d' if padded else 'd'}}" for one in counts]
    path = written(tmp_path, "time,a\n" + "".join(f"{cell},{place}.5\n" for place, cell in enumerate(cells)))
    with pytest.warns(recordings.FileWarning, match="holds times: read as seconds"):
        time = recordings.read(path)["time [s]"]
    np.testing.assert_allclose(time - time[0], np.arange(0, 3, 0.005), atol=1e-9)


@pytest.mark.parametrize(("rate", "digits"), [(50, "02d"), (25, "d"), (10, "d"), (100, "d")])
def test_few_digits_behind_a_third_colon_may_be_frames(tmp_path: Path, rate: int, digits: str) -> None:
    """Frames without zeros before them and tenths were milliseconds, without a word."""
    cells = [f"00:00:{one // rate:02d}:{one % rate:{digits}}" for one in range(200)]
    path = written(tmp_path, "time,a\n" + "".join(f"{cell},{place}.5\n" for place, cell in enumerate(cells)))
    with pytest.raises(recordings.FileError, match="may be tenths or hundredths of a second or frames"):
        recordings.read(path)


def test_dates_with_points_for_colons_are_times(tmp_path: Path) -> None:
    """A text with such a column beside others was said to hold no numbers."""
    rows = "".join(f"{1000 * one},2024-05-06T16.08.{one:02d}.250,{one}.5\n" for one in range(30))
    path = written(tmp_path, f"epoch (ms),timestamp (+0200),angle (deg)\n{rows}")
    with pytest.warns(recordings.FileWarning, match="holds times: read as seconds since"):
        channels = recordings.read(path)
    np.testing.assert_array_equal(list(channels.values())[1], np.arange(30.0))
    np.testing.assert_array_equal(channels["angle (deg)"], np.arange(30) + 0.5)


def test_a_clock_says_what_is_wrong_with_its_unit() -> None:
    """Microseconds in steps of 1e-8 were said to be days, and of `MS` nothing was said."""
    angle = np.ones(200)
    with pytest.raises(ValueError, match="check whether the channel is in µs"):
        _ = tvident.FileRecording({"t [µs]": 1e-8 * np.arange(200), "a": angle}).sample_rate
    with pytest.raises(
        ValueError, match=r"'MS' of 'time' is no unit of time, or may mean several: call it 'time \[ms\]'"
    ):
        _ = tvident.FileRecording({"time [MS]": np.arange(200.0), "a": angle}).sample_rate


@pytest.mark.parametrize(
    ("name", "step", "cure"),
    [("time [MS]", 1.0, "time_unit='ms', say: 'MS' is no"), ("time_days", 1e-3 / 86_400, "days \\(1000 Hz\\)")],
)
def test_labels_in_an_odd_unit_are_told_with_their_cure(name: str, step: float, cure: str) -> None:
    """They were in seconds or milliseconds."""
    rig = tvident.simulate_torsional_rig(duration=1.0)
    index = pd.Index(step * (0.5 + np.arange(rig.angle.size)), name=name)
    with pytest.raises(TypeError, match=f"give t=angle.index and .*{cure}"):
        tvident.identify(pd.Series(rig.angle, index=index), rig.torque)


@pytest.mark.parametrize("name", ["d.mat", "d.npz", "d.h5"])
def test_what_is_empty_beside_channels_is_said(tmp_path: Path, name: str) -> None:
    """A `torque = []` of MATLAB was gone without a word; among settings it is nothing."""
    samples, path = np.arange(100.0), tmp_path / name
    if name == "d.mat":
        nothing = np.zeros((0, 0))
        savemat(path, {"angle": samples, "torque": nothing, "settings": {"gain": nothing, "n": 3.0}})
    elif name == "d.npz":
        np.savez(path, angle=samples, torque=samples[:0])
    else:
        with h5py.File(path, "w") as file:
            file["angle"], file["torque"] = samples, samples[:0]
    with pytest.warns(recordings.FileWarning, match=r"without samples: 'torque'$"):
        found = tvident.read_recording(path)
    assert "torque" not in found


@pytest.mark.parametrize(("late", "rate"), [(0.0005, None), (1e-6, 500), (0.0, 500)])
def test_clocks_of_one_name_that_differ_are_two(tmp_path: Path, late: float, rate: float | None) -> None:
    """The first was the clock of all: a torque that was sampled a quarter of a step later was not said to be."""
    lines = [f"{k / 500:.7f};{k % 7};{k / 500 + late:.7f};{k % 5}\n" for k in range(100)]
    (tmp_path / "x.csv").write_text("t1 [s];angle [rad];t2 [s];torque [Nm]\n" + "".join(lines))
    found = tvident.read_recording(tmp_path / "x.csv")
    if rate is not None:
        assert found.sample_rate == pytest.approx(rate)
        return
    assert found.time is None
    with pytest.raises(
        ValueError, match=r"has several: t1, t2; give the clocks of angle and torque, such as t=\(recording\['t1'\]"
    ):
        _ = found.sample_rate


@pytest.mark.parametrize(
    ("head", "names"),
    [
        ("path;angle;torque;\nunit;deg;Nmm;\ntime;;;\n", ["time", "angle [deg]", "torque [Nmm]"]),
        ("path;angle;torque;\nunit;deg;Nmm;\ntime [ms];;;\n", ["time [ms]", "angle [deg]", "torque [Nmm]"]),
        ("time;;;\n;angle;torque;\n", ["time", "angle", "torque"]),
        ("Measurement 1;;\nTime;;\n;angle [deg];torque [Nmm];\n", ["Time", "angle [deg]", "torque [Nmm]"]),
        ("time;;;\ntime;angle;torque;\n", ["time", "angle", "torque"]),
    ],
)
def test_times_that_are_named_in_a_line_of_their_own_keep_their_name(
    tmp_path: Path, head: str, names: list[str]
) -> None:
    """They were called `path` or `0`, and no channel told the times."""
    path = written(tmp_path, head + "".join(f"{place / 1000:.3f};{place};{-place}.5;\n" for place in range(50)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = recordings.read(path)
    assert list(found) == names
    np.testing.assert_array_equal(found[names[0]], np.arange(50) / 1000)


def test_names_with_units_are_not_lost_to_words_below_them(tmp_path: Path) -> None:
    """Channels were called `raw` and `filtered`, without units."""
    text = "Time [s],Angle [deg],Torque [Nm]\n,raw,filtered\n0,1,2\n1,2,3\n"
    with pytest.warns(recordings.FileWarning, match="line 2 is not read as names: they are in line 1"):
        assert list(recordings.read(written(tmp_path, text))) == ["Time [s]", "Angle [deg]", "Torque [Nm]"]
