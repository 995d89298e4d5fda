from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import io

from tvident import recordings


def assert_holds(path: Path, expected: dict[str, Any]) -> None:
    channels = recordings.read(path)
    assert list(channels) == list(expected)
    for name, values in expected.items():
        np.testing.assert_allclose(channels[name], values)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("plain.csv", "t,a\n0,1.5\n1,2.5\n2,-3e-1\n"),
        ("quoted.csv", '"t","a"\n0,1.5\n1,2.5\n2,-0.3\n'),
        ("semicolons.csv", "t;a\n0;1.5\n1;2.5\n2;-0.3\n"),
        ("tabs.tsv", "t\ta\n0\t1.5\n1\t2.5\n2\t-0.3\n"),
        ("blanks.txt", "t   a\n 0   1.5\n 1   2.5\n 2   -0.3\n"),
        ("comment.dat", "# t a\n0 1.5\n1 2.5\n2 -0.3\n"),
        ("preamble.txt", "A study, by somebody\nin 1996\n\nt\t\ta\n-------\n0\t1.5\n1\t2.5\n2\t-0.3\n"),
        ("windows.csv", "\ufefft,a\r\n0,1.5\r\n1,2.5\r\n2,-0.3\r\n"),
    ],
)
def test_columns_of_text_in_many_dialects(tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8", newline="")
    assert_holds(path, {"t": [0, 1, 2], "a": [1.5, 2.5, -0.3]})


def test_text_of_older_programs(tmp_path: Path) -> None:
    path = tmp_path / "western.csv"
    path.write_bytes("Zeit;Winkel [°]\n0;1.5\n1;2.5\n".encode("latin-1"))
    assert_holds(path, {"Zeit": [0, 1], "Winkel [°]": [1.5, 2.5]})


def test_text_without_names_and_with_gaps(tmp_path: Path) -> None:
    path = tmp_path / "bare.csv"
    path.write_text("1,2\n3,\n5,6\n")
    assert_holds(path, {"0": [1, 3, 5], "1": [2, np.nan, 6]})


def test_numpy_files(tmp_path: Path) -> None:
    x = np.arange(5.0)
    np.save(tmp_path / "one.npy", x)
    assert_holds(tmp_path / "one.npy", {"0": x})
    np.save(tmp_path / "matrix.npy", np.stack([x, 2 * x], axis=1))
    assert_holds(tmp_path / "matrix.npy", {"0": x, "1": 2 * x})
    np.savez(tmp_path / "several.npz", angle=x, torque=-x, rate=1000.0, name="text")
    assert_holds(tmp_path / "several.npz", {"angle": x, "torque": -x, "rate": 1000.0})
    table = np.array([(1.0, 2), (3.0, 4)], dtype=[("a", "f8"), ("b", "i4")])
    np.save(tmp_path / "table.npy", table)
    assert_holds(tmp_path / "table.npy", {"a": [1, 3], "b": [2, 4]})


@pytest.mark.slow
def test_matlab_files_with_structures(tmp_path: Path) -> None:
    x = np.arange(5.0)
    io.savemat(tmp_path / "m.mat", {"angle": x[:, None], "fs": 1000.0, "rig": {"torque": x, "note": "text"}})
    assert_holds(tmp_path / "m.mat", {"angle": x, "fs": 1000.0, "rig.torque": x})


def test_channels_are_found_by_name_with_or_without_unit_and_by_number() -> None:
    channels = {"angle [rad]": np.zeros(3), "torque (N m)": np.ones(3)}
    assert recordings.channel(channels, "angle [rad]", "x.csv") is channels["angle [rad]"]
    assert recordings.channel(channels, "torque", "x.csv") is channels["torque (N m)"]
    assert recordings.channel(channels, "1", "x.csv") is channels["torque (N m)"]
    with pytest.raises(KeyError, match=r"x\.csv has no channel 'speed'; it has angle"):
        recordings.channel(channels, "speed", "x.csv")
    with pytest.raises(KeyError, match="has no channel '²'"):
        recordings.channel(channels, "²", "x.csv")
    both = channels | {"angle (deg)": np.ones(3)}
    with pytest.raises(KeyError, match=r"must have one channel 'angle'; it has angle \[rad\], angle \(deg\); name one"):
        recordings.channel(both, "angle", "x.csv")
    assert recordings.channel(both, "angle (deg)", "x.csv") is both["angle (deg)"]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("missing.csv", None, "there is no such file"),
        ("recording.wav", b"RIFF", "the ending must be one of .csv"),
        ("broken.npz", b"not a zip archive", "cannot be read as .npz"),
        ("broken.npy", b"\x93NUMPY", "cannot be read as .npy"),
        ("broken.mat", b"not a matlab file at all", "cannot be read as a MATLAB file"),
        ("words.csv", b"only,words\nin,here\n", "holds no numbers"),
        ("empty.csv", b"", "holds no numbers"),
        ("ragged.csv", b"t,a\n1,2\n3,4,5\n", "cannot be read as .csv"),
    ],
)
def test_files_that_cannot_be_used_say_why(tmp_path: Path, name: str, content: bytes | None, message: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(recordings.FileError, match=message):
        recordings.read(tmp_path / name)


def test_a_missing_reader_says_which_extra_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "m.mat").write_bytes(b"MATLAB")
    monkeypatch.setitem(sys.modules, "pymatreader", None)
    with pytest.raises(recordings.FileError, match=r"pip install 'tvident\[io\]'"):
        recordings.read(tmp_path / "m.mat")


def test_channels_in_groups_are_named_with_dots_or_slashes() -> None:
    channels = {"rig.angle": np.arange(3.0), "rig.torque": np.ones(3), "rig.angle/old": np.zeros(3)}
    assert recordings.channel(channels, "rig/angle", "x.h5") is channels["rig.angle"]
    assert recordings.channel(channels, "/rig/torque", "x.h5") is channels["rig.torque"]
    assert recordings.channel(channels, "rig.angle/old", "x.h5") is channels["rig.angle/old"]
    for name in ("rig/speed", "/0", "/", "rig/"):
        with pytest.raises(KeyError, match=f"has no channel '{name}'"):
            recordings.channel(channels, name, "x.h5")


def test_slashes_leave_off_what_dots_leave_off() -> None:
    channels = {"test.Rig.angle [deg]": np.arange(3.0), "test.Rig.torque": np.ones(3)}
    for name in ("test/Rig/angle", "test/rig/angle", "Rig/angle", "/angle"):
        assert recordings.channel(channels, name, "x.h5") is channels["test.Rig.angle [deg]"]
    several = {"one.rig.angle": np.ones(3), "two.rig.angle": np.ones(3)}
    with pytest.raises(KeyError, match=r"must have one channel 'rig/angle'; it has one\.rig\.angle, two\.rig\.angle"):
        recordings.channel(several, "rig/angle", "x.h5")
