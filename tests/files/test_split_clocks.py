"""Clocks in two columns: whole seconds and parts of them are one channel of times, and what only looks like that is none."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import recordings

COUNT = 2500
PLACE = np.arange(COUNT)
ANGLE = np.sin(PLACE / 20)


def written(folder: Path, columns: Mapping[str, npt.NDArray[Any]]) -> Path:
    path = folder / "record.csv"
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("seconds", "parts", "per_second", "called"),
    [
        ("sec", "ms", 1000, "time [s]"),
        ("Time", "Millisecond", 1000, "Time [s]"),
        ("Unix", "usec", 10**6, "time [s]"),
        ("header.stamp.secs", "header.stamp.nsecs", 10**9, "header.stamp.time [s]"),
        ("stamp.sec", "stamp.nanosec", 10**9, "stamp.time [s]"),
        ("segundos", "milisegundos", 1000, "time [s]"),
        ("utc_sec", "utc_micros", 10**6, "time [s]"),
        ("ss", "fff", 1000, "time [s]"),
    ],
)
@pytest.mark.parametrize("begin", [0, 1_700_000_000])
def test_seconds_and_parts_of_them_are_one_clock(
    tmp_path: Path, seconds: str, parts: str, per_second: int, called: str, begin: int
) -> None:
    """A sample rate was missing, or the seconds were a clock of 1000 samples at one time."""
    path = written(
        tmp_path,
        {seconds: begin + PLACE // 500, parts: PLACE % 500 * (per_second // 500), "angle": ANGLE},
    )
    with pytest.warns(recordings.FileWarning, match=f"'{seconds}' holds whole seconds and '{parts}' parts of them"):
        recording = tvident.read_recording(path)
    assert recording.sample_rate == 500
    assert list(recording) == [called.removesuffix(" [s]"), "angle"]
    time = recording.time
    assert time is not None
    np.testing.assert_allclose(time - time[0], PLACE / 500, atol=1e-9)


def test_times_of_a_clock_and_their_milliseconds_are_one(tmp_path: Path) -> None:
    times = np.array([f"10:11:{12 + place // 1000:02d}" for place in PLACE])
    path = written(tmp_path, {"Time": times, "ms": PLACE % 1000, "angle": ANGLE})
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert tvident.read_recording(path).sample_rate == 1000
    assert any("read together as 'Time [s]'" in str(one.message) for one in said)


def test_lost_samples_stay_lost(tmp_path: Path) -> None:
    kept = np.delete(PLACE, [700, 1500])
    path = written(tmp_path, {"sec": kept // 1000, "ms": kept % 1000, "angle": ANGLE[kept]})
    with pytest.warns(recordings.FileWarning, match="read together"):
        time = tvident.read_recording(path).time
    assert time is not None
    np.testing.assert_allclose(time, kept / 1000, atol=1e-12)


@pytest.mark.parametrize(
    "columns",
    [
        {"time": PLACE // 1000, "loop_ms": PLACE % 7},
        {"time": PLACE // 100, "latency_ms": PLACE % 100},
        {"time": PLACE // 100, "ms": PLACE % 100},
        {"s": PLACE // 1000, "ms": PLACE},
        {"time": PLACE / 1000, "ms": PLACE % 1000},
        {"Second": (PLACE // 1000 + 58) % 60, "ms": PLACE % 1000},
        {"left.sec": PLACE // 1000, "right.ms": PLACE % 1000},
        {"sec": np.where(PLACE == 5, np.nan, PLACE // 1000), "ms": PLACE % 1000},
    ],
    ids=str,
)
def test_what_is_no_clock_in_two_columns_stays_as_it_is(tmp_path: Path, columns: dict[str, npt.NDArray[Any]]) -> None:
    path = written(tmp_path, {**columns, "angle": ANGLE})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = recordings.read(path)
    assert list(found) == [*columns, "angle"]
    for name, values in columns.items():
        np.testing.assert_array_equal(found[name], values)
