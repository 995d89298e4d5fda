"""Clocks in several columns: hours, minutes and seconds are one channel of times, and what only looks like that is none."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import recordings

COUNT, RATE = 3000, 500
BEGIN = np.datetime64("2023-12-31T23:59:57.000")
INSTANTS = BEGIN + (1000 // RATE * np.arange(COUNT)).astype("timedelta64[ms]")
ANGLE = np.sin(np.arange(COUNT) / 20)
MILLISECONDS = INSTANTS.astype(np.int64)


def written(folder: Path, header: str, columns: Sequence[npt.NDArray[Any]]) -> Path:
    path = folder / "record.csv"
    rows = zip(*columns, ANGLE.tolist(), strict=True)
    path.write_text("\n".join([f"{header},angle", *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def parts(*, with_date: bool, whole_seconds: bool) -> list[npt.NDArray[Any]]:
    days = INSTANTS.astype("datetime64[D]")
    of_day = MILLISECONDS - days.astype(np.int64) * 86_400_000
    clock: list[npt.NDArray[Any]] = [of_day // 3_600_000, of_day // 60_000 % 60]
    rest = of_day % 60_000
    clock.extend([rest // 1000, rest % 1000] if whole_seconds else [rest / 1000])
    months = days.astype("datetime64[M]")
    date = [
        months.astype("datetime64[Y]").astype(int) + 1970,
        months.astype(int) % 12 + 1,
        (days - months).astype(int) + 1,
    ]
    return [*date, *clock] if with_date else clock


@pytest.mark.parametrize(
    ("header", "with_date", "whole_seconds"),
    [
        ("hour,minute,second", False, False),
        ("H,M,S,ms", False, True),
        ("Hour [h],Min [min],Sec [s]", False, False),
        ("Year,Month,Day,Hour,Minute,Second", True, False),
        ("Y,M,D,h,m,s", True, False),
        ("YYYY,MM,DD,HH,MM,SS", True, False),
        ("yyyy,mm,dd,hh,mm,ss,fff", True, True),
        ("time_hour,time_min,time_sec,time_millisecond", False, True),
        ("Stunde,Minute,Sekunde", False, False),
        ("heure,minute,seconde,millisecondes", False, True),
        ("hora,minuto,segundo,milisegundo", False, True),
    ],
)
def test_hours_minutes_and_seconds_are_one_clock_over_midnight(
    tmp_path: Path, header: str, with_date: bool, whole_seconds: bool
) -> None:
    """No channel told the times, and the rate was asked for."""
    path = written(tmp_path, header, parts(with_date=with_date, whole_seconds=whole_seconds))
    with pytest.warns(recordings.FileWarning) as said:
        recording = tvident.read_recording(path)
    assert "are the parts of one clock: read together as 'time [s]'" in str(said[-1].message)
    assert list(recording) == ["time", "angle"]
    assert recording.sample_rate == RATE
    np.testing.assert_allclose(np.asarray(recording.time), 86_397 + np.arange(COUNT) / RATE, rtol=0, atol=1e-6)


def test_a_clock_of_minutes_begins_again_with_the_hour(tmp_path: Path) -> None:
    path = written(tmp_path, "min,sec", parts(with_date=False, whole_seconds=False)[1:])
    with pytest.warns(recordings.FileWarning, match="of the hour"):
        assert tvident.read_recording(path).sample_rate == RATE


@pytest.mark.parametrize(
    ("header", "columns"),
    [
        # A path in m and s, masses, a month that has no such day, seconds that go back, minutes beyond 59, and a clock beside.
        ("m,s", [np.ones(COUNT), np.linspace(0, 9, COUNT)]),
        ("h,m,s", [np.full(COUNT, 1.5), np.ones(COUNT), np.linspace(0, 9, COUNT)]),
        (
            "year,month,day,hour,minute,second",
            [np.full(COUNT, one) for one in (2023, 2, 30, 1, 1)] + [np.linspace(0, 9, COUNT)],
        ),
        ("hour,minute,second", [np.ones(COUNT), np.ones(COUNT), np.linspace(9, 0, COUNT)]),
        ("hour,minute,second", [np.ones(COUNT), np.full(COUNT, 75), np.linspace(0, 9, COUNT)]),
        ("hour,minute,second,time", [*parts(with_date=False, whole_seconds=False), np.arange(COUNT) / RATE]),
    ],
)
def test_what_is_no_clock_stays_as_it_is(tmp_path: Path, header: str, columns: Sequence[npt.NDArray[Any]]) -> None:
    path = written(tmp_path, header, columns)
    with warnings.catch_warnings():
        warnings.simplefilter("error", recordings.FileWarning)
        assert list(tvident.read_recording(path)) == [*header.split(","), "angle"]
