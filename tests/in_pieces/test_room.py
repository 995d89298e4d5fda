"""Room on the disk for a result: asked for before the work, and told where there is none."""

from __future__ import annotations

import errno
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from tvident._in_pieces import call, kept

SAMPLES = 40_001
CALL: dict[str, Any] = {"angle": "0", "torque": "1", "sample_rate": 1000}


@pytest.fixture(autouse=True)
def _record_of_some_pieces(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(call, "PIECE", 10_000)
    monkeypatch.chdir(tmp_path)
    rig = tvident.simulate_torsional_rig(duration=SAMPLES / 1000, sample_rate=1000, seed=5)
    rows = np.stack([rig.angle, rig.torque], axis=1)
    np.save("in.npy", rows)
    np.save("short.npy", rows[:9000])


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nobody can be asked")
def test_room_for_all_rows_is_asked_for_before_the_first() -> None:
    found: list[tuple[int, int]] = []

    def look(_done: int, _total: int) -> None:
        rows = Path(".out.npy.tvident/rows")
        if rows.exists():
            found.append((rows.stat().st_blocks * 512, rows.stat().st_size))

    tvident.identify_file("in.npy", "out.npy", **CALL, method="paper", progress=look)
    size = Path("out.npy").stat().st_size
    assert min(room for room, _ in found) >= size
    assert min(written for _, written in found) < size / 2  # how much was written is still to be seen


def test_a_disk_without_room_is_told_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_file: object, size: int) -> None:
        asked.append(size)
        raise OSError(errno.ENOSPC, "No space left on device")

    asked, done = list[int](), list[int]()
    monkeypatch.setattr(kept, "make_room", full)
    for calls in (1, 2):  # the second time too
        with pytest.raises(OSError, match=r"No space left.*out\.npy"):
            tvident.identify_file(
                "in.npy", "out.npy", **CALL, method="paper", progress=lambda so_far, _: done.append(so_far)
            )
        assert len(asked) == calls
        assert asked[-1] > 75 * SAMPLES
        assert max(done) < SAMPLES / 3  # the first piece
        assert not Path("out.npy").exists()
    # Where nothing is done yet nothing is kept.
    with pytest.raises(OSError, match=r"No space left.*out\.npy"):
        tvident.identify_file("short.npy", "out.npy", **CALL)
    assert {one.name for one in Path().iterdir()} == {"in.npy", "short.npy"}
