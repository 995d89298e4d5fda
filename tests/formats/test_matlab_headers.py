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


def test_headers_of_catman_say_names_and_units(tmp_path: Path) -> None:
    """They were `Channel_1_Data` and `Channel_2_Data`, without units."""
    headers = [
        {"Unit": unit, "SignalName": name, "SampleFrequency": 250.0}
        for name, unit in (("travel", "mm"), ("load", "kN"))
    ]
    content: dict[str, Any] = {"File_Header": {"NumberOfChannels": "2"}}
    for place, (header, samples) in enumerate(zip(headers, (ANGLE, TORQUE), strict=True), 1):
        content |= {f"Channel_{place}_Data": samples[:, np.newaxis], f"Channel_{place}_Header": header}
    assert units_in(tmp_path / "x.mat", content) == {"travel": "mm", "load": "kN"}
    twice = {**content, "Channel_2_Header": headers[0], "other": TORQUE}
    assert units_in(tmp_path / "y.mat", twice) == {"travel": "mm", "Channel_2_Data.travel": "mm", "other": ""}
