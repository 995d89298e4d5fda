"""Arrays of NumPy and MATLAB in files that were damaged, or made to harm: refused, and no more of them read than they hold."""

from __future__ import annotations

import io
import os
import pickle
import struct
import time
import warnings
import zipfile
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from tvident import recordings


def npy(shape: str, type_of: str = "'<f8'", data: bytes = b"") -> bytes:
    """Give a file with a header of one's own."""
    header = f"{{'descr': {type_of}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    header += b" " * ((64 - (10 + len(header) + 1) % 64) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


class Harm:
    """Something that makes a folder when it is unpickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, ("harm",)


OBJECTS = np.array([Harm()], dtype=object)


def read_or_refused(path: Path) -> dict[str, Any] | str:
    """Give the channels, or the message, which anybody may print."""
    try:
        return recordings.read(path)
    except recordings.FileError as error:
        message = str(error)
    assert len(message) < 1000
    assert message.isprintable()
    return message


def refusal(path: Path) -> str:
    message = read_or_refused(path)
    assert isinstance(message, str)
    return message


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "must begin as numpy.save writes it"),
        (npy("(3,)")[:40], "must begin as numpy.save writes it"),
        (b"\x93NUMPY\x09\x09" + b"\0" * 100, "must begin as numpy.save writes it"),
        (npy("(1000000000000000,)"), "it says 1000000000000000 of 8, and there are 0"),
        (npy(f"(1{'0' * 30},)"), "and there are 0"),
        (npy(f"(1{'0' * 5000},)"), "must begin as numpy.save writes it"),
        (npy("(-5,)"), "it says -5 of 8"),
        (npy("(-1, -1)", data=b"\0" * 8), "it says -1 x -1 of 8"),
        (npy("(1000,)", data=b"\0" * 100), "it says 1000 of 8, and there are 100"),
        (npy("(3,)", data=b"\0" * 100), "it says 3 of 8, and there are 100"),
        (npy("(__import__('os').mkdir('harm'),)"), "must begin as numpy.save writes it"),
        (npy("(" * 9000 + ")" * 9000), "must begin as numpy.save writes it"),
        (npy("(3,)", "'V0'"), "holds no numbers"),
        (npy("(0,)"), "holds no numbers"),
        (npy("(3,)", "'<U10'", b"\0" * 120), "holds no numbers"),
        (npy("(200, 20000)", "'u1'", b"\0" * 4_000_000), None),
        (npy("(11000, 11000)", "'u1'", b"\0" * 121_000_000), "must have at most 10000 channels; this one has 11000"),
        (pickle.dumps(Harm()), "must begin as numpy.save writes it"),
        (npy("(1,)", "'|O'", pickle.dumps(OBJECTS)), "this one holds Python objects"),
    ],
)
def test_damaged_npy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes, message: str | None) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "x.npy"
    path.write_bytes(content)
    started = time.process_time()
    if message is None:
        assert len(recordings.read(path)) == 200
    else:
        assert message in refusal(path)
    assert time.process_time() - started < 2
    assert not (tmp_path / "harm").exists()


def archive(compression: int = zipfile.ZIP_DEFLATED) -> bytearray:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as made:
        for name in "ab":
            with made.open(f"{name}.npy", "w") as member:
                np.save(member, np.arange(2000.0))
    return bytearray(file.getvalue())


@pytest.mark.parametrize("compression", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
@pytest.mark.parametrize("seed", range(25))
def test_damaged_npz_is_refused_or_whole(tmp_path: Path, compression: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    content = archive(compression)
    places = generator.integers(len(content), size=generator.integers(1, 6))
    for place in places:
        content[place] = generator.integers(256)
    if seed % 5 == 0:
        del content[generator.integers(len(content)) :]
    (tmp_path / "x.npz").write_bytes(content)
    found = read_or_refused(tmp_path / "x.npz")
    if not isinstance(found, str):
        for values in found.values():  # every member has a checksum
            np.testing.assert_array_equal(values, np.arange(2000.0))


@pytest.mark.parametrize("change", ["method", "encrypted"])
def test_npz_that_nobody_unpacks(tmp_path: Path, change: str) -> None:
    content = archive()
    directory = content.find(b"PK\x01\x02")
    if change == "method":
        content[8:10] = content[directory + 10 : directory + 12] = b"\x63\0"
    else:
        content[6] |= 1
        content[directory + 8] |= 1
    (tmp_path / "x.npz").write_bytes(content)
    assert "must be an archive as numpy.savez writes it" in refusal(tmp_path / "x.npz")


@pytest.mark.slow
def test_an_archive_that_unpacks_to_much_more_than_it_is_is_refused_at_once(tmp_path: Path) -> None:
    with (
        zipfile.ZipFile(tmp_path / "x.npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as made,
        made.open("a.npy", "w", force_zip64=True) as member,
    ):
        member.write(npy(f"({2**26},)"))
        for _ in range(32):
            member.write(bytes(1 << 24))
    started = time.process_time()
    assert "must unpack to at most 200 times its size" in refusal(tmp_path / "x.npz")
    assert time.process_time() - started < 1


def test_what_is_no_channel_of_an_npz_is_said_and_never_unpickled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    np.savez(
        tmp_path / "x.npz", a=np.ones(5), b=OBJECTS, c=np.ones(3, complex), d=np.ones((2, 2, 2)), allow_pickle=True
    )
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert list(recordings.read(tmp_path / "x.npz")) == ["a"]
    assert [str(one.message).partition(": ")[2] for one in said] == [
        "not read: c (complex), d (3 dimensions); channels are real, and vectors or columns of a matrix",
        "not read, since only Python could say what they hold: b",
    ]
    assert not (tmp_path / "harm").exists()


def test_pipes_and_devices_are_refused_before_anybody_waits(tmp_path: Path) -> None:
    for ending in (".csv", ".npy", ".npz", ".mat"):
        os.mkfifo(tmp_path / f"pipe{ending}")
        (tmp_path / f"zero{ending}").symlink_to("/dev/zero")
        for name in ("pipe", "zero"):
            assert "must be a file; it is a pipe or a device" in refusal(tmp_path / f"{name}{ending}")
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    assert "Too many levels of symbolic links" in refusal(tmp_path / "loop.csv")
    assert "there is no such file" in refusal(tmp_path / "two\nlines.csv")


def a_matlab_file(folder: Path) -> bytes:
    ragged = np.array([np.arange(3), "abc"], dtype=object)
    savemat(folder / "x.mat", {"angle": np.arange(50.0), "cell": ragged, "rig": {"torque": np.ones(50)}})
    return (folder / "x.mat").read_bytes()


def test_one_cell_array_does_not_hide_the_rest(tmp_path: Path) -> None:
    a_matlab_file(tmp_path)
    with pytest.warns(recordings.FileWarning, match=r"x\.mat: not read: cell \(cells of different sizes\)"):
        found = recordings.read(tmp_path / "x.mat")
    assert list(found) == ["angle", "rig.torque"]
    np.testing.assert_array_equal(found["angle"], np.arange(50.0))


@pytest.mark.filterwarnings("ignore::tvident.recordings.FileWarning")
@pytest.mark.parametrize("seed", range(6))
def test_damaged_matlab_files_cost_no_more_than_themselves(tmp_path: Path, seed: int) -> None:
    generator = np.random.default_rng(seed)
    content = bytearray(a_matlab_file(tmp_path))
    for place in generator.integers(len(content), size=4):
        content[place] = generator.integers(256)
    (tmp_path / "x.mat").write_bytes(content)
    read_or_refused(tmp_path / "x.mat")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "said"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "its reader ended with status -11"),
        ("import time; time.sleep(60)", "its reader took more than 1 s"),
        ("bytearray(1 << 40)", "its reader says: too large"),
        ("raise RecursionError", "its reader says: RecursionError"),
    ],
)
def test_a_reader_that_crashes_or_hangs_is_an_error_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str, said: str
) -> None:
    # A module of that name stands in the way of the reader, which does what damaged files make it do.
    (tmp_path / "pymatreader.py").write_text(f"def read_mat(*a, **k):\n    {what}\n")
    (tmp_path / "x.mat").write_bytes(bytes(200))
    monkeypatch.syspath_prepend(str(tmp_path))
    if "sleep" in what:
        monkeypatch.setattr("tvident._files.foreign._SECONDS", 1)
    assert said in refusal(tmp_path / "x.mat")


def test_matlab_files_of_version_7_3(tmp_path: Path) -> None:
    path = tmp_path / "x.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["torque"], file["angle"] = np.ones((1, 50)), np.arange(50.0)[None]
        for name in ("torque", "angle"):
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "/")
        file["nowhere"] = h5py.SoftLink("/nowhere")
        group = file.create_group("group")
        group["itself"] = h5py.SoftLink("/group")
        file.create_dataset("huge", shape=(10**12,), dtype="f8")
    content = bytearray(path.read_bytes())
    content[:128] = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    path.write_bytes(content)
    with pytest.warns(recordings.FileWarning, match=r"not read: elsewhere \(.*group \(.*huge \(.*nowhere \("):
        found = recordings.read(path)
    np.testing.assert_array_equal(found["angle"], np.arange(50.0))
    np.testing.assert_array_equal(found["torque"], np.ones(50))
