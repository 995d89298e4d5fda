"""netCDF of both versions: units, scales, missing values and dimensions of words, as xarray and others write them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import netcdf_file

import recorded_files as examples
import tvident
from tvident import recordings

T, ANGLE, TORQUE = examples.T, examples.ANGLE, examples.TORQUE
SCALE, FILL = 1e-2, -32768
PACKED = np.round(ANGLE / SCALE).astype(np.int16)
PACKED[5] = FILL
BOTH = np.stack([ANGLE, 2 * ANGLE], axis=1)
NAMES = ("elbow", "knee")
SINCE = "seconds since 2024-01-01 00:00:00"


def of_version_3(path: Path) -> None:
    with netcdf_file(path, "w") as file:
        for name, length in (("time", T.size), ("joint", 2), ("letters", 5)):
            file.createDimension(name, length)
        for name, kind, dims, values, attributes in (
            ("time", "f8", ("time",), T, {"units": SINCE}),
            ("joint", "S1", ("joint", "letters"), np.array(NAMES, "S5").view("S1").reshape(2, 5), {}),
            ("angle", "i2", ("time",), PACKED, {"units": "rad", "scale_factor": SCALE, "_FillValue": np.int16(FILL)}),
            ("torque", "f8", ("time",), TORQUE, {"units": "N m"}),
            ("both", "f8", ("time", "joint"), BOTH, {"units": "deg"}),
        ):
            made = file.createVariable(name, kind, dims)
            made[:] = values
            for key, value in attributes.items():
                setattr(made, key, value)


def of_version_4(path: Path) -> None:
    with h5py.File(path, "w") as file:
        time, joint = file.create_dataset("time", data=T), file.create_dataset("joint", data=[*NAMES])
        none = file.create_dataset("none", data=np.zeros(3, np.float32))
        for one, name in (
            (time, "time"),
            (joint, "joint"),
            (none, f"{'This is a netCDF dimension but not a netCDF variable.':<60}3"),
        ):
            one.make_scale(name)
        time.attrs["units"] = SINCE
        for name, values, attributes in (
            ("angle", PACKED, {"units": "rad", "scale_factor": SCALE, "_FillValue": np.array([FILL], np.int16)}),
            ("torque", TORQUE, {"units": "N m"}),
            ("both", BOTH, {"units": "deg"}),
        ):
            made = file.create_dataset(name, data=values)
            made.attrs.update(attributes)
            for place, scale in enumerate((time, joint)[: values.ndim]):
                made.dims[place].attach_scale(scale)


@pytest.mark.parametrize("write", [of_version_3, of_version_4])
def test_variables_are_channels_as_their_attributes_say(tmp_path: Path, write: Callable[[Path], None]) -> None:
    """The ending was refused; packed numbers of a renamed file were rad."""
    path = tmp_path / "run.nc"
    write(path)
    found = tvident.read_recording(path)
    assert {name: found[name].unit for name in found} == {
        "time": found["time"].unit,
        "angle": "rad",
        "torque": "N m",
        "both.elbow": "deg",
        "both.knee": "deg",
    }
    assert found.sample_rate == pytest.approx(1 / (T[1] - T[0]))
    there = np.arange(T.size) != 5
    assert np.isnan(found["angle"][5])
    # Half a step of what was rounded.
    np.testing.assert_allclose(found["angle"][there], ANGLE[there], rtol=0, atol=0.51 * SCALE)
    np.testing.assert_array_equal(found["torque"], TORQUE)
    np.testing.assert_array_equal(found["both.knee"], 2 * ANGLE)


@pytest.mark.parametrize(
    ("change", "cure"),
    [
        (lambda content: content[: len(content) // 3], "copy it again"),
        (lambda content: b"CDF\x05" + content[4:], "nccopy -k nc4"),
        (lambda _: b"time,angle\n1,2\n", "rename it to run.csv"),
        (lambda _: b"", "must not be empty"),
    ],
)
def test_a_damaged_file_says_what_to_do(tmp_path: Path, change: Callable[[bytes], bytes], cure: str) -> None:
    path = tmp_path / "run.nc"
    of_version_3(path)
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(recordings.FileError, match=cure):
        tvident.read_recording(path)


def test_a_file_with_another_ending_is_told_what_it_is(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    of_version_3(path)
    with pytest.raises(recordings.FileError, match=r"rename it to run\.nc"):
        tvident.read_recording(path)
