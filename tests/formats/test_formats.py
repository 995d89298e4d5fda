"""Files of other programs: channels with units and times from each, a damaged one says what is missing, nothing harms."""

from __future__ import annotations

import gc
import sys
import warnings
from importlib import import_module
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

import recorded_files as examples
import tvident
from tvident import recordings
from tvident._files import printable, read, write_table
from tvident._formats import FORMATS, hdf5, matlab

JOINTS = {".mcap", ".bag"}
"""Rad, and no units in the file."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("formats")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the libraries that write
        for ending, write in examples.WRITTEN.items():
            write(made / f"x{ending}")
    return made


@pytest.mark.parametrize("ending", examples.WRITTEN)
def test_channels_come_with_units_and_a_sample_rate(folder: Path, ending: str) -> None:
    found = tvident.read_recording(folder / f"x{ending}")
    angle, torque = examples.ANGLE, examples.TORQUE
    if ending in JOINTS:
        np.testing.assert_allclose(found["elbow.position"], np.deg2rad(angle), rtol=1e-12)
        np.testing.assert_allclose(found["elbow.effort"], torque)
        assert found.sample_rate == pytest.approx(250)
        return
    name = "angle.x" if ending == ".c3d" else "angle"
    # C3D has 32 bits a number, a sheet 16 digits.
    precision = {".c3d": 1e-6, ".xlsx": 1e-15}.get(ending, 0)
    np.testing.assert_allclose(found[name], angle, rtol=precision)
    np.testing.assert_allclose(found["torque"], torque, rtol=precision)
    assert (found[name].unit, found["torque"].unit) == ("deg", "N m")
    if ending == ".mf4":
        assert found["slow"].unit == "°C"
        np.testing.assert_allclose(found["group1.time"], examples.T[::10])
    else:
        assert found.sample_rate == pytest.approx(250, rel=1e-9)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of a library that gave up
@pytest.mark.parametrize(
    "ending", [ending for ending in examples.WRITTEN if ending not in {".csv", ".npz", ".parquet", ".mat"}]
)
def test_a_file_that_was_cut_is_refused_or_says_so(folder: Path, tmp_path: Path, ending: str) -> None:
    content = (folder / f"x{ending}").read_bytes()
    (tmp_path / f"x{ending}").write_bytes(content[: int(0.8 * len(content))])
    # What the process does that reads a file, without the time to start it.
    skipped: list[str] = []
    try:
        found = dict(
            import_module(f"tvident._formats.{FORMATS[ending].module}").variables(str(tmp_path / f"x{ending}"), skipped)
        )
    except Exception:  # noqa: BLE001 - of any kind: the process turns it into a message
        found = {}
        skipped.append("everything")
    gc.collect()  # what a library leaves behind complains here, and in no other test
    assert skipped, f"{list(found)} were read without a word"


def test_damage_is_one_line_and_empty_files_are_no_recordings(folder: Path, tmp_path: Path) -> None:
    for ending in (".h5", ".parquet"):
        content = (folder / f"x{ending}").read_bytes()
        (tmp_path / f"x{ending}").write_bytes(content[:-100])
        with pytest.raises(recordings.FileError, match=r"must be whole; .*; copy it again") as refused:
            recordings.read(tmp_path / f"x{ending}")
        assert str(refused.value).isprintable()
    for ending in (*FORMATS, ".parquet", ".feather"):
        (tmp_path / f"empty{ending}").touch()
        with pytest.raises(recordings.FileError, match=r"must not be empty|must be whole"):
            recordings.read(tmp_path / f"empty{ending}")


def test_what_is_missing_is_named_with_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for ending, kind in FORMATS.items():
        (tmp_path / f"x{ending}").write_bytes(b"x")
        monkeypatch.setitem(sys.modules, kind.package, None)
        with pytest.raises(
            recordings.FileError, match=rf"needs {kind.package}; install it with: pip install 'tvident\[{kind.extra}\]'"
        ):
            recordings.read(tmp_path / f"x{ending}")
    with pytest.raises(recordings.FileError, match=r"got '\.wav'; .* convert it in Python: numpy\.savez"):
        recordings.read(tmp_path / "x.wav")
    for ending in (".parquet", ".h5", ".mat", ".xlsx"):
        monkeypatch.setitem(
            sys.modules, {".mat": "scipy", ".xlsx": "openpyxl", ".h5": "h5py"}.get(ending, "pyarrow"), None
        )
        with pytest.raises(ImportError, match=r"install it with: pip install 'tvident\[io\]', or write to \.csv"):
            examples.RECORDING.write(tmp_path / f"x{ending}")
        assert not (tmp_path / f"x{ending}").exists() or ending in FORMATS


@pytest.mark.parametrize("drift", [0.0, 2e-4])
def test_clocks_of_streams_are_put_right(tmp_path: Path, drift: float) -> None:
    # One event in two streams: the clock of the angle is 5 s behind the recorder's, that of the torque 100 s ahead and may run fast.
    path, times, begins = tmp_path / "x.xdf", np.arange(2500) / 250, 0.2
    checks = np.arange(0, 10.6, 0.5)
    streams = []
    for name, start, ahead, fast in (("angle", 0.0, -5.0, 0.0), ("torque", begins, 100.0, drift)):
        values = np.exp(-(((times + start - 5) / 0.05) ** 2))
        own, at = (1000 + ahead + one * (1 + fast) for one in (times + start, checks))
        offsets = [(float(stamp), float(1000 + check - stamp)) for stamp, check in zip(at, checks, strict=True)]
        streams.append(examples.XdfStream(name, own, [(name, "deg" if name == "angle" else "N m", values)], offsets))
    path.write_bytes(examples.xdf_of(streams))
    found = tvident.read_recording(path)
    for name, start in (("angle", 0.0), ("torque", begins)):
        np.testing.assert_allclose(found[f"{name}.time"], times + start, atol=1e-6)
        assert found[f"{name}.time"][np.argmax(found[name])] == pytest.approx(5, abs=1e-6)


def test_matlab_structures_are_channels_with_units(tmp_path: Path) -> None:
    channel = np.zeros(2, dtype=[("Name", "O"), ("Data", "O"), ("Unit", "O")])
    channel[0], channel[1] = ("Model/angle", examples.ANGLE, "deg"), ("torque", examples.TORQUE, "N m")
    times = np.zeros(1, dtype=[("Name", "O"), ("Data", "O")])
    times[0] = ("t", examples.T)
    savemat(tmp_path / "dspace.mat", {"rec1": {"X": times, "Y": channel, "Description": "x"}})
    found = tvident.FileRecording(dict(matlab.variables(str(tmp_path / "dspace.mat"), [])))
    assert found.units == {"time": "s", "Model/angle": "deg", "torque": "N m"}
    assert found.sample_rate == pytest.approx(250)
    nested = {
        "angle": {"data": examples.ANGLE, "unit": "deg"},
        "rig": {"torque": {"values": examples.TORQUE, "units": "N m"}},
    }
    savemat(tmp_path / "nested.mat", nested | {"fs": 250.0, "comment": "words"})
    numbers = matlab.variables(str(tmp_path / "nested.mat"), [])
    found = tvident.FileRecording({name: value for name, value in numbers if not isinstance(value, str)})
    assert found.units == {"angle": "deg", "rig.torque": "N m", "fs": ""}
    assert found["torque"] is found["rig.torque"]


@pytest.mark.slow
@pytest.mark.parametrize("is_across", [False, True])
def test_columns_of_a_matrix_are_called_as_the_list_beside_it_says(tmp_path: Path, is_across: bool) -> None:
    """They were data.0, data.1 and data.2, without a word of the list and of its units."""
    matrix = np.stack([1e3 * examples.T, examples.ANGLE, examples.TORQUE], axis=1)
    matrix = matrix.T if is_across else matrix
    labels = np.array([["Time (ms)", "Ankle angle (deg)", "Moment (N m)"]], object)
    savemat(tmp_path / "x.mat", {"data": matrix, "labels": labels, "subject": "7"})
    found = tvident.read_recording(tmp_path / "x.mat")
    assert found.units == {"Time": "ms", "Ankle angle": "deg", "Moment": "N m"}
    assert found.sample_rate == pytest.approx(250)
    np.testing.assert_array_equal(found["Ankle angle"], examples.ANGLE)
    imported = {
        "data": matrix,
        "colheaders": np.array([["t", "q", "q"]], object),
        "units": np.array([["s", "rad", "deg"]], object),
    }
    savemat(tmp_path / "x.mat", {"A": imported})
    assert list(tvident.read_recording(tmp_path / "x.mat").units.items()) == [
        ("A.t", "s"),
        ("A.q [rad]", "rad"),
        ("A.q [deg]", "deg"),
    ]
    savemat(tmp_path / "x.mat", {"data": matrix, "labels": labels[:, :2], "subjects": labels})
    assert next(iter(tvident.read_recording(tmp_path / "x.mat"))) == "data.0"


def test_a_matlab_file_that_was_cut_says_that_more_may_be_lost(tmp_path: Path) -> None:
    names = ("time", "angle", "torque")
    savemat(tmp_path / "whole.mat", dict(zip(names, (examples.T, examples.ANGLE, examples.TORQUE), strict=True)))
    content = (tmp_path / "whole.mat").read_bytes()
    (tmp_path / "x.mat").write_bytes(content[: len(content) // 2])
    with pytest.warns(
        recordings.FileWarning,
        match=r"not read: angle .*what may follow it, where the file was cut",
    ):
        found = tvident.read_recording(tmp_path / "x.mat")
    assert set(found.units) == {"time"}


def _structures(fields: tuple[str, ...], rows: list[tuple[Any, ...]]) -> npt.NDArray[Any]:
    made = np.zeros((1, len(rows)), dtype=[(name, "O") for name in fields])
    for place, row in enumerate(rows):
        made[0, place] = row
    return made


def test_a_matlab_file_that_was_cut_within_its_units_is_refused(tmp_path: Path) -> None:
    """Channels in deg came back as such without a unit, with a warning alone."""
    place = tmp_path / "rig.mat"
    tvident.simulate_torsional_rig(duration=0.2).save(place)
    place.write_bytes(place.read_bytes()[:-1])
    with pytest.raises(recordings.FileError, match="the units of the channels cannot be read"):
        tvident.read_recording(place)


def test_arrays_of_matlab_structures_are_channels_by_name(tmp_path: Path) -> None:
    """Names and units of `channels(i)` and of a scope of Simulink were lost, and with them degrees."""
    columns = examples.ANGLE[:, None], examples.TORQUE[:, None]
    channels = _structures(("name", "data", "unit"), [("angle", columns[0], "deg"), ("torque", columns[1], "Nmm")])
    signals = _structures(
        ("values", "dimensions", "label", "blockName"),
        [(columns[0], 1, "angle", "rig/Out1"), (columns[1], 1, "", "rig/Torque"), (columns[1], 1, "", "rig/Torque")],
    )
    one = {"value": examples.ANGLE, "Unit": "deg", "fs": 250.0, "name": "encoder"}
    content = {"channels": channels, "scope": {"time": examples.T[:, None], "signals": signals}, "encoder": one}
    savemat(tmp_path / "x.mat", content)
    found = tvident.read_recording(tmp_path / "x.mat")
    scope = {f"scope.signals.{name}": "" for name in ("angle", "rig/Torque", "rig/Torque_2")}
    assert found.units == {
        "channels.angle": "deg",
        "channels.torque": "Nmm",
        "scope.time": "",
        **scope,
        "encoder": "deg",
        "encoder.fs": "",
    }
    np.testing.assert_array_equal(found["channels.torque"], examples.TORQUE)
    np.testing.assert_array_equal(found["scope.signals.rig/Torque"], examples.TORQUE)


def test_fields_of_matlab_keep_their_capitals_and_units_are_said_once(tmp_path: Path) -> None:
    """`Gain` was called gain, and a channel `a [deg]` with a unit of its own `a [deg] [deg]`."""
    rows = [
        ("a [deg]", examples.ANGLE, "°", 1.0),
        ("b (Nm)", examples.TORQUE, "N m", 2.0),
        ("c [deg]", examples.TORQUE, "rad", 2.0),
    ]
    channels = _structures(("name", "data", "unit", "Gain"), [(name, of[:, None], *rest) for name, of, *rest in rows])
    savemat(tmp_path / "x.mat", {"channels": channels})
    with pytest.warns(recordings.FileWarning, match=r"its name says 'deg', and the file 'rad', which is taken"):
        found = recordings.read(tmp_path / "x.mat")
    assert list(found) == ["channels.a [°]", "channels.b [N m]", "channels.c [deg] [rad]", "channels.Gain"]


def test_channels_of_tdms_that_began_later_have_times_of_their_own(tmp_path: Path) -> None:
    """Two devices that started 5 samples apart were read as if sampled together: a lag that nobody heard of."""
    start = np.datetime64("2024-01-01T10:00:00.5")
    for later, names in (
        (20_000, {"rig.time", "rig.angle", "rig.time_2", "rig.torque"}),
        (3, {"time", "angle", "torque"}),
    ):
        common = {"wf_increment": 1 / 250, "wf_start_offset": 0.0}
        begun = start + np.timedelta64(later, "us")
        with TdmsWriter(tmp_path / "x.tdms") as writer:
            writer.write_segment(
                [
                    ChannelObject("rig", "angle", examples.ANGLE, {**common, "wf_start_time": start, "Unit": "deg"}),
                    ChannelObject("rig", "torque", examples.TORQUE, {**common, "wf_start_time": begun, "units": "N m"}),
                ]
            )
        found = tvident.read_recording(tmp_path / "x.tdms")
        assert set(found.units) == names
        assert set(found.units.values()) == {"s", "deg", "N m"}
        if later == 20_000:
            np.testing.assert_allclose(found["rig.time_2"] - found["rig.time"], 0.02, atol=1e-12)


def test_results_go_to_files_of_every_kind(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=1.0, pattern="constant")
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, stiffness="constant", step=10)
    for ending in (".parquet", ".h5"):
        result.save(tmp_path / f"x{ending}")
        found = tvident.FileRecording(read(tmp_path / f"x{ending}"))
        assert found["stiffness"].unit == "N m/rad"
        np.testing.assert_allclose(found["stiffness"], result.stiffness, rtol=1e-15)
    with pytest.raises(ValueError, match=r"end in \.csv, \.npz, .* or \.xlsx; got 'x\.ods'"):
        result.save(tmp_path / "x.ods")
    with pytest.raises(ValueError, match="at most 1048575 rows of numbers; there are 1048576"):
        tvident.FileRecording({"a": np.zeros(1 << 20)}).write(tmp_path / "long.xlsx")


@pytest.mark.parametrize("name", ["=1+1", "=HYPERLINK(1)", "a,b", "\x1b[31mred", "two\nlines", "+x", "1"])
def test_words_of_sheets_are_no_formulas_and_hold_nothing_that_sheets_refuse(tmp_path: Path, name: str) -> None:
    write_table(tmp_path / "x.xlsx", {"model": np.array([name, "plain"]), name: np.ones(2)}, {})
    rows = list(import_module("openpyxl").load_workbook(tmp_path / "x.xlsx").active)
    assert [[cell.data_type for cell in row] for row in rows] == [["s", "s"], ["s", "n"], ["s", "n"]]
    assert rows[0][1].value == rows[1][0].value == printable(name)


def test_errors_in_a_sheet_are_missing_and_counted(tmp_path: Path) -> None:
    """They were missing without a word."""
    book = import_module("openpyxl").Workbook()
    for row in (("a", "b"), (1.0, "#DIV/0!"), (2.0, 5.0), ("#SPILL!", "#N/A")):
        book.active.append(row)
    book.save(tmp_path / "x.xlsx")
    with pytest.warns(
        recordings.FileWarning, match="2 cells hold errors of a spreadsheet, read as missing: '#DIV/0!' in"
    ):
        found = recordings.read(tmp_path / "x.xlsx")
    np.testing.assert_array_equal(list(found.values()), [[1, 2, np.nan], [np.nan, 5, np.nan]])


def test_names_in_a_sheet_that_begin_with_a_sign_are_no_errors(tmp_path: Path) -> None:
    book = import_module("openpyxl").Workbook()
    for row in (("#1 A", "#2!"), (1.0, 3.0), (2.0, 5.0)):
        book.active.append(row)
    book.save(tmp_path / "x.xlsx")
    assert list(recordings.read(tmp_path / "x.xlsx")) == ["1 A", "2!"]


@pytest.mark.filterwarnings("ignore")  # of libraries about each other
def test_tables_of_matlab_are_channels(tmp_path: Path) -> None:
    times = pd.to_timedelta(1e3 * examples.T, unit="ms")
    table = pd.DataFrame(
        {"angle": examples.ANGLE, "torque": examples.TORQUE, "note": ["x"] * examples.T.size}, index=times
    )
    table.index.name = "Time"
    import_module("matio").save_to_mat(str(tmp_path / "x.mat"), {"run": table})
    skipped: list[str] = []
    found = tvident.FileRecording(dict(matlab.variables(str(tmp_path / "x.mat"), skipped)))
    assert list(found) == ["Time", "angle", "torque"]
    assert skipped == ["run.note (no numbers)"]
    assert found.sample_rate == pytest.approx(250)
    np.testing.assert_array_equal(found["angle"], examples.ANGLE)


def test_the_sheet_that_is_read_is_the_recording(tmp_path: Path) -> None:
    path = tmp_path / "x.xlsx"
    with pd.ExcelWriter(path) as book:
        pd.DataFrame({"Setting": ["rate", "mass"], "Value": [1000, 3.2]}).to_excel(book, sheet_name="Info", index=False)
        for name, factor in (("Run 1", 1), ("Run 2", 2)):
            pd.DataFrame({"t [s]": examples.T, "angle [deg]": factor * examples.ANGLE}).to_excel(
                book, sheet_name=name, index=False
            )
    with pytest.warns(recordings.FileWarning, match="not read: sheet Info, sheet Run 2"):
        found = read(path)
    np.testing.assert_allclose(found["angle [deg]"], examples.ANGLE, rtol=1e-15)


def test_a_sheet_keeps_every_bit(tmp_path: Path) -> None:
    """A sheet has 16 digits from openpyxl; some doubles have 17, and came back one unit in the last place away."""
    numbers = np.random.default_rng(16).standard_normal(2000) * 10.0 ** np.arange(-1000, 1000).clip(-300, 300)
    numbers[3] = np.nan
    tvident.FileRecording({"n": np.arange(2000), "x [N m]": numbers}).write(tmp_path / "x.xlsx")
    np.testing.assert_array_equal(tvident.read_recording(tmp_path / "x.xlsx")["x"], numbers)


@pytest.mark.parametrize("columns", [1, 2])
def test_a_sheet_keeps_what_is_no_number(tmp_path: Path, columns: int) -> None:
    """Infinite values came back as missing, and a sheet of one column that lacks a value was refused."""
    pytest.importorskip("openpyxl")
    values = np.array([1.5, np.nan, np.inf, -np.inf, 2.5])
    names = ["a [rad]", "b"][:columns]
    tvident.FileRecording(dict.fromkeys(names, values)).write(tmp_path / "x.xlsx")
    back = recordings.read(tmp_path / "x.xlsx")
    assert list(back) == names
    for one in back.values():
        np.testing.assert_array_equal(one, values)


def test_a_dataset_of_hdf5_without_samples_is_said(tmp_path: Path) -> None:
    """h5py calls it Empty, and the file was refused as damaged."""
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["angle"], file["torque"] = examples.ANGLE, examples.TORQUE
        file["nothing"], file["note"] = h5py.Empty("f8"), h5py.Empty("S10")
        file["angle"].attrs["unit"] = h5py.Empty("S3")
        file.attrs["sample_rate"] = h5py.Empty("f8")
    told: list[str] = []
    found = dict(hdf5.variables(str(tmp_path / "x.h5"), told))
    assert list(found) == ["angle", "torque"]
    assert told[0].startswith("the sample rate of the file is no number: Empty")
    assert told[1:] == ["note (no samples)", "nothing (no samples)"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("sample_rate", "250 Hz"),
        ("fs", "0.25 kHz"),
        ("SampleRate", "250"),
        ("Sampling Frequency", np.bytes_(b"250 S/s")),
        ("sample rate (Hz)", 250),
    ],
)
@pytest.mark.parametrize("where", ["/", "angle", "rig"])
def test_a_rate_of_hdf5_may_be_a_text_and_stand_anywhere(tmp_path: Path, name: str, said: Any, where: str) -> None:
    """A text with a unit was said to be no number, and what stood beside a channel or its group was not looked at."""
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["angle"], file["rig/torque"] = examples.ANGLE, examples.TORQUE
        file[where].attrs[name] = said
    assert tvident.read_recording(tmp_path / "x.h5").sample_rate == 250


def test_rates_of_hdf5_that_differ_are_said(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "x.h5", "w") as file:
        for channel, rate in (("angle", "250 Hz"), ("torque", 500.0)):
            file[channel] = examples.ANGLE
            file[channel].attrs["fs"] = rate
    with pytest.warns(recordings.FileWarning, match="channels have several sample rates in Hz: 250, 500; none is read"):
        found = tvident.read_recording(tmp_path / "x.h5")
    assert list(found) == ["angle", "torque"]
