"""netCDF of both versions read piece by piece: vectors, columns and records, in their units, scaled, with missing values."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import h5py
import numpy as np
import numpy.typing as npt
import pytest
from scipy.io import netcdf_file

import tvident
from tvident import recordings

pytestmark = pytest.mark.usefixtures("small_pieces")

SAMPLES = 30_001
SCALE, FILL = 1e-4, np.int32(-(2**31))


def channels_of(rig: tvident.Recording) -> dict[str, tuple[npt.NDArray[Any], tuple[str, ...], dict[str, Any]]]:
    """Return variables: their numbers, dimensions and attributes; the angle is packed in degrees."""
    packed = np.round(np.degrees(rig.angle) / SCALE).astype(np.int32)
    packed[15_000:15_020] = FILL
    return {
        "time": (rig.time, ("time",), {"units": "seconds since 2024-01-01"}),
        "flag": (np.arange(SAMPLES, dtype=np.int16), ("time",), {}),
        "angle": (packed, ("time",), {"units": "deg", "scale_factor": SCALE, "_FillValue": FILL}),
        "both": (np.stack([np.zeros(SAMPLES), rig.torque], axis=1), ("time", "joint"), {"units": "N m"}),
        "rows": (np.stack([np.zeros(SAMPLES), rig.torque]), ("joint", "time"), {"units": "N m"}),
    }


def of_version_3(path: Path, rig: tvident.Recording, *, length: int | None) -> None:
    with netcdf_file(path, "w") as file:
        file.createDimension("time", length)
        file.createDimension("joint", 2)
        for name, (values, dimensions, attributes) in channels_of(rig).items():
            if length is None and dimensions[0] != "time":
                continue  # what grows is the first axis
            made = file.createVariable(name, values.dtype, dimensions)
            made[:] = values
            for key, value in attributes.items():
                setattr(made, key, value)


def of_version_4(path: Path, rig: tvident.Recording) -> None:
    with h5py.File(path, "w") as file:
        joint = file.create_dataset("joint", data=np.zeros(2, np.float32))
        joint.make_scale("This is a netCDF dimension but not a netCDF variable.         2")
        for name, (values, _, attributes) in channels_of(rig).items():
            file.create_dataset(name, data=values, chunks=True).attrs.update(attributes)


@pytest.mark.parametrize("version", ["3", "3, records", "4"])
@pytest.mark.parametrize("torque", ["both.1", "rows.1"])
def test_pieces_have_the_bits_of_the_whole(
    tmp_path: Path, rig: tvident.Recording, version: Literal["3", "3, records", "4"], torque: str
) -> None:
    """The ending was refused."""
    if version == "3, records":
        torque = "both.1"
    path = tmp_path / "run.nc"
    if version == "4":
        of_version_4(path, rig)
    else:
        of_version_3(path, rig, length=None if "records" in version else SAMPLES)
    found = tvident.identify_file(path, "out.npy", angle="angle", torque=torque, method="paper")
    read = tvident.read_recording(path)
    whole = tvident.identify(read["angle"], read[torque], t=read["time"], method="paper")
    assert found.samples == SAMPLES
    rows, columns = np.load("out.npy"), whole.columns()
    assert np.array_equal(rows["stiffness"], columns["stiffness"], equal_nan=True)
    assert np.isfinite(rows["stiffness"]).any()
    assert (rows["status"][15_000:15_020] & tvident.Status.GAP != 0).all()


def test_a_dimension_of_words_names_the_columns(tmp_path: Path, rig: tvident.Recording) -> None:
    path = tmp_path / "run.nc"
    with netcdf_file(path, "w") as file:
        for name, length in (("time", SAMPLES), ("what", 2), ("letters", 6)):
            file.createDimension(name, length)
        names = np.array(["angle", "torque"], "S6").view("S1").reshape(2, 6)
        file.createVariable("what", "S1", ("what", "letters"))[:] = names
        file.createVariable("arm", "f8", ("time", "what"))[:] = np.stack([rig.angle, rig.torque], axis=1)
    more: Any = {"sample_rate": 1000, "method": "paper"}
    found = tvident.identify_file(path, "out.npy", angle="arm.angle", torque="arm.torque", **more)
    assert found.samples == SAMPLES
    whole = tvident.identify(rig.angle, rig.torque, **more)
    assert np.array_equal(np.load("out.npy")["stiffness"], whole.stiffness, equal_nan=True)


def test_trials_in_records_are_read_along_each(tmp_path: Path, rig: tvident.Recording) -> None:
    # Beside four bytes of another variable a record of eight-byte numbers does not begin at a multiple of eight.
    path = tmp_path / "run.nc"
    channels = np.stack([rig.angle, rig.torque, rig.angle[::-1]])
    with netcdf_file(path, "w") as file:
        file.createDimension("trial", None)
        file.createDimension("time", SAMPLES)
        values = file.createVariable("value", "f8", ("trial", "time"))
        number = file.createVariable("number", "i4", ("trial",))
        for trial, channel in enumerate(channels):
            values[trial] = channel
            number[trial] = trial
    more: Any = {"sample_rate": 1000, "method": "paper"}
    tvident.identify_file(path, "out.npy", angle="value.0", torque="value.1", **more)
    whole = tvident.identify(rig.angle, rig.torque, **more)
    assert np.array_equal(np.load("out.npy")["stiffness"], whole.stiffness, equal_nan=True)


@pytest.mark.parametrize(
    ("change", "cure"),
    [
        (lambda content: content[: len(content) // 3], "copy it again"),
        (lambda content: b"CDF\x05" + content[4:], "nccopy -k nc4"),
        (lambda _: b"time,angle\n1,2\n", "must be whole"),
        (lambda content: content[:40], "copy it again"),
    ],
)
def test_a_damaged_file_says_what_to_do(tmp_path: Path, rig: tvident.Recording, change: Any, cure: str) -> None:
    path = tmp_path / "run.nc"
    of_version_3(path, rig, length=SAMPLES)
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(recordings.FileError, match=cure):
        tvident.identify_file(path, "out.npy", angle="angle", torque="both.1")
