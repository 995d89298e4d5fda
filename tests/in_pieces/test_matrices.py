"""Channels of a matrix in files that are read piece by piece: in columns or in rows, named or numbered."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pytest
from pyarrow import parquet

import tvident
from tvident import recordings


@pytest.fixture(scope="module")
def matrix() -> npt.NDArray[np.float64]:
    rig = tvident.simulate_torsional_rig(duration=4.0)
    return np.stack([rig.time, rig.angle, rig.torque])


@pytest.mark.parametrize("are_rows", [True, False])
@pytest.mark.parametrize("names", [("time", "angle", "torque"), ()], ids=["named", "numbered"])
def test_channels_of_a_matrix_are_rows_or_columns(
    tmp_path: Path, matrix: npt.NDArray[np.float64], names: tuple[str, ...], are_rows: bool
) -> None:
    """Rows were 4000 channels of three samples each, also where an attribute named three."""
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        made = file.create_dataset("data", data=matrix if are_rows else matrix.T)
        if names:
            made.attrs["columns"] = names
        file["single"] = matrix[1:2]
    called: Any = {"angle": "angle", "torque": "torque"} if names else {"angle": "data.1", "torque": "data.2"}
    found = tvident.identify_file(path, tmp_path / "out.csv", **called, sample_rate=1000.0)
    whole = tvident.identify(matrix[1], matrix[2], sample_rate=1000.0)
    assert found.samples == matrix.shape[1]
    assert found.constants["inertia"][0] == pytest.approx(whole.value("inertia").value, rel=0.01)
    # A row by itself is a vector, as read_recording() has it.
    alone = tvident.identify_file(path, tmp_path / "alone.csv", **{**called, "angle": "single"}, sample_rate=1000.0)
    assert alone.constants["inertia"] == found.constants["inertia"]


def test_a_column_that_is_called_as_a_part_of_a_structure_is_asked_for(
    tmp_path: Path, matrix: npt.NDArray[np.float64]
) -> None:
    """One of both was lost without a word, which one depended on their order."""
    path = tmp_path / "run.parquet"
    _, angle, torque = (pa.array(one) for one in matrix)
    joint = pa.StructArray.from_arrays([angle, torque], ["angle", "torque"])
    parquet.write_table(pa.table({"joint": joint, "joint.angle": pa.array(2 * matrix[1])}), path)
    with pytest.warns(recordings.FileWarning, match=r"two columns are called 'joint\.angle'.*'joint\.angle_2'"):
        channels = recordings.read(path)
    np.testing.assert_array_equal(channels["joint.angle"], matrix[1])
    np.testing.assert_array_equal(channels["joint.angle_2"], 2 * matrix[1])
    with pytest.raises(recordings.FileError, match=r"'joint\.angle' is a column, and a part of a structure; rename"):
        tvident.identify_file(path, tmp_path / "out.csv", angle="joint.angle", torque="joint.torque", sample_rate=1e3)


def _structures(path: Path, rig: Any) -> None:
    rows = np.empty(rig.time.size, [("time", "f8"), ("angle_deg", "f8"), ("torque", "f8")])
    rows["time"], rows["angle_deg"], rows["torque"] = rig.time, np.degrees(rig.angle), rig.torque
    with h5py.File(path, "w") as file:
        file["rig/data"] = rows


def _list_beside(path: Path, rig: Any) -> None:
    with h5py.File(path, "w") as file:
        file["data"] = np.stack([np.degrees(rig.angle), rig.torque], axis=1)
        file["columns"] = np.array(["angle [deg]", "torque"], dtype="S20")
        file["fs"] = 1000.0


def _list_of_the_group(path: Path, rig: Any) -> None:
    with h5py.File(path, "w") as file:
        file["run/data"] = np.stack([np.degrees(rig.angle), rig.torque])
        file["run"].attrs["channel_names"] = ["angle", "torque"]
        file["run"].attrs["units"] = ["deg", "N m"]
        file.attrs["fs"] = 1000.0


@pytest.mark.parametrize("write", [_structures, _list_beside, _list_of_the_group])
def test_names_and_units_are_those_in_memory(tmp_path: Path, write: Any) -> None:
    """A list of columns beside a matrix, or at its group, was not read: degrees were rad without a word. Structures had no channels."""
    rig = tvident.simulate_torsional_rig(duration=4.0, pattern="constant")
    path = tmp_path / "run.h5"
    write(path, rig)
    recording = tvident.read_recording(path)
    assert {recording[name].unit for name in recording if "angle" in name} == {"deg"}
    found = tvident.identify_file(path, tmp_path / "out.csv", angle="angle", torque="torque", stiffness="constant")
    whole = tvident.identify(rig.angle, rig.torque, sample_rate=1000.0, stiffness="constant")
    assert found.constants["inertia"][0] == pytest.approx(whole.value("inertia").value, rel=1e-6)
