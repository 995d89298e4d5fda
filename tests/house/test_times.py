"""Times that are promised: of the command's first words, of the import, and of a report of an hour. Alone on the machine.

The least of several runs counts, the median where two programs are compared in turns, and processor time where other work on the machine
may hold a program up: it makes both longer, never shorter. A slower machine may take longer by as much as NumPy takes longer to load there.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest

import tvident

RUNS = 10

BUILT = 2.0
"""Seconds for a report of an hour, of two processors."""

BUSY = 1.5
"""Times that in processor time, where other work holds the report up: it is packed on two processors."""

MOST_BYTES = 25e6

LOADED = 0.15
"""Seconds for the interpreter with NumPy, where the times were promised."""

NUMPY = ("-c", "import numpy")


def seconds_of_each(*programs: tuple[str, ...]) -> list[list[float]]:
    """Give the processor times of the interpreter with the arguments of each, of its own start too; in turns, as minutes differ."""
    found: list[list[float]] = [[] for _ in programs]
    for _ in range(RUNS):
        for times, arguments in zip(found, programs, strict=True):
            program = subprocess.Popen([sys.executable, *arguments], stdout=subprocess.DEVNULL)
            _, status, used = os.wait4(program.pid, 0)
            program.returncode = os.waitstatus_to_exitcode(status)
            assert program.returncode == 0
            times.append(used.ru_utime + used.ru_stime)
    return found


def slower_by(numpy: float) -> float:
    """Give how much slower this machine is than those of the promise, from the seconds of NumPy now; never less than one."""
    return max(1.0, numpy / LOADED)


def slowness() -> float:
    """Give how much slower this machine is than those of the promise, now; never less than one."""
    return slower_by(min(seconds_of_each(NUMPY)[0])) if hasattr(os, "wait4") else 1.0


needs_wait4 = pytest.mark.skipif(not hasattr(os, "wait4"), reason="the system tells no processor time of a program")


@needs_wait4
@pytest.mark.parametrize(("option", "promised"), [("--help", 0.12), ("--version", 0.1)])
def test_the_first_words_of_the_command_take_a_moment(option: str, promised: float) -> None:
    seconds, numpy = seconds_of_each(("-m", "tvident", option), NUMPY)
    assert min(seconds) < promised * slower_by(min(numpy))


@needs_wait4
def test_the_import_takes_little_more_than_numpy() -> None:
    interpreter, numpy, imported, entered = seconds_of_each(
        ("-c", "pass"), NUMPY, ("-c", "import numpy, tvident"), ("-c", "import numpy, tvident; tvident.identify")
    )
    # Each is compared with what NumPy took in its turn: threads that NumPy starts wait in a loop, by turns shorter or longer.
    assert median(one - its for one, its in zip(imported, numpy, strict=True)) < 0.06
    # Rooms are entered when first asked for; those of `identify` are nearly all there are.
    turns = zip(entered, numpy, interpreter, strict=True)
    assert median((one - its) / (its - start) for one, its, start in turns) < 1.6


def test_the_report_of_an_hour_is_built_in_two_seconds(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(60.0, pattern="constant")
    generator = np.random.default_rng(0)
    channels = {f"noise {number} [V]": generator.standard_normal(3_600_000) for number in range(3)}
    kinds: Any = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")
    angle, torque = (np.tile(one, 60) for one in (rig.angle, rig.torque))
    result = tvident.identify(angle, torque, sample_rate=1000, method=tvident.StrongForm(), **kinds)
    elapsed, worked = [], []
    for _ in range(3):
        started, had_worked = time.perf_counter(), time.process_time()
        result.report(tmp_path / "hour.html", channels=channels)
        elapsed.append(time.perf_counter() - started)
        worked.append(time.process_time() - had_worked)
    most = BUILT * slowness()
    assert min(elapsed) < most or min(worked) < BUSY * most
    assert (tmp_path / "hour.html").stat().st_size < MOST_BYTES
