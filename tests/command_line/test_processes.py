"""Commands as processes: memory that runs out, closed pipes, progress on terminals, interrupts."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import textwrap
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from commands import TVIDENT

GOOD = ("--angle", "angle", "--torque", "torque", "--sample-rate", "1000")


def test_memory_that_runs_out_is_one_line(tmp_path: Path) -> None:
    # An array of 800 MB in an address space of 1 GB.
    command = f"ulimit -v 1000000; exec '{TVIDENT}' simulate rig.csv --duration 99999"
    done = subprocess.run(["/bin/sh", "-c", command], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "more memory than there is" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_reader_that_has_had_enough_is_no_error(tmp_path: Path) -> None:
    tvident.simulate_torsional_rig(5.0, seed=3).save(tmp_path / "rig.csv")
    command = [TVIDENT, "identify", str(tmp_path / "rig.csv"), *GOOD, "-o", "-"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.read(4) == b"time"
        process.stdout.close()
        errors = process.stderr.read().decode()
    assert "Error" not in errors
    assert "Traceback" not in errors


def long_recording(folder: Path, samples: int) -> None:
    t = np.arange(samples) / 1000
    noise = np.random.default_rng(0).standard_normal((2, samples))
    waves = [(0.3 * np.sin(w * t), w) for w in (9.0, 23.0, 41.0)]
    np.save(folder / "a.npy", sum(wave for wave, _ in waves) + 1e-3 * noise[0])
    np.save(folder / "t.npy", sum((13 - 0.0123 * w**2) * wave for wave, w in waves) + 0.1 * noise[1])


@pytest.mark.slow
def test_progress_is_shown_on_a_terminal_and_not_in_a_pipe(tmp_path: Path) -> None:
    long_recording(tmp_path, 150_000)
    command = [TVIDENT, "identify", "--angle", "a.npy", "--torque", "t.npy", "--sample-rate", "1000"]
    command += ["--angle-unit", "rad", "--torque-unit", "N m"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    parent, child = pty.openpty()
    fcntl.ioctl(child, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=child)
    os.close(child)
    shown = b""
    while True:
        if select.select([parent], [], [], 0.2)[0]:
            try:
                shown += os.read(parent, 4096)
            except OSError:
                break
        elif process.poll() is not None:
            break
    os.close(parent)
    process.communicate()
    assert b"identification" in shown
    assert b"100%" in shown


def is_aborted(folder: Path, body: str, seconds: float) -> None:
    """Check that a command which does this is interrupted, in so many seconds."""
    script = """
        import time
        from tvident._command_line import group

        class Commands:
            def info(self, *_, **__):
                {body}
                print("went on")

        group.commands = Commands
        group.main(["info", "a.csv"])
    """
    (folder / "a.csv").write_text("a\n1\n")
    whole = textwrap.dedent(script).format(body=textwrap.indent(textwrap.dedent(body).strip(), 8 * " ").strip())
    done = subprocess.run(
        [sys.executable, "-c", whole], cwd=folder, capture_output=True, text=True, check=False, timeout=seconds
    )
    assert (done.returncode, done.stdout, done.stderr.strip()) == (1, "", "Aborted!")


def test_an_interrupt_where_nothing_can_be_raised_is_heard(tmp_path: Path) -> None:
    # What runs when an object goes cannot raise; every import ends with that, and the first two seconds of a command are imports.
    body = """
        import signal, weakref
        gone = set()
        watched = weakref.ref(gone, lambda _: signal.raise_signal(signal.SIGINT))
        del gone
        time.sleep(20)
    """
    is_aborted(tmp_path, body, 19)


@pytest.mark.slow
@pytest.mark.parametrize(
    "module",
    [
        "try:\n    signal.raise_signal(signal.SIGINT)\n    time.sleep(0.1)\nexcept BaseException:\n    pass",
        "signal.raise_signal(signal.SIGINT)\ntime.sleep(20)",
    ],
    ids=["taken back", "long"],
)
def test_an_interrupt_within_an_import_is_heard_after_it_or_soon(tmp_path: Path, module: str) -> None:
    # Modules made by Cython, as lxml's, take back what is raised while they begin.
    (tmp_path / "imported.py").write_text(f"import signal\nimport time\n{module}\n")
    is_aborted(tmp_path, "import imported\ntime.sleep(20)", 15)


def test_an_interrupt_stops_at_once_and_leaves_no_half_written_file(tmp_path: Path) -> None:
    # Killed while it computes or writes: whichever, there is a whole file or none.
    long_recording(tmp_path, 3_000_000)
    command: list[Any] = [
        TVIDENT,
        "identify",
        "--angle",
        "a.npy",
        "--torque",
        "t.npy",
        "--sample-rate",
        "1000",
        "--method",
        "paper",
        "-o",
        "r.csv",
    ]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        # It says this before it begins, so that a fast machine has not ended and a slow one has begun.
        assert process.stderr.readline().startswith("Units: ")
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        started = time.perf_counter()
        _, errors = process.communicate()
    assert process.returncode == 1, errors
    assert "Aborted" in errors
    assert time.perf_counter() - started < 2
    assert "Traceback" not in errors
    assert {path.name for path in tmp_path.iterdir()} == {"a.npy", "t.npy"}
