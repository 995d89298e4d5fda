"""Parts that a TDMS file was appended in: when each began, and in which unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

import recorded_files as examples
import tvident
from tvident._formats.tdms import variables
from tvident._formats.told import Remark

T, ANGLE, TORQUE = examples.T, examples.ANGLE, examples.TORQUE

START = np.datetime64("2024-01-01T10:00:00.5")


def read(
    path: Path, *segments: Sequence[tuple[str, Any, Mapping[str, Any]]]
) -> tuple[Mapping[str, tvident.Channel], str, str]:
    """Write a file and return its channels, what was not read, and what was not read as it stands."""
    with TdmsWriter(path) as writer:
        for segment in segments:
            of_all = {"wf_increment": 1 / 250}
            writer.write_segment([ChannelObject("rig", name, one, of_all | dict(more)) for name, one, more in segment])
    told: list[str] = []
    found = tvident.FileRecording(dict(variables(str(path), told)))
    remarks = [one for one in told if isinstance(one, Remark)]
    return found, "; ".join(one for one in told if one not in remarks), "; ".join(remarks)


@pytest.mark.parametrize("start", [{}, {"wf_start_time": START}])
def test_offsets_of_later_parts_are_times(tmp_path: Path, start: Mapping[str, Any]) -> None:
    """A part that began 10 s after the start of all, by its offset, came right behind the first."""
    parts: Any = [[("angle", ANGLE, {**start, "wf_start_offset": offset})] for offset in (2.0, 10.0, 11.2)]
    found, _, remarks = read(tmp_path / "x.tdms", *parts)
    np.testing.assert_allclose(found["time"], np.concatenate([2 + T, 10 + T, 11.2 + T]), atol=1e-9)
    assert remarks == "channel angle: it was appended to 6.8 s after its end, as its times say"


def test_a_part_without_a_unit_is_not_in_that_of_the_others(tmp_path: Path) -> None:
    """Degrees were rad where the last part had no unit, and where the first had none nothing was said."""
    parts: Any = [[("angle", ANGLE, {"unit_string": unit}), ("torque", TORQUE, {})] for unit in ("deg", "")]
    found, skipped, _ = read(tmp_path / "x.tdms", *parts)
    assert list(found) == ["time", "torque"]
    assert "angle (it was appended to without a unit, after deg; read the parts one by one)" in skipped
    found, skipped, remarks = read(tmp_path / "x.tdms", *parts[::-1])
    assert (found["angle"].unit, skipped) == ("deg", "")
    assert remarks == "channel angle: its unit, deg, was written at sample 300, and is taken for all of it"


@pytest.mark.parametrize("unset", [{}, {"wf_start_time": np.datetime64("1904-01-01T00:00:00")}])
def test_parts_whose_start_is_not_known_follow_the_part_before(tmp_path: Path, unset: Mapping[str, Any]) -> None:
    """The second began at 0, as the first, so that times went back."""
    later = [{"wf_start_time": START + np.timedelta64(ms, "ms")} for ms in (0, 11_200)]
    parts: Any = [[("angle", ANGLE, more), ("torque", TORQUE, more)] for more in (unset, *later)]
    found, _, remarks = read(tmp_path / "x.tdms", *parts)
    np.testing.assert_allclose(found["time"], np.concatenate([T, 1.2 + T, 12.4 + T]), atol=1e-9)
    assert remarks.count("it was appended to 10 s after its end") == 2
    # The clock of the torque began with its first part.
    parts[0][1] = ("torque", TORQUE, {"wf_start_time": START - np.timedelta64(1200, "ms")})
    found, _, _ = read(tmp_path / "y.tdms", *parts)
    np.testing.assert_allclose(found["time"], np.concatenate([T, 1.2 + T, 12.4 + T]), atol=1e-9)


def test_a_part_that_lost_its_start_follows_the_one_before(tmp_path: Path) -> None:
    """What is known of the others stays."""
    unset = np.datetime64("1904-01-01T00:00:00")
    starts = [START, unset, START + np.timedelta64(5000, "ms")]
    found, _, remarks = read(tmp_path / "x.tdms", *[[("angle", ANGLE, {"wf_start_time": one})] for one in starts])
    np.testing.assert_allclose(found["time"], np.concatenate([T, 1.2 + T, 5 + T]), atol=1e-9)
    assert remarks == "channel angle: it was appended to 2.6 s after its end, as its times say"


@pytest.mark.parametrize("odd", [float("nan"), float("inf"), "soon"])
def test_an_offset_that_is_no_number_is_taken_as_none(tmp_path: Path, odd: object) -> None:
    """All times were NaN, each channel had a group of its own, and words refused the file as damaged."""
    found, skipped, remarks = read(
        tmp_path / "x.tdms", [("angle", ANGLE, {"wf_start_offset": odd}), ("torque", TORQUE, {})]
    )
    assert list(found) == ["time", "angle", "torque"]
    np.testing.assert_allclose(found["time"], T, atol=1e-9)
    assert (skipped, remarks) == ("", f"channel angle: its offset is {odd}, which is taken as 0")
    found, _, remarks = read(tmp_path / "y.tdms", [("angle", ANGLE, {"wf_increment": odd})])
    assert list(found) == ["angle"]
    assert remarks == f"channel angle: its sample period is {odd}, so it has no times"
