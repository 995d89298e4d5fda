"""Files of NumPy and MATLAB that were damaged: read, or refused in one short line, and nothing in them is run."""

from __future__ import annotations

import io
import tempfile
import time
import warnings
import zipfile
from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat

from hostile.text_files import LONGEST
from tvident import recordings

MOST_SECONDS = {".npy": 2.0, ".npz": 2.0, ".mat": 40.0}
"""A MATLAB file is read in a process of its own, which has to start on a busy machine."""


def case(seed: int) -> None:
    generator = np.random.default_rng(seed)
    ending = (".npy", ".npz", ".npz", ".mat")[seed % 4]
    make = {".npy": _npy, ".npz": _npz, ".mat": _matlab_5 if generator.random() < 0.5 else _matlab_7_3}[ending]
    content = bytearray(make(generator))
    first = min(len(content), 400) if generator.random() < 0.5 else len(content)  # headers are the weak spot
    for place in generator.integers(first, size=int(generator.integers(1, 8))):
        content[place] = int(generator.integers(256))
    if generator.random() < 0.2:
        del content[int(generator.integers(len(content))) :]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"x{ending}"
        path.write_bytes(content)
        _read(path)


def _read(path: Path) -> None:
    started = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            recordings.read(path)
    except recordings.FileError as error:
        message = str(error)
        assert len(message) < LONGEST, message
        assert message.isprintable(), ascii(message)
        assert "; " in message, message
    assert time.perf_counter() - started < MOST_SECONDS[path.suffix], "it takes too long"


def _array(generator: np.random.Generator) -> np.ndarray:
    shape = tuple(generator.integers(0, 30, size=int(generator.integers(0, 4))))
    return np.asarray(generator.standard_normal(shape)).astype(
        str(generator.choice(["f8", ">f4", "i2", "?", "c16", "U3"]))
    )


def _npy(generator: np.random.Generator) -> bytes:
    file = io.BytesIO()
    np.save(file, _array(generator))
    return file.getvalue()


def _npz(generator: np.random.Generator) -> bytes:
    file = io.BytesIO()
    methods = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
    with zipfile.ZipFile(file, "w", methods[int(generator.integers(4))]) as archive:
        for name in "abc"[: int(generator.integers(1, 4))]:
            archive.writestr(f"{name}.npy", _npy(generator))
    return file.getvalue()


def _matlab_5(generator: np.random.Generator) -> bytes:
    file = io.BytesIO()
    cell = np.array([np.arange(3), "abc"], dtype=object)
    savemat(
        file,
        {"angle": generator.standard_normal(200), "rig": {"x": np.arange(5.0)}, "cell": cell, "text": "hi"},
        do_compression=bool(generator.random() < 0.3),
    )
    return file.getvalue()


def _matlab_7_3(generator: np.random.Generator) -> bytes:
    file = io.BytesIO()
    with h5py.File(file, "w", userblock_size=512) as made:
        made["angle"] = generator.standard_normal((1, 200))
        made["angle"].attrs["MATLAB_class"] = np.bytes_("double")
        made.create_group("rig")["x"] = np.arange(5.0)
    content = bytearray(file.getvalue())
    content[:128] = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    return bytes(content)
