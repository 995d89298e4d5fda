"""What is kept while the next piece is worked on is kept in order, and nothing of it is lost."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tvident
from in_pieces.small_pieces import cut_small
from tvident._in_pieces.behind import Behind
from tvident._in_pieces.kept import Kept


def test_one_thing_after_the_other() -> None:
    done: list[tuple[int, str]] = []

    def keeps(number: int) -> Callable[[], None]:
        return lambda: done.append((number, threading.current_thread().name))

    for is_apart in (True, False):
        done.clear()
        with Behind(is_apart=is_apart) as behind:
            for number in range(20):
                behind.do(keeps(number))
                assert len(done) >= number
        assert [number for number, _ in done] == list(range(20))
        assert {name == threading.current_thread().name for _, name in done} == {not is_apart}


def test_an_error_is_raised_where_the_next_is_asked_for_and_at_the_end() -> None:
    def fails() -> None:
        raise OSError(28, "no room")

    with Behind(is_apart=True) as behind:
        behind.do(fails)
        with pytest.raises(OSError, match="no room"):
            behind.do(lambda: pytest.fail("after an error nothing is done"))
    with pytest.raises(OSError, match="no room"), Behind(is_apart=True) as behind:
        behind.do(fails)


def test_what_was_asked_for_is_done_after_an_interruption() -> None:
    may, done = threading.Event(), []

    def keeps() -> None:
        may.wait(10)
        done.append(1)

    def interrupted() -> None:
        with Behind(is_apart=True) as behind:
            behind.do(keeps)
            may.set()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert done


def test_a_full_disk_ends_the_call_and_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The third piece finds no room: two are kept, the next call goes on with the third, and the numbers are the same."""
    cut_small(monkeypatch, tmp_path)
    rig = tvident.simulate_torsional_rig(duration=60.0)
    np.save(tmp_path / "in.npy", np.stack([rig.angle, rig.torque], axis=1))
    output = tmp_path / "out.npy"
    output.write_bytes(b"earlier")
    add, count = Kept.add, []

    def full(kept: Kept, *given: object) -> None:
        count.append(1)
        if len(count) == 3:
            raise OSError(28, "No space left on device")
        add(kept, *given)  # type: ignore[arg-type] # as it was called

    def call() -> tvident.FileIdentification:
        return tvident.identify_file(
            tmp_path / "in.npy", output, angle="0", torque="1", sample_rate=1000.0, method="paper"
        )

    monkeypatch.setattr(Kept, "add", full)
    with pytest.raises(OSError, match="No space left"):
        call()
    assert output.read_bytes() == b"earlier"
    before = len(count)
    call()
    whole = tvident.identify(rig.angle, rig.torque, sample_rate=1000.0, method="paper")
    rows = np.load(output)
    assert before == 3
    for name in ("inertia", "damping", "stiffness"):
        assert np.array_equal(rows[name], getattr(whole, name), equal_nan=True)
    assert not (tmp_path / ".out.npy.tvident").exists()
