"""A recording by channel name, with units, from file to result."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest
from click.testing import CliRunner

import tvident
from tvident import recordings
from tvident._command_line import main

T = np.arange(500) / 250


def written(path: Path, header: str, *columns: npt.NDArray[np.float64]) -> Path:
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.12g")
    return path


def test_channels_have_names_and_units(tmp_path: Path) -> None:
    path = written(tmp_path / "x.csv", "t/ms,Angle [deg],Angle [rad],M (N mm)", 1e3 * T, T, T**2, T**3)
    recording = tvident.read_recording(path)
    assert list(recording) == ["t", "Angle [deg]", "Angle [rad]", "M"]
    assert recording.units == {"t": "ms", "Angle [deg]": "deg", "Angle [rad]": "rad", "M": "N mm"}
    assert recording["M (N mm)"] is recording["M"] is recording["3"]
    assert recording.sample_rate == 250
    assert recording.time is not None
    np.testing.assert_allclose(recording.time, T, atol=1e-9)
    assert repr(recording) == "<FileRecording of 500 samples at 250 Hz: t [ms], Angle [deg], Angle [rad], M [N mm]>"
    with pytest.raises(KeyError, match=r"x\.csv must have one channel 'Angle'"):
        recording["Angle"]
    part = recording.select(0.5, 1.0)
    np.testing.assert_array_equal(part["M"], recording["M"][125:250])
    assert part.units == recording.units
    with pytest.raises(ValueError, match=r"none of x\.csv lies from 3 to 4 s"):
        recording.select(3, 4)
    for name in ("again.csv", "again.npz"):
        part.write(tmp_path / name)
        again = tvident.read_recording(tmp_path / name)
        assert again.units == part.units
        np.testing.assert_array_equal(again["M"], part["M"])


def test_a_sample_rate_is_what_the_file_says_or_an_error(tmp_path: Path) -> None:
    np.savez(tmp_path / "x.npz", angle=T, fs=250.0)
    recording = tvident.read_recording(tmp_path / "x.npz")
    assert recording.sample_rate == 250
    assert recording.select(0.5, 1)["angle"].size == 125
    with pytest.raises(ValueError, match=r"columns of a table must have one length; got angle \(500,\), fs \(\)"):
        recording.write(tmp_path / "x.csv")
    assert not (tmp_path / "x.csv").exists()
    with pytest.raises(ValueError, match="needs a channel of times; the recording has angle; give sample_rate="):
        _ = tvident.FileRecording({"angle": T}).sample_rate
    with pytest.raises(ValueError, match="uniform to a thousandth"):
        _ = tvident.FileRecording({"t": T**2, "angle": T}).sample_rate


@pytest.mark.parametrize(
    ("name", "value", "rate"),
    [
        ("fs [kHz]", 0.25, 250),
        ("Ts", 0.004, 250),
        ("dt [ms]", 4.0, 250),
        ("rig.sample_rate", 250.0, 250),
        ("daq.t", T, 250),
    ],
)
def test_what_says_the_rate_has_a_unit_and_may_be_a_period(name: str, value: float, rate: float) -> None:
    assert tvident.FileRecording({name: value, "angle": T}).sample_rate == pytest.approx(rate, rel=1e-12)


def test_the_only_channel_of_seconds_that_increases_is_the_time(tmp_path: Path) -> None:
    """Whatever it is called: stamps of an index of pandas, a clock of a recorder."""
    path = written(tmp_path / "x.csv", "Pruefzeit [ms],lag [s],angle [deg]", 1000 * T, 0 * T, T**2)
    recording = tvident.read_recording(path)
    assert recording.sample_rate == 250
    assert recording.time is not None
    np.testing.assert_allclose(recording.time, T, rtol=1e-12)
    two = tvident.FileRecording({"a.time [s]": T, "b.time [s]": T + 1, "angle": T})
    assert two.time is None
    cure = r"t=\(recording\['a\.time'\], recording\['b\.time'\]\), or give sample_rate="
    with pytest.raises(ValueError, match=rf"has several: a\.time, b\.time; .*{cure}"):
        _ = two.sample_rate


def test_names_that_matlab_does_not_allow_are_said(tmp_path: Path) -> None:
    pytest.importorskip("scipy")
    with pytest.warns(
        UserWarning,
        match="variables of MATLAB have letters, digits and _ in their names: rig.angle is called rig_angle",
    ):
        tvident.FileRecording({"rig.angle [deg]": T}).write(tmp_path / "x.mat")


def test_groups_that_were_sampled_together_have_one_clock() -> None:
    times = np.arange(50) / 100
    groups = {"left.time [s]": times, "left.angle": times, "right.time [s]": times.copy(), "right.angle": times}
    assert tvident.FileRecording(groups).sample_rate == 100
    apart = groups | {"right.time [s]": times + 0.005}
    assert tvident.FileRecording(apart).time is None


def test_times_of_few_digits_tell_the_rate_unless_samples_were_lost() -> None:
    """512 Hz in three digits was refused, which `identify` takes; 998 Hz would be a wrong rate of 1000 Hz with samples lost."""
    angle = np.sin(np.arange(5000) / 40)
    printed = tvident.FileRecording({"time": np.round(np.arange(5000) / 512, 3), "angle": angle})
    assert printed.sample_rate == 512
    there = np.arange(5000) % 500 != 499
    lost = {"time": np.arange(5000)[there] / 1000, "sample": np.flatnonzero(there), "angle": angle[there]}
    with pytest.raises(
        ValueError, match=r"those of the recording are not: samples are lost before t\[499\] = 0.5; pass t="
    ):
        _ = tvident.FileRecording(lost).sample_rate
    uneven = np.arange(4990) / 1000
    uneven[2000:] += 0.5
    with pytest.raises(
        ValueError, match="uniform to a thousandth of their step; those of the recording are not; pass t="
    ):
        _ = tvident.FileRecording({"time": uneven, "angle": angle[:4990]}).sample_rate
    coarse = np.round(np.arange(5000) / 1024, 2)
    with pytest.raises(
        ValueError,
        match="a sample rate needs times that tell it; those of the recording do not: t must tell samples apart",
    ):
        _ = tvident.FileRecording({"time": coarse, "angle": angle}).sample_rate


def test_channels_of_words_and_tables_have_a_sample_rate() -> None:
    time = np.arange(50) / 1000
    channels = {"time": time, "label": np.array(["rest", "motion"] * 25), "note": np.array([None, 1.5] * 25)}
    assert tvident.FileRecording(channels).sample_rate == 1000
    assert tvident.FileRecording(pd.DataFrame(channels)).sample_rate == 1000


def test_infinite_values_and_counts_without_a_sign_are_no_warning_and_no_times() -> None:
    """The rate was looked for with differences: a raw warning of NumPy, and counts that go down wrapped."""
    time = np.arange(100) / 250
    wild = np.where(np.arange(100) // 2 == 10, np.inf, time)
    down = np.arange(100, 0, -1).astype(np.uint32)
    recording = tvident.FileRecording({"time [s]": time, "wild": wild, "down": down})
    assert recording.sample_rate == pytest.approx(250)
    assert "250 Hz" in repr(recording)


def test_one_of_several_devices_is_asked_for(tmp_path: Path) -> None:
    (tmp_path / "x.txt").write_text("A\t\tB\t\nt\tq\tt\tq\ns\t°\ts\t°\n0,1\t2,5\t0,1\t3,5\n0,2\t2,6\t0,2\t3,6\n")
    recording = tvident.read_recording(tmp_path / "x.txt")
    with pytest.raises(KeyError, match=r"A\.q \[°\], B\.q \[°\]; name one of these as it is written here"):
        recording["q"]
    assert recording["B.q"][0] == 3.5
    assert recording["B.q [°]"].unit == "°"


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("Abtastrate: 500 Hz", 500.0),
        ("Sampling rate: 500 Hz", 500.0),
        ("# sampling frequency = 0.5 kHz", 500.0),
        ("Sample Rate [Hz],500,500", 500.0),
        ("Sample rate,512.5", 512.5),
        ("Abtastfrequenz: 1,2 kHz", 1200.0),
        ("Sampling interval = 2 ms", 500.0),
        ("Abtastzeit;2,5;ms", 400.0),
        ("Fréquence d'échantillonnage : 2 kS/s", 2000.0),
        ("Sampling rate: 500Hz", 500.0),
        ("Sampling rate: 0.5kHz", 500.0),
        ("Sampling rate: 1e3 Hz", 1000.0),
        ("Sampling interval: 2ms", 500.0),
        ("Sample rate in Hz: 500", 500.0),
        ("Abtastrate [1/s]: 500", 500.0),
        ("fs = 500 Hz", 500.0),
        ("FS = 100", None),  # full scale
        ("FS = 100 V", None),
        ("Sampling rate: 1,000 Hz", None),  # a thousand, or one
        ("Sampling rate: 1,000Hz", None),
        ("Sampling rate: 500 Hz 2x", None),
        ("Sampling rate: 500 Hz, decimated by 2", None),
        ("Sampling interval: 2", None),
        ("Sampling rate: 500 rpm", None),
        ("Sampling rate: 0 Hz", None),
        ("Sampling rate:", None),
        ("Sample Rate,500,100", None),
        ("Sampling rate: 500 Hz\nSampling rate: 100 Hz", None),
    ],
)
@pytest.mark.filterwarnings("ignore:.*is not read as names:tvident.recordings.FileWarning")
def test_a_sample_rate_that_lines_above_the_numbers_state_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, rate: float | None
) -> None:
    """It was not looked at: who read the file was told to give one."""
    monkeypatch.chdir(tmp_path)
    mark = "" if line.startswith("#") else "# "
    lines = "\n".join(mark + one for one in line.split("\n"))
    Path("x.csv").write_text(f"{lines}\nangle [rad],torque [N m]\n1,2\n2,0\n1,1\n", encoding="utf-8")
    recording = tvident.read_recording("x.csv")
    asked = CliRunner().invoke(main, ["identify", "x.csv", "--angle", "angle", "--torque", "torque"])
    assert asked.exit_code == 2
    if rate is None:
        with pytest.raises(ValueError, match="a sample rate needs a channel of times"):
            _ = recording.sample_rate
        assert "it may be" not in asked.stderr
        return
    assert recording.sample_rate == pytest.approx(rate)
    assert f"it may be --sample-rate {rate:g}, as the file says: '" in asked.stderr
    listed = CliRunner().invoke(main, ["info", "x.csv"])
    assert f"no channel holds times; it may be --sample-rate {rate:g}" in listed.stdout
    piped = CliRunner().invoke(
        main, ["identify", "-", "--angle", "angle", "--torque", "torque"], Path("x.csv").read_bytes()
    )
    assert f"it may be --sample-rate {rate:g}, as the file says: '" in piped.stderr


def test_a_sample_rate_below_the_numbers_is_not_stated_above_them(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    numbers = "angle,torque\n1,2\n2,0\n1,1\n"
    path.write_text(f"{numbers}# Sampling rate: 500 Hz\n", encoding="utf-8")
    with pytest.raises(ValueError, match="a sample rate needs a channel of times"):
        _ = tvident.read_recording(path).sample_rate
    path.write_text(f"# Sampling rate: 500 Hz\n{numbers}# Sampling rate: 100 Hz\n", encoding="utf-8")
    assert tvident.read_recording(path).sample_rate == 500
    # Lines above the numbers may be many.
    path.write_text("# Sampling rate: 500 Hz\n" + 300 * "# x\n" + numbers, encoding="utf-8")
    assert tvident.read_recording(path).sample_rate == 500


def test_times_are_believed_rather_than_what_stands_above_them(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("Sampling rate: 500 Hz\ntime [s];angle [rad]\n0;1\n0.004;2\n0.008;1\n")
    with pytest.warns(recordings.FileWarning, match="500 Hz, and its times show 250 Hz, which is used"):
        assert tvident.read_recording(path).sample_rate == pytest.approx(250.0)
    assert "no channel holds times" not in CliRunner().invoke(main, ["info", str(path)]).stdout


def test_ends_of_a_part_and_rates_are_numbers() -> None:
    """Texts ended in a message of NumPy, and a rate of 0 was 0 Hz."""
    recording = tvident.FileRecording({"time [s]": np.arange(100) / 100, "angle [rad]": np.zeros(100)})
    ends: Any = ("0.1 s", "0.2 s")
    with pytest.raises(TypeError, match=r"t0 must be a number; got '0\.1 s'; pass a float"):
        recording.select(*ends)
    assert recording.select(0.5, np.inf)["angle"].size == 50
    with pytest.raises(ValueError, match="sample_rate must be positive and finite; got 0"):
        tvident.FileRecording({"angle": np.zeros(10)}, sample_rate=0)


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_counts_since_1970_are_no_seconds(tmp_path: Path, factor: float, unit: str) -> None:
    """Stamps of a computer in ms were a recording of 0.1 Hz, without a word."""
    stamps = np.int64(1_700_000_000 * factor) + (np.arange(50) * (factor / 100)).astype(np.int64)
    for header, is_known in (("timestamp", False), (f"timestamp [{unit}]", True)):
        (tmp_path / "x.csv").write_text(f"{header},angle\n" + "".join(f"{one},1\n" for one in stamps))
        recording = tvident.read_recording(tmp_path / "x.csv")
        if is_known:
            assert recording.sample_rate == pytest.approx(100, rel=1e-6)
        else:
            with pytest.raises(
                ValueError, match=rf"would be of the year \d+ .*'time \[{unit}\]', or give t= and time_unit='{unit}'"
            ):
                _ = recording.sample_rate


@pytest.mark.parametrize(
    ("above", "times", "shown"),
    [
        (
            "Name\tangle\tName\ttorque\nSampleTime[ms]\t2\tSampleTime[ms]\t2\nUnit\tdeg\tUnit\tNm\n",
            "ms",
            "'SampleTime[ms] 2 SampleTime[ms] 2', 500 Hz, and its times show 1000 Hz",
        ),
        (
            "Abtastrate: 1000 Hz\ntime\tangle\ttime_2\ttorque\n",
            "",
            "'Abtastrate: 1000 Hz', 1000 Hz, and its times show 1 Hz",
        ),
    ],
)
def test_a_rate_that_is_stated_beside_times_of_another_is_said(
    tmp_path: Path, above: str, times: str, shown: str
) -> None:
    """Times in ms were seconds, or a scope's files half as fast, without a word."""
    place = tmp_path / "x.csv"
    place.write_text(above + "".join(f"{k}\t{k % 7}\t{k}\t{k % 5}\n" for k in range(60)))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        recording = tvident.read_recording(place)
    assert any(f"it states {shown}, which is used: check which is right" in str(one.message) for one in said)
    assert recording["time"].unit == times
    for told in (
        CliRunner().invoke(main, ["info", str(place)]),
        CliRunner().invoke(main, ["info", "-"], place.read_bytes()),
    ):
        assert f"it states {shown}" in told.stderr
    place.write_text(place.read_text().replace("\t2\tSampleTime[ms]\t2", "\t1\tSampleTime[ms]\t1").replace("1000", "1"))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        tvident.read_recording(place)
    assert not any("it states" in str(one.message) for one in said)


def test_json_is_known_from_a_pipe() -> None:
    lines = "".join(f'{{"time": {k / 500}, "angle": {k % 7}}}\n' for k in range(60))
    told = CliRunner().invoke(main, ["info", "-"], input=lines)
    assert told.exit_code == 0
    assert "uniform: 500 per unit" in told.stdout


def test_single_numbers_that_tell_different_rates_are_asked_about(tmp_path: Path) -> None:
    """The first was taken without a word: twice the rate makes an inertia four times as small."""
    path = tmp_path / "x.npz"
    channels: dict[str, Any] = {"angle": np.sin(T), "torque": np.cos(T), "dt": 0.002, "fs": 1000.0}
    np.savez(path, **channels)
    with pytest.raises(ValueError, match=r"dt says 500 Hz and fs says 1000 Hz: give sample_rate= with the right one"):
        assert tvident.read_recording(path).sample_rate
    np.savez(path, **channels | {"fs": 500.0})
    assert tvident.read_recording(path).sample_rate == pytest.approx(500)
    # Of times beside them nobody knows which they bear out.
    np.savez(path, **channels | {"time [s]": T})
    with pytest.raises(ValueError, match="dt says 500 Hz and fs says 1000 Hz"):
        assert tvident.read_recording(path).sample_rate


@pytest.mark.parametrize(("name", "number"), [("fs", 500.0), ("dt", 0.002), ("sample_rate [kHz]", 0.5)])
def test_a_single_number_that_contradicts_the_times_is_said(tmp_path: Path, name: str, number: float) -> None:
    """The number was taken without a word: a logger that keeps every second sample makes the inertia four times as small."""
    path = tmp_path / "x.npz"
    channels: dict[str, Any] = {"time [s]": T, "angle": np.sin(T), name: number}
    np.savez(path, **channels)
    with pytest.warns(recordings.FileWarning, match=r"says 500 Hz, which is used, and its times show 250 Hz: check"):
        recording = tvident.read_recording(path)
    assert recording.sample_rate == 500
    np.savez(path, **channels | {"time [s]": T / 2})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert tvident.read_recording(path).sample_rate == 500


@pytest.mark.parametrize("number", [-1.0, 0.0, np.nan])
def test_a_number_that_is_no_sample_rate_is_named(tmp_path: Path, number: float) -> None:
    """The rate was asked for as if the file said nothing of it."""
    call = ["--angle", "angle", "--torque", "torque"]
    channels: dict[str, Any] = {"angle": np.sin(T), "torque": np.cos(T)}
    for name in ("fs", "Sampling Frequency [kHz]", "dt"):
        path = tmp_path / "x.npz"
        np.savez(path, **channels | {name: number})
        bare = name.split(" [", maxsplit=1)[0]
        with pytest.raises(
            ValueError, match=f"; {bare} says {number:g}, which is no sample rate or period; give sample_rate="
        ):
            assert tvident.read_recording(path).sample_rate
        asked = CliRunner().invoke(main, ["identify", str(path), *call])
        assert f"says {number:g}, which is no sample rate or period" in asked.stderr
    text = tmp_path / "x.csv"
    text.write_text(f"Sample rate: {number:g} Hz\nangle,torque\n1,2\n2,0\n1,1\n")
    said = f"'Sample rate: {number:g} Hz' is no sample rate or period"
    with pytest.raises(ValueError, match=said):
        assert tvident.read_recording(text).sample_rate
    for asked in (
        CliRunner().invoke(main, ["identify", str(text), *call]),
        CliRunner().invoke(main, ["identify", "-", *call], text.read_bytes()),
    ):
        assert f"give --sample-rate, --delta or --time; {said}" in asked.stderr
    # Another line, or times, tell it.
    text.write_text(f"Sample rate: {number:g} Hz\nSample rate: 500 Hz\nangle,torque\n1,2\n2,0\n1,1\n")
    assert tvident.read_recording(text).sample_rate == 500
