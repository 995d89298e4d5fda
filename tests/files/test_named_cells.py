"""Lines of cells with names of their own, as microcontrollers print them for a plotter."""

from __future__ import annotations

import warnings
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import tvident
from tvident import recordings

COUNT = 100
TIME = np.round(np.arange(COUNT) / 500, 6)
ANGLE, TORQUE = np.round(np.sin(30 * TIME), 6), np.round(np.cos(30 * TIME), 6)
ROWS = list(zip(TIME.tolist(), ANGLE.tolist(), TORQUE.tolist(), strict=True))


def read(folder: Path, content: str) -> tvident.FileRecording:
    (folder / "run.log").write_text(content)
    return tvident.read_recording(folder / "run.log")


def lines(form: str) -> str:
    return "".join(f"{form.format(*row)}\n" for row in ROWS)


@pytest.mark.parametrize(
    "form",
    [
        "time:{0},angle [deg]:{1},torque:{2}",
        "time:{0}\tangle [deg]:{1}\ttorque:{2}",
        "time: {0}, angle [deg]: {1}, torque: {2}",
        "time={0}; angle [deg]={1}; torque={2};",
        "time={0} angle_deg={1} torque={2}",
    ],
)
def test_names_in_every_line_are_those_of_channels(tmp_path: Path, form: str) -> None:
    """Such a log held "no numbers"."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = read(tmp_path, lines(form))
    assert found["angle_deg" if "angle_deg" in form else "angle"].unit == "deg"
    assert found.sample_rate == 500
    for place, values in enumerate((TIME, ANGLE, TORQUE)):
        np.testing.assert_array_equal(found[list(found)[place]], values)


def test_what_was_cut_or_is_words_is_said(tmp_path: Path) -> None:
    content = lines("time:{0},angle:{1},torque:{2}")
    # Somebody began to listen in the middle of a line, and stopped in another.
    content = content[9:-3].replace("time:0.1,", "restarted\ntime:0.1,")
    with pytest.warns(recordings.FileWarning, match="3 lines are not read, as line 1: no names with values: "):
        found = read(tmp_path, content)
    np.testing.assert_array_equal(found["torque"], TORQUE[1:-1])
    with pytest.raises(recordings.FileError, match="line 3 must hold numbers; it has 'x' in column 'angle'"):
        read(tmp_path, lines("time:{0},angle:{1},torque:{2}").replace(f"angle:{ANGLE[2]},", "angle:x,"))


@pytest.mark.parametrize(
    "content",
    [
        "Rate: 500 Hz\nDevice: 7\ntime,angle\n" + "".join(f"{t},{a}\n" for t, a, _ in ROWS),
        "time,angle\n" + "".join(f"10:00:{t:06.3f},{a}\n" for t, a, _ in ROWS),
        "".join(f"# gain = {k}\n" for k in range(8)) + "time,angle\n" + "".join(f"{t},{a}\n" for t, a, _ in ROWS),
    ],
)
def test_columns_below_such_lines_are_columns(tmp_path: Path, content: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", recordings.FileWarning)
        found = read(tmp_path, content)
    assert list(found) == ["time", "angle"]
    np.testing.assert_array_equal(found["angle"], ANGLE)


def test_times_of_plotjuggler_are_known(tmp_path: Path) -> None:
    """`__time` was no channel of times."""
    found = read(tmp_path, "__time,/joint/position\n" + "".join(f"{1.7e9 + t:.6f},{a}\n" for t, a, _ in ROWS))
    assert found.sample_rate == pytest.approx(500)


@pytest.mark.parametrize("odd", ["angle:{}x", "angle{}:1", "angle{}x", "{}", "angle:1{},"])
def test_long_runs_of_blanks_take_no_time(tmp_path: Path, odd: str) -> None:
    """Each blank was tried as the end of a value with all that follow: minutes for a line."""
    content = lines("time:{0},angle:{1},torque:{2}") + f"time:1,{odd.format(' ' * 300_000)}\n"
    for place in (content, "".join(reversed(content.splitlines(keepends=True)))):
        (tmp_path / "run.log").write_text(place)
        with warnings.catch_warnings(), suppress(recordings.FileError):
            warnings.simplefilter("ignore", recordings.FileWarning)
            assert recordings.read(tmp_path / "run.log")["torque"].size >= COUNT
