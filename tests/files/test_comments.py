"""Comments behind numbers and between rows, as programs of MATLAB and C write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tvident
from tvident import recordings

ROWS = [(place / 100, (place * 37 % 91) / 10, (place * 53 % 97) / 100) for place in range(60)]


def _lines(separator: str) -> list[str]:
    return [
        separator.join(("t[s]", "angle[deg]", "torque[Nm]")),
        *(separator.join(f"{one:.2f}" for one in row) for row in ROWS),
    ]


@pytest.mark.parametrize("mark", ["%", "//", "#"])
@pytest.mark.parametrize("separator", [",", ";", "\t", " "], ids=["comma", "semicolon", "tab", "blank"])
@pytest.mark.parametrize("behind", ["  {} bumped, 3 times", "{}touched", "\t{} Ann: was it late; or not?"])
@pytest.mark.parametrize("place", [1, 12, 60])
def test_a_comment_behind_numbers_is_no_cell(
    tmp_path: Path, mark: str, separator: str, behind: str, place: int
) -> None:
    """``%`` and ``//`` were refused, with the cure to "write 1234.5 without separators of thousands"."""
    lines = _lines(separator)
    lines[place] += behind.format(mark)
    path = tmp_path / "run.txt"
    path.write_text("\n".join(lines) + "\n")
    recording = tvident.read_recording(path)
    assert recording.sample_rate == pytest.approx(100.0)
    assert recording.units == {"t": "s", "angle": "deg", "torque": "Nm"}
    np.testing.assert_allclose(np.stack(list(map(np.asarray, recording.values())), axis=1), ROWS, rtol=1e-12)


@pytest.mark.parametrize("mark", ["%", "//", "#"])
def test_a_comment_between_rows_is_none(tmp_path: Path, mark: str) -> None:
    lines = _lines(",")
    path = tmp_path / "run.csv"
    path.write_text("\n".join([f"{mark} rig 3", *lines[:9], f"{mark} paused, 3 s", *lines[9:], f"  {mark} end", ""]))
    assert tvident.read_recording(path)["angle"].size == len(ROWS)


def test_names_that_begin_so_again_begin_another_recording(tmp_path: Path) -> None:
    lines = ["% t angle torque", *_lines(" ")[1:]]
    path = tmp_path / "run.txt"
    path.write_text("\n".join([*lines, *lines, ""]))
    with pytest.raises(recordings.FileError, match="must hold one recording; line 62 repeats"):
        recordings.read(path)


def test_a_column_of_words_with_a_percentage_stays_one(tmp_path: Path) -> None:
    """``50 % load`` is no number of a sample."""
    lines = [f"{line}," for line in _lines(",")]
    lines[0] += "note"
    lines[7] += "50 % load"
    path = tmp_path / "run.csv"
    path.write_text("\n".join([*lines, ""]))
    with pytest.warns(recordings.FileWarning, match="column 'note': not read, it holds words"):
        assert list(recordings.read(path)) == ["t[s]", "angle[deg]", "torque[Nm]"]


def test_words_behind_every_number_are_no_comments(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("\n".join(["angle,load", *(f"{place}.25,{place % 7} % load" for place in range(40)), ""]))
    with pytest.raises(recordings.FileError, match=r"'0 % load' in line 2 is no number.*; begin comments with #"):
        recordings.read(path)


@pytest.mark.parametrize(
    ("head", "rows", "words"),
    [
        ("time,remark,angle,torque", "{0:.3f},{1},{2:.6f},1.5", "0 % load"),
        ("time;remark;angle;torque", "{0:.3f};{1};{2:.6f};1,5", "0,0 % load"),
        ("time\tangle\tremark\ttorque", "{0:.3f}\t{2:.6f}\t{1}\t1,5", "0,0 // load"),
    ],
)
@pytest.mark.parametrize("place", [5, 900])
def test_a_remark_between_numbers_is_no_comment(tmp_path: Path, head: str, rows: str, words: str, place: int) -> None:
    """The cells behind it were cut off, and the text was refused: "every line must have 4 cells; line 7 has 2"."""
    path = tmp_path / "x.txt"
    lines = [rows.format(number / 1000, words if number == place else "", 0.5) for number in range(1500)]
    lines = [line.replace(".", ",") if ";" in head or "\t" in head else line for line in lines]
    path.write_text("\n".join([head, *lines]) + "\n")
    with pytest.warns(recordings.FileWarning, match="'remark': not read, it holds words"):
        channels = recordings.read(path)
    assert {name: values.size for name, values in channels.items()} == {"time": 1500, "angle": 1500, "torque": 1500}
    assert channels["torque"][place] == 1.5
