"""Parquet files of pandas and of loggers: units of the table's metadata, names of several levels, lists and structures as columns."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident

pd = pytest.importorskip("pandas")
pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")

RIG = tvident.simulate_torsional_rig(2.0)
DEGREES, MILLI, TIME = np.degrees(RIG.angle), 1000 * RIG.torque, np.asarray(RIG.time)
UNITS = {"time": "s", "angle": "deg", "torque": "N mm"}


def of_pandas(path: Path) -> None:
    table = pd.DataFrame({"time": TIME, "angle": DEGREES, "torque": MILLI})
    table.attrs = {"units": UNITS, "rig": "A"}
    table.to_parquet(path)


def of_a_logger(path: Path) -> None:
    table = pa.table({"time": TIME, "angle": DEGREES, "torque": MILLI})
    parquet.write_table(table.replace_schema_metadata({"units": json.dumps(UNITS)}), path)


@pytest.mark.parametrize("write", [of_pandas, of_a_logger])
def test_units_of_the_table_are_those_of_its_columns(tmp_path: Path, write: Any) -> None:
    """Degrees and N mm were rad and N m: .215 kg m² for .0123, with a question about degrees alone."""
    path = tmp_path / "run.parquet"
    write(path)
    recording = tvident.read_recording(path)
    assert recording.units == UNITS
    found = tvident.identify(recording["angle"], recording["torque"], sample_rate=recording.sample_rate)
    assert found.value("inertia").value == pytest.approx(0.0123, rel=0.02)
    in_pieces = tvident.identify_file(path, tmp_path / "out.npy", angle="angle", torque="torque")
    assert in_pieces.constants["inertia"][0] == pytest.approx(0.0123, rel=0.02)
    assert not in_pieces.assumed


@pytest.mark.parametrize("units", [b"{", b'["deg"]', b'{"angle": 3}', b"deg"])
def test_other_metadata_says_no_unit(tmp_path: Path, units: bytes) -> None:
    table = pa.table({"time": TIME, "angle": DEGREES})
    parquet.write_table(
        table.replace_schema_metadata({"units": units, "PANDAS_ATTRS": b"[]"}), tmp_path / "run.parquet"
    )
    assert tvident.read_recording(tmp_path / "run.parquet").units == {"time": "", "angle": ""}


def test_names_of_several_levels_are_joined(tmp_path: Path) -> None:
    """They were called `('elbow', 'angle [deg]')`, and no name found them."""
    columns = {("elbow", "angle [deg]"): DEGREES, ("elbow", "torque [N mm]"): MILLI, ("wrist", "angle [deg]"): DEGREES}
    pd.DataFrame(columns, index=pd.Index(TIME, name="time [s]")).to_parquet(tmp_path / "run.parquet")
    recording = tvident.read_recording(tmp_path / "run.parquet")
    assert list(recording) == ["elbow.angle", "elbow.torque", "wrist.angle", "time"]
    assert recording["torque"].unit == "N mm"


@pytest.mark.parametrize("index", ["timedelta", "dates"])
@pytest.mark.filterwarnings("ignore:.*holds times")
def test_an_index_of_times_without_a_name_is_the_clock(tmp_path: Path, index: str) -> None:
    times = pd.to_timedelta(TIME, unit="s") if index == "timedelta" else pd.to_datetime(TIME, unit="s")
    pd.DataFrame({"angle": RIG.angle, "torque": RIG.torque}, index=times).to_parquet(tmp_path / "run.parquet")
    recording = tvident.read_recording(tmp_path / "run.parquet")
    assert recording.units["time"] == "s"
    assert recording.sample_rate == pytest.approx(1000)


def test_lists_of_one_length_and_structures_are_columns(tmp_path: Path) -> None:
    """They were not read."""
    rows = [[one, 0.5] for one in RIG.angle.tolist()]
    table = pa.table(
        {
            "t": TIME,
            "q": rows,
            "joint": [{"tau": one, "inner": {"deep": 1.0}} for one in RIG.torque.tolist()],
            "ragged": [[1.0] * (place % 3) for place in range(TIME.size)],
        }
    )
    parquet.write_table(table, tmp_path / "run.parquet")
    with pytest.warns(tvident.recordings.FileWarning, match="not read: ragged"):
        recording = tvident.read_recording(tmp_path / "run.parquet")
    assert list(recording) == ["t", "q.0", "q.1", "joint.tau", "joint.inner.deep"]
    np.testing.assert_array_equal(recording["q.0"], RIG.angle)
    np.testing.assert_array_equal(recording["tau"], RIG.torque)


@pytest.mark.parametrize("name", ["q_deg", "q [deg]"])
@pytest.mark.filterwarnings("ignore:.*one of them part of a structure")
def test_a_part_of_a_structure_beside_a_column_of_its_name_keeps_its_unit(tmp_path: Path, name: str) -> None:
    """The number behind a name stood behind its unit, too: of `joint.q_deg_2` nothing said that it is in degrees."""
    inside = pa.StructArray.from_arrays([pa.array(DEGREES)], names=[name])
    table = pa.table({"time": TIME, f"joint.{name}": DEGREES, "joint": inside})
    parquet.write_table(table, tmp_path / "run.parquet")
    recording = tvident.read_recording(tmp_path / "run.parquet")
    assert recording.units == {"time": "", "joint.q": "deg", "joint.q_2": "deg"}
