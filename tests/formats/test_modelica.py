"""Results of Modelica as MATLAB files: trajectories by name, with the units of their descriptions, signs and constants."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tvident

io = pytest.importorskip("scipy.io")
pytest.importorskip("pymatreader")

RIG = tvident.simulate_torsional_rig(2.0)
NAMES = ["Time", "inertia.phi", "torque.tau", "spring.c", "minus.phi"]
WORDS = ["Time in [s]", "Absolute rotation angle [deg|rad]", "Torque [N.m]", "Stiffness [N.m/rad]", "of no unit"]
ABOUT = np.array([[0, 1, 0, -1], [2, 2, 0, -1], [2, 3, 0, -1], [1, 2, 0, 0], [2, -2, 0, -1]], np.int32)


def letters(texts: list[str], *, is_transposed: bool) -> np.ndarray:
    rows = [text.ljust(max(map(len, texts))) for text in texts]
    return np.array(["".join(column) for column in zip(*rows, strict=True)] if is_transposed else rows)


def written(path: Path, kind: str, about: np.ndarray = ABOUT) -> Path:
    """Write a result as Dymola and OpenModelica do: letter by letter and in rows, or in columns."""
    is_transposed = kind == "binTrans"
    series = np.stack([np.asarray(RIG.time), np.degrees(RIG.angle), RIG.torque], axis=1)
    constant = np.array([[0.0, 13.3], [2.0, 13.3]])
    tables = {"dataInfo": about, "data_1": constant, "data_2": series}
    texts = {"name": NAMES, "description": WORDS}
    io.savemat(
        path,
        {"Aclass": letters(["Atrajectory", "1.1", "", kind], is_transposed=False)}
        | {name: letters(one, is_transposed=is_transposed) for name, one in texts.items()}
        | {name: one.T if is_transposed else one for name, one in tables.items()},
        format="4",
    )
    return path


@pytest.mark.parametrize("kind", ["binTrans", "binNormal"])
def test_trajectories_have_their_names_units_and_signs(tmp_path: Path, kind: str) -> None:
    """Channels were called `data_2.0`, `dataInfo.1`: names and units were lost without a word."""
    with pytest.warns(tvident.recordings.FileWarning, match="not read: 1 constant variables of data_1"):
        recording = tvident.read_recording(written(tmp_path / "result.mat", kind))
    assert recording.units == {"Time": "s", "inertia.phi": "deg", "torque.tau": "N.m", "minus.phi": ""}
    np.testing.assert_array_equal(recording["minus.phi"], -np.degrees(RIG.angle))
    found = tvident.identify(recording["inertia.phi"], recording["tau"], sample_rate=recording.sample_rate)
    assert found.value("inertia").value == pytest.approx(0.0123, rel=0.02)


def test_a_result_that_does_not_say_where_variables_are_is_refused(tmp_path: Path) -> None:
    with pytest.raises(tvident.recordings.FileError, match="it names 5, and tells of 4"):
        tvident.read_recording(written(tmp_path / "result.mat", "binTrans", ABOUT[:4]))
    other = ABOUT.copy()
    other[2, 1] = 9
    with pytest.warns(tvident.recordings.FileWarning, match=r"torque\.tau \(no column 9 of table 2\)"):
        assert "torque.tau" not in tvident.read_recording(written(tmp_path / "odd.mat", "binTrans", other))
