"""Sample rates that a file says beside its channels: read piece by piece as ``read_recording`` has them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import zarr
from scipy.io import netcdf_file

import tvident
from tvident import recordings

_RATE = 500.0


@pytest.fixture(scope="module")
def rig() -> Any:
    return tvident.simulate_torsional_rig(duration=4.0, sample_rate=_RATE)


def _of_file_attribute(folder: Path, rig: Any) -> Path:
    path = folder / "run.h5"
    with h5py.File(path, "w") as file:
        file.attrs["sample_rate"] = _RATE
        file["angle"], file["torque"] = rig.angle, rig.torque
    return path


def _of_channel_attributes(folder: Path, rig: Any) -> Path:
    path = folder / "run.h5"
    with h5py.File(path, "w") as file:
        file["rig/angle"], file["rig/torque"] = rig.angle, rig.torque
        for one in ("angle", "torque"):
            file[f"rig/{one}"].attrs["Sampling rate [Hz]"] = "500 Hz"
    return path


def _of_single_number(folder: Path, rig: Any) -> Path:
    path = folder / "run.hdf5"
    with h5py.File(path, "w") as file:
        file["angle"], file["torque"] = rig.angle, rig.torque
        file["fs"] = 0.5
        file["fs"].attrs["units"] = "kHz"
    return path


def _of_period(folder: Path, rig: Any) -> Path:
    path = folder / "run.h5"
    with h5py.File(path, "w") as file:
        file["angle"], file["torque"], file["dt"] = rig.angle, rig.torque, [1 / _RATE]
    return path


def _of_zarr(folder: Path, rig: Any) -> Path:
    path = folder / "run.zarr"
    group = zarr.open_group(path, mode="w")
    inner = group.create_group("rig")
    inner.attrs["fs"] = _RATE
    for name in ("angle", "torque"):
        inner.create_array(name, data=np.asarray(getattr(rig, name)))
    return path


def _of_netcdf_3(folder: Path, rig: Any) -> Path:
    path = folder / "run.nc"
    with netcdf_file(path, "w") as file:
        file.sample_rate = _RATE
        file.createDimension("sample", rig.angle.size)
        for name in ("angle", "torque"):
            file.createVariable(name, "f8", ("sample",))[:] = getattr(rig, name)
    return path


def _of_netcdf_3_variable(folder: Path, rig: Any) -> Path:
    path = folder / "run.nc"
    with netcdf_file(path, "w") as file:
        file.createDimension("sample", rig.angle.size)
        for name in ("angle", "torque"):
            file.createVariable(name, "f8", ("sample",))[:] = getattr(rig, name)
        number = file.createVariable("sampling_frequency", "f8", ())
        number[...] = 0.5
        number.units = "kHz"
    return path


def _of_netcdf_4(folder: Path, rig: Any) -> Path:
    return _of_file_attribute(folder, rig).rename(folder / "run.nc4")


def _of_text(folder: Path, rig: Any) -> Path:
    path = folder / "run.csv"
    rows = "\n".join(f"{one!r},{other!r}" for one, other in zip(rig.angle.tolist(), rig.torque.tolist(), strict=True))
    path.write_text(f"Sample rate: 500 Hz\nangle,torque\n{rows}\n")
    return path


_FILES = [
    _of_file_attribute,
    _of_channel_attributes,
    _of_single_number,
    _of_period,
    _of_zarr,
    _of_netcdf_3,
    _of_netcdf_3_variable,
    _of_netcdf_4,
    _of_text,
]


@pytest.mark.parametrize("made", _FILES)
def test_a_rate_that_a_file_says_is_that_of_the_pieces(
    tmp_path: Path, rig: Any, made: Callable[[Path, Any], Path]
) -> None:
    """All were refused: "has no channel of times"."""
    path = made(tmp_path, rig)
    recording = tvident.read_recording(path)
    assert recording.sample_rate == pytest.approx(_RATE)
    names: dict[str, Any] = {
        part: next(name for name in recording if name.rpartition(".")[2] == part and recording[name].size > 1)
        for part in ("angle", "torque")
    }
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = tvident.identify_file(path, tmp_path / "out.npy", **names, method="paper")
    given = tvident.identify_file(path, tmp_path / "given.npy", **names, method="paper", sample_rate=_RATE)
    assert (tmp_path / "out.npy").read_bytes() == (tmp_path / "given.npy").read_bytes()
    assert found.settings["sample_rate"] == given.settings["sample_rate"] == _RATE


def test_a_rate_beside_times_keeps_where_they_begin(tmp_path: Path, rig: Any) -> None:
    path = _of_file_attribute(tmp_path, rig)
    with h5py.File(path, "a") as file:
        file["time"] = rig.time + 12.0
    tvident.identify_file(path, tmp_path / "out.npy", angle="angle", torque="torque", method="paper")
    np.testing.assert_allclose(np.load(tmp_path / "out.npy")["time"], rig.time + 12.0, atol=1e-9)


@pytest.mark.parametrize("factor", [1.5, 2.0])
def test_times_that_show_another_rate_than_the_file_says_are_named(tmp_path: Path, rig: Any, factor: float) -> None:
    """A recorder that was slower than it was set to makes the inertia wrong by the square of that."""
    path = _of_file_attribute(tmp_path, rig)
    with h5py.File(path, "a") as file:
        file["time"] = rig.time * factor
        file["time"].attrs["units"] = "s"
    with pytest.warns(recordings.FileWarning, match=f"shows {_RATE / factor:.5g}.* Hz, not 500, which is used"):
        found = tvident.identify_file(path, tmp_path / "out.npy", angle="angle", torque="torque", method="paper")
    assert found.settings["sample_rate"] == _RATE


def test_rates_that_differ_are_said_and_none_is_taken(tmp_path: Path, rig: Any) -> None:
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        for name, rate in (("angle", 500.0), ("torque", 1000.0)):
            file[name] = getattr(rig, name)
            file[name].attrs["sample_rate"] = rate
    with (
        pytest.warns(recordings.FileWarning, match="several sample rates in Hz: 500, 1000; none is read"),
        pytest.raises(TypeError, match="needs the sample period"),
    ):
        tvident.identify_file(path, tmp_path / "out.npy", angle="angle", torque="torque")


def test_times_come_before_what_is_written_above_a_text(tmp_path: Path, rig: Any) -> None:
    """As in memory: a stated rate is what was set, times are what was recorded."""
    path = tmp_path / "run.csv"
    columns = zip(rig.time.tolist(), rig.angle.tolist(), rig.torque.tolist(), strict=True)
    rows = "\n".join(f"{time!r},{one!r},{other!r}" for time, one, other in columns)
    path.write_text(f"Sample rate: 1000 Hz\ntime [s],angle,torque\n{rows}\n")
    with pytest.warns(recordings.FileWarning, match=r"states 'Sample rate: 1000 Hz'.*show 500 Hz, which is used"):
        found = tvident.identify_file(path, tmp_path / "out.npy", angle="angle", torque="torque", method="paper")
    assert found.settings["sample_rate"] == _RATE


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ({"time": 1.7e18, "step": 2e6}, r"would be of the year .*'time \[ns\]', or give sample_rate="),
        ({"time": 739000.0, "step": 2e-3 / 86400}, r"'time \[days\]', or give sample_rate="),
    ],
)
def test_times_that_count_otherwise_are_asked_about(
    tmp_path: Path, rig: Any, times: dict[str, float], words: str
) -> None:
    """They were seconds without a word: one sample in 2e6 s, or 4e7 Hz."""
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file["angle"], file["torque"] = rig.angle, rig.torque
        file["time"] = times["time"] + times["step"] * np.arange(rig.angle.size)
    with pytest.raises(ValueError, match=words):
        tvident.identify_file(path, tmp_path / "out.npy", angle="angle", torque="torque")


def test_a_clock_is_found_as_in_memory(tmp_path: Path, rig: Any) -> None:
    """A channel in a unit of time that increases was no clock, and of two that differ the first was one."""
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file["angle"], file["torque"], file["stamp_of_drive"] = rig.angle, rig.torque, rig.time * 1e3 + 7
        file["stamp_of_drive"].attrs["units"] = "ms"
    assert tvident.read_recording(path).sample_rate == pytest.approx(_RATE)
    call: dict[str, Any] = {"angle": "angle", "torque": "torque", "method": "paper"}
    found = tvident.identify_file(path, tmp_path / "out.npy", **call)
    assert found.settings["sample_rate"] == pytest.approx(_RATE)
    with h5py.File(path, "a") as file:
        del file["stamp_of_drive"]
        file["time_1"], file["time_2"] = rig.time, rig.time * 1.5
    with pytest.raises(TypeError, match=r"several channels of times \(time_1, time_2\); give sample_rate"):
        tvident.identify_file(path, tmp_path / "none.npy", **call)


def test_single_numbers_that_differ_are_named(tmp_path: Path, rig: Any) -> None:
    """The first was taken without a word, here and in memory."""
    path = _of_period(tmp_path, rig)
    with h5py.File(path, "a") as file:
        file["fs"] = 2 * _RATE
    with (
        pytest.warns(recordings.FileWarning, match="dt says 500 Hz and fs says 1000 Hz: give sample_rate="),
        pytest.raises(TypeError, match="needs the sample period"),
    ):
        tvident.identify_file(path, tmp_path / "out.npy", angle="angle", torque="torque")


@pytest.mark.parametrize("ending", ["h5", "csv"])
def test_a_number_that_is_no_sample_rate_is_named(tmp_path: Path, rig: Any, ending: str) -> None:
    path = tmp_path / f"run.{ending}"
    if ending == "h5":
        with h5py.File(path, "w") as file:
            file["angle"], file["torque"] = rig.angle, rig.torque
            file.attrs["fs"] = -1.0
    else:
        path.write_text("fs: -1 Hz\nangle,torque\n" + "1,2\n2,1\n" * 50)
    with pytest.raises(TypeError, match=r"no channel of times; .*-1.* no sample rate or period; give sample_rate="):
        tvident.identify_file(path, tmp_path / "out.npy", angle="angle", torque="torque")
