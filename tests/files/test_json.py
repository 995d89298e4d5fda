"""JSON as loggers and robots write it, an object a line, and as scripts write channels; and logs of columns."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import tvident
from tvident import recordings
from tvident._command_line import main

COUNT = 64
TIME = np.arange(COUNT) / 500
ANGLE, TORQUE = np.sin(30 * TIME), np.cos(30 * TIME)
ROWS = [
    {"time": t, "joint": {"angle [deg]": a, "torque": m}}
    for t, a, m in zip(TIME.tolist(), ANGLE.tolist(), TORQUE.tolist(), strict=True)
]
LINES = "".join(f"{json.dumps(row)}\n" for row in ROWS)


def read(folder: Path, content: str, name: str = "run.jsonl") -> tvident.FileRecording:
    (folder / name).write_text(content)
    return tvident.read_recording(folder / name)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("run.jsonl", LINES),
        ("run.ndjson", LINES.replace("\n", "\r\n\r\n")),
        ("run.json", LINES),
        ("run.json", json.dumps(ROWS, indent=1)),
        (
            "run.json",
            json.dumps(
                {
                    "time": TIME.tolist(),
                    "joint": {"angle": ANGLE.tolist(), "torque": TORQUE.tolist(), "units": {"angle": "deg"}},
                    "rig": "number three",
                }
            ),
        ),
        (
            "run.json",
            json.dumps(
                {
                    name: {str(place): value for place, value in enumerate(values.tolist())}
                    for name, values in (("time", TIME), ("joint.angle [deg]", ANGLE), ("joint.torque", TORQUE))
                }
            ),
        ),
        (
            "run.json",
            json.dumps(
                {
                    "columns": ["time", "joint.angle [deg]", "joint.torque"],
                    "data": np.stack([TIME, ANGLE, TORQUE], 1).tolist(),
                }
            ),
        ),
    ],
)
def test_samples_come_back_to_the_last_bit(tmp_path: Path, name: str, content: str) -> None:
    """Such files were refused for their ending, and NumPy was to convert them."""
    recording = read(tmp_path, content, name)
    assert recording.units == {"time": "", "joint.angle": "deg", "joint.torque": ""}
    assert recording.sample_rate == 500
    for channel, expected in (("time", TIME), ("angle", ANGLE), ("torque", TORQUE)):
        np.testing.assert_array_equal(recording[channel], expected)


def test_a_robot_s_log_is_identified_from_the_command_line(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=4.0)
    rows = zip(rig.time.tolist(), np.degrees(rig.angle).tolist(), rig.torque.tolist(), strict=True)
    (tmp_path / "run.jsonl").write_text(
        "".join(f'{{"stamp": {t!r}, "angle [deg]": {a!r}, "torque": {m!r}}}\n' for t, a, m in rows)
    )
    told = CliRunner().invoke(
        main, ["identify", str(tmp_path / "run.jsonl"), *["--angle", "angle", "--torque", "torque", "--time", "stamp"]]
    )
    assert told.exit_code == 0
    assert told.stdout.startswith("K(t) known to")


def test_times_in_words_missing_members_and_words_are_read_or_said(tmp_path: Path) -> None:
    lines: list[dict[str, Any]] = [
        {"t": "2024-12-31T12:30:00.000Z", "a": 1, "state": "on", "on": True},
        {"t": "2024-12-31T12:30:00.500Z", "a": None, "state": "on", "on": False},
        {"t": "2024-12-31T12:30:01.000Z", "a": "nan", "b": 2.5, "state": "off", "on": True},
        {"t": "2024-12-31T12:30:01.500Z", "a": "4.5", "b": 3.5, "state": "off", "on": True},
    ]
    with pytest.warns(recordings.FileWarning) as said:
        found = read(tmp_path, "".join(f"{json.dumps(one)}\n" for one in lines))
    assert {name: values.tolist() for name, values in found.items() if name != "a"} == {
        "t": [0, 0.5, 1, 1.5],
        "on": [1, 0, 1, 1],
        "b": pytest.approx([np.nan, np.nan, 2.5, 3.5], nan_ok=True),
    }
    np.testing.assert_array_equal(found["a"], [1, np.nan, np.nan, 4.5])
    words = " ".join(str(one.message) for one in said)
    assert "column 't' holds times: read as seconds since 2024-12-31T12:30:00.000Z" in words
    assert "column 'state': not read, it holds words: 'on'" in words
    assert "2 of 4 samples have no 'b': missing values" in words


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('{"t": 0, "a": 1}\n{"t": 1, "a": }\n{"t": 2, "a": 3}\n', "line 2 does not"),
        ('{"t": 0, "a": 1}\n{"t": 1, "a": "broken"}\n', "line 2 must hold numbers; it has 'broken' in column 'a'"),
        ('{"t": 0, "a": 1, "a": 2}\n', "one has 'a' twice"),
        ('{"t": 0, "a": 1}\n7\n', "it holds|line 2 does not|2 is 7"),
        ('{"t": 0, "a": 1', "JSON must be whole"),
        ('{"t": 0, "a": 1' + "0" * 400 + "}\n", "must hold numbers"),
        ('{"t": 0, "a": 1' + "0" * 5000 + "}\n", "too many digits"),
        ('{"t": ' + '{"a": ' * 40 + "1" + "}" * 41 + "\n", "at most 20 deep"),
        ('{"t": ' + "[" * 100_000 + "\n", "deep|whole"),
        ('"nothing"', "holds nothing alone"),
        ("", "holds no numbers"),
        ("[]", "holds no numbers"),
        ('{"t": "01/05/2024 12:30:00", "a": 1}\n{"t": "01/06/2024 12:30:00", "a": 1}\n', "2024-12-31T12:30"),
    ],
)
def test_what_is_damaged_is_refused_with_its_line_and_the_cure(tmp_path: Path, content: str, said: str) -> None:
    with pytest.raises(recordings.FileError, match=said) as caught:
        read(tmp_path, content)
    assert len(str(caught.value)) < 500


def test_a_last_line_that_was_cut_is_said(tmp_path: Path) -> None:
    with pytest.warns(recordings.FileWarning, match="line 64 has no end and is no whole object: not read"):
        found = read(tmp_path, LINES[:-20])
    np.testing.assert_array_equal(found["angle"], ANGLE[:-1])


def test_objects_in_a_file_that_is_called_as_text_are_known(tmp_path: Path) -> None:
    for name in ("run.log", "run.txt", "run.csv"):
        with pytest.raises(recordings.FileError, match=r"rename it to run\.jsonl, say"):
            read(tmp_path, LINES, name)
    with pytest.raises(recordings.FileError, match=r"rename it to run\.csv, say"):
        read(tmp_path, "time,angle\n0,1\n1,2\n", "run.jsonl")


@pytest.mark.parametrize("between", [" ", "\t", ";", "   "])
def test_a_log_of_columns_is_text(tmp_path: Path, between: str) -> None:
    """Its ending was refused, though it is what loggers and microcontrollers write."""
    lines = [between.join(["time", "angle[deg]", "torque"])]
    lines += [between.join(map(repr, row)) for row in zip(TIME.tolist(), ANGLE.tolist(), TORQUE.tolist(), strict=True)]
    recording = read(tmp_path, "\n".join(lines) + "\n", "run.log")
    assert recording.units == {"time": "", "angle": "deg", "torque": ""}
    np.testing.assert_array_equal(recording["torque"], TORQUE)
    assert recording.sample_rate == 500


@pytest.mark.parametrize("name", ["run.jsonl", "run.json"])
def test_samples_that_are_all_alike_are_read_as_others(tmp_path: Path, name: str) -> None:
    """They are read at once, those that differ one by one."""
    rows: list[dict[str, Any]] = [
        {"time": t, "angle": a, "count": n, "on": n % 2 == 0, "none": float("nan")}
        for n, (t, a) in enumerate(zip(TIME.tolist(), ANGLE.tolist(), strict=True))
    ]

    def text(rows: list[dict[str, Any]]) -> str:
        return json.dumps(rows) if name == "run.json" else "".join(f"{json.dumps(row)}\n" for row in rows)

    alike = read(tmp_path, text(rows), name)
    rows[3] = dict(reversed(rows[3].items()))
    turned = read(tmp_path, text(rows), name)
    rows[3] = {"time": str(rows[3]["time"]), **{key: one for key, one in rows[3].items() if key != "time"}}
    one_by_one = read(tmp_path, text(rows), name)
    assert list(alike) == list(turned) == ["time", "angle", "count", "on", "none"]
    for channel, values in alike.items():
        np.testing.assert_array_equal(values, turned[channel])
        np.testing.assert_array_equal(values, one_by_one[channel])
    np.testing.assert_array_equal(alike["angle"], ANGLE)
    np.testing.assert_array_equal(alike["on"], (np.arange(COUNT) + 1) % 2)
    with pytest.raises(recordings.FileError, match=r"must hold|is not a number|has too many digits|has .1000"):
        read(tmp_path, text([{"time": 10**400}, {"time": 1}]), name)
