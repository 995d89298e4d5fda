"""Units and names that stand beside the samples in MATLAB files: a structure of units, headers of catman."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

import recorded_files as examples
import tvident
from tvident._formats.matlab import variables

ANGLE, TORQUE = examples.ANGLE, examples.TORQUE
UNITS = {"angle": "deg", "torque": "Nmm"}
BOTH = {"angle": ANGLE, "torque": TORQUE}


def units_in(path: Path, content: dict[str, Any]) -> dict[str, str]:
    """Write a file, and return the units of its channels."""
    savemat(path, content)
    found = tvident.FileRecording(dict(variables(str(path), [])))
    return {name: values.unit for name, values in found.items() if values.size > 1}


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ({"data": BOTH, "units": UNITS}, {"data.angle": "deg", "data.torque": "Nmm"}),
        ({"run": {"data": BOTH, "units": UNITS}}, {"run.data.angle": "deg", "run.data.torque": "Nmm"}),
        (
            {
                "d": {"a": {"angle": ANGLE}, "b": {"angle": ANGLE}},
                "units": {"a": {"angle": "deg"}, "b": {"angle": "mrad"}},
            },
            {"d.a.angle": "deg", "d.b.angle": "mrad"},
        ),
        # A structure without samples is of settings.
        (
            {"data": BOTH, "limits": {"angle": 90.0}, "units": UNITS},
            {"data.angle": "deg", "data.torque": "Nmm"},
        ),
        # Times beside it are no channel of another unit.
        (
            {"time": examples.T, "data": BOTH, "units": {"time": "s", **UNITS}},
            {"time": "s", "data.angle": "deg", "data.torque": "Nmm"},
        ),
        # Its own come first.
        (
            {"data": {**BOTH, "units": {"angle": "mrad"}}, "units": UNITS},
            {"data.angle": "mrad", "data.torque": "Nmm"},
        ),
    ],
)
def test_a_structure_of_units_is_of_the_structure_beside_it(
    tmp_path: Path, content: dict[str, Any], expected: dict[str, str]
) -> None:
    """Millimetres and kilonewtons of `data` were rad and N m, and K was trusted."""
    assert units_in(tmp_path / "x.mat", content) == expected


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ({**BOTH, "units": UNITS, "si": BOTH}, {**UNITS, "si.angle": "", "si.torque": ""}),
        ({"angle": ANGLE, "units": UNITS, "si": BOTH}, {"angle": "deg", "si.angle": "", "si.torque": ""}),
        ({"data": {"si": BOTH}, "units": UNITS}, {"data.si.angle": "", "data.si.torque": ""}),
        (
            {"data": {**BOTH, "si": BOTH}, "units": UNITS},
            {"data.angle": "deg", "data.torque": "Nmm", "data.si.angle": "", "data.si.torque": ""},
        ),
        # Where it names those, too, it is of them.
        (
            {"angle": ANGLE, "si": {"angle": ANGLE}, "units": {"angle": "deg", "si": {"angle": "rad"}}},
            {"angle": "deg", "si.angle": "rad"},
        ),
    ],
)
def test_a_structure_of_units_is_not_of_converted_copies(
    tmp_path: Path, content: dict[str, Any], expected: dict[str, str]
) -> None:
    """Radians in `si` were degrees, and a stiffness 57 times too large was trusted."""
    assert units_in(tmp_path / "x.mat", content) == expected


def test_a_structure_of_units_beside_two_that_it_may_be_of_is_told(tmp_path: Path) -> None:
    """One of them may hold what was converted."""
    path = tmp_path / "x.mat"
    savemat(path, {"raw": BOTH, "si": BOTH, "units": UNITS})
    told: list[str] = []
    assert all("[" not in name for name, _ in variables(str(path), told))
    assert told == ["the structure of units is not read: raw and si have the channels that it names"]


def test_units_of_matrices_stand_behind_the_numbers_of_columns(tmp_path: Path) -> None:
    """They were within: `data.angle [deg].0`, which had been called `data.angle.0`."""
    two = np.column_stack([ANGLE, 2 * ANGLE, 3 * ANGLE])
    names = ["angle.0", "angle.1", "angle.2"]
    for place, matrix in enumerate((two, two.T)):
        beside = {"data": {"angle": matrix, "torque": TORQUE}, "units": UNITS}
        expected = {f"data.{one}": "deg" for one in names} | {"data.torque": "Nmm"}
        assert units_in(tmp_path / f"{place}.mat", beside) == expected
        for content in ({"angle": matrix, "units": UNITS}, {"angle": {"data": matrix, "unit": "deg"}}):
            assert units_in(tmp_path / f"{place}.mat", content) == dict.fromkeys(names, "deg")
    several = np.array([(two, "angle", "deg"), (two, "torque", "Nm")], [("data", "O"), ("name", "O"), ("unit", "O")])
    units = units_in(tmp_path / "2.mat", {"rig": several})
    assert units == {f"rig.{one}.{k}": unit for one, unit in (("angle", "deg"), ("torque", "Nm")) for k in range(3)}
    found = tvident.read_recording(tmp_path / "1.mat")
    np.testing.assert_array_equal(found["angle.2"], 3 * ANGLE)


def test_headers_of_catman_say_names_and_units(tmp_path: Path) -> None:
    """They were `Channel_1_Data` and `Channel_2_Data`, without units."""
    headers = [
        {"Unit": unit, "SignalName": name, "SampleFrequency": 250.0}
        for name, unit in (("travel", "mm"), ("load", "kN"))
    ]
    content: dict[str, Any] = {"File_Header": {"NumberOfChannels": "2"}}
    for place, (header, samples) in enumerate(zip(headers, (ANGLE, TORQUE), strict=True), 1):
        content |= {f"Channel_{place}_Data": samples[:, np.newaxis], f"Channel_{place}_Header": header}
    assert units_in(tmp_path / "x.mat", content) == {"Channel_1_Data.travel": "mm", "Channel_2_Data.load": "kN"}
    found = tvident.read_recording(tmp_path / "x.mat")
    for place, (name, unit, samples) in enumerate((("travel", "mm", ANGLE), ("load", "kN", TORQUE)), 1):
        for called in (name, f"Channel_{place}_Data", f"Channel_{place}_Data.{name}"):
            assert found[called].unit == unit
            np.testing.assert_array_equal(found[called], samples)
    twice = {**content, "Channel_2_Header": headers[0], "other": TORQUE}
    expected = {"Channel_1_Data.travel": "mm", "Channel_2_Data.travel": "mm", "other": ""}
    assert units_in(tmp_path / "y.mat", twice) == expected
    with pytest.raises(KeyError, match="one channel 'travel'"):
        tvident.read_recording(tmp_path / "y.mat")["travel"]


def test_columns_below_a_header_of_catman_are_found_as_without(tmp_path: Path) -> None:
    """They were `travel [deg].0`."""
    header = {"Unit": "deg", "SignalName": "travel"}
    matrix = np.column_stack([ANGLE, TORQUE])
    units = units_in(tmp_path / "x.mat", {"Channel_1_Data": matrix, "Channel_1_Header": header})
    assert units == {"Channel_1_Data.travel.0": "deg", "Channel_1_Data.travel.1": "deg"}
    found = tvident.read_recording(tmp_path / "x.mat")
    for called in ("Channel_1_Data.1", "travel.1", "Channel_1_Data/1"):
        np.testing.assert_array_equal(found[called], TORQUE)
    with pytest.raises(KeyError, match="one channel 'Channel_1_Data'"):
        found["Channel_1_Data"]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ({"Units": UNITS, **BOTH}, {"angle": "deg", "torque": "Nmm"}),
        ({"data": {"UNITS": UNITS, **BOTH}}, {"data.angle": "deg", "data.torque": "Nmm"}),
        ({"units": {"ANGLE": "deg", "Torque": "Nmm"}, **BOTH}, {"angle": "deg", "torque": "Nmm"}),
        ({"Units": {"ANGLE": "deg", "Torque": "Nmm"}, "data": BOTH}, {"data.angle": "deg", "data.torque": "Nmm"}),
        # Two that differ by capitals alone are no guess.
        ({"units": {"ANGLE": "deg"}, "angle": ANGLE, "Angle": ANGLE}, {"angle": "", "Angle": ""}),
        ({"units": {"Angle": "deg"}, "angle": ANGLE, "Angle": ANGLE}, {"angle": "", "Angle": "deg"}),
    ],
)
def test_units_are_found_whatever_their_capitals(
    tmp_path: Path, content: dict[str, Any], expected: dict[str, str]
) -> None:
    """Degrees were rad without a word."""
    assert units_in(tmp_path / "x.mat", content) == expected


def test_units_of_a_time_series_lie_beside_its_samples(tmp_path: Path) -> None:
    """Structures of time series had angles in rad, whatever DataInfo said, and no clock in ms."""
    time = np.arange(ANGLE.size)[:, None]
    content = {
        name: {
            "Time": time,
            "Data": samples[:, None],
            "DataInfo": {"Units": UNITS[name], "Interpolation": 1.0},
            "TimeInfo": {"Units": "milliseconds"},
        }
        for name, samples in BOTH.items()
    }
    clocks = dict.fromkeys(("logs.angle.Time", "logs.torque.Time"), "milliseconds")
    assert units_in(tmp_path / "run.mat", {"logs": content}) == {
        "logs.angle": "deg",
        "logs.torque": "Nmm",
        **clocks,
    }
    assert tvident.read_recording(tmp_path / "run.mat").sample_rate == pytest.approx(1000)
