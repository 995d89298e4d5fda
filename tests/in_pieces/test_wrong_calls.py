"""Wrong calls of ``identify_file`` say what would be right before anything is copied, and leave nothing behind."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from tvident import recordings
from tvident._in_pieces import copied

CALL: dict[str, Any] = {"angle": "angle", "torque": "torque", "sample_rate": 1000, "stiffness": "constant"}


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tvident.simulate_torsional_rig(duration=2.0).save("rig.csv")


def left() -> list[str]:
    return sorted(one.name for one in Path().iterdir() if one.name != "rig.csv")


@pytest.mark.parametrize(
    ("changed", "error", "message"),
    [
        ({"angle": None}, TypeError, "angle must be the name of a channel; got None; write 'angle', or its number"),
        ({"torque": 2}, TypeError, "torque must be the name of a channel; got 2; write 'angle', or its number"),
        ({"weights": [1.0]}, TypeError, r"weights must be the name of a channel; got \[1.0\]; "),
        ({"settings": 5}, TypeError, "settings must be those of an earlier result; got 5; pass result.settings"),
        ({"settings": [1]}, TypeError, r"settings must be those of an earlier result; got \[1\]; "),
        ({"sample_rate": b"1000"}, TypeError, "sample_rate must be a number; got b'1000'; "),
        ({"torque": "nope"}, KeyError, "has no channel 'nope'"),
        ({"torque_unit": "deg"}, ValueError, "the torque must be in a unit that can be converted to N m"),
        ({"stiffness": "x"}, ValueError, "must be"),
        ({"angle_unit": b"deg"}, TypeError, "angle_unit must be text; got bytes; write 'deg'"),
        ({"torque_unit": 1 + 2j}, TypeError, "torque_unit must be text; got complex; "),
        ({"terms": [()]}, ValueError, r"a term must be 'offset', 'coulomb', .*; got \(\); use one of these"),
        ({"terms": [("offset",)]}, ValueError, r"a term must be 'offset', .*; got \('offset',\); "),
        ({"terms": [("offset", "constant", 1)]}, ValueError, r"a term must be 'offset', .*; got \('offset', "),
    ],
)
def test_a_wrong_call_leaves_nothing(changed: dict[str, Any], error: type[Exception], message: str) -> None:
    """Words of Python, and beside the result a copy of the text that no other call could use, in a folder of a hidden name."""
    with pytest.raises(error, match=message):
        tvident.identify_file("rig.csv", "out.npy", **{**CALL, **changed})
    assert left() == []


def test_a_text_that_cannot_be_read_leaves_nothing() -> None:
    with Path("rig.csv").open("a") as file:
        file.write("2.0,0.1\n")
    with pytest.raises(recordings.FileError, match="every line must have 7 cells"):
        tvident.identify_file("rig.csv", "out.npy", **CALL)
    assert left() == []


@pytest.mark.parametrize("rate", [np.float32(1000), np.int64(1000)])
def test_a_sample_rate_may_be_a_number_of_numpy(rate: Any) -> None:
    """It ended in "Object of type float32 is not JSON serializable"."""
    found = tvident.identify_file("rig.csv", "out.npy", **{**CALL, "sample_rate": rate})
    assert found.samples == 2000
    assert left() == ["out.npy"]


def test_what_progress_raises_leaves_the_copy_of_the_text(monkeypatch: pytest.MonkeyPatch) -> None:
    """An hour of text was copied anew after an error of the caller's own."""

    def progress(*_: int) -> None:
        raise ValueError("mine")

    with pytest.raises(ValueError, match="mine"):
        tvident.identify_file("rig.csv", "found.npy", **CALL, progress=progress)
    assert left()
    monkeypatch.setattr(copied, "copy_text", None)
    tvident.identify_file("rig.csv", "found.npy", **CALL)
    assert left() == ["found.npy"]


def test_a_rate_that_the_times_of_the_recording_contradict_is_said(recwarn: pytest.WarningsRecorder) -> None:
    """Half the rate made the inertia four times too large, without a word."""
    tvident.identify_file("rig.csv", "right.npy", **CALL)
    assert not recwarn
    with pytest.warns(
        recordings.FileWarning, match=r"time of rig\.csv shows 1000 Hz, not 500, which is used: .*; give that channel"
    ):
        tvident.identify_file("rig.csv", "wrong.npy", **CALL | {"sample_rate": 500})
