from __future__ import annotations

import gc
import subprocess
import sys
import weakref
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tvident
from parameters import long

MIB = 2**20
HOUR = 3_600_000
"""Samples of an hour at 1 kHz."""
HELD_FOR_AN_HOUR = 400 * MIB
"""Promised: what `identify` holds above its inputs, all results kept."""
OF_RESULTS = 59
"""Bytes a sample of what the automatic method finds of a stiffness: seven columns of numbers and two of flags."""
BESIDE_RESULTS = 16
"""Promised: bytes a sample that the automatic method needs beside inputs and results."""
SCRATCH = 8 * MIB
"""Promised: scratch of a thread for windows up to 10 000."""
LONGEST = 10_000


@pytest.mark.parametrize("name", ["fit_local_polynomials", "rolling_least_squares", "identify"])
def test_a_result_goes_when_it_is_let_go(name: str) -> None:
    y = np.random.default_rng(0).standard_normal(2000)
    calls: dict[str, Callable[[], object]] = {
        "fit_local_polynomials": lambda: tvident.fit_local_polynomials(y, 51),
        "rolling_least_squares": lambda: tvident.rolling_least_squares(y, y + 1, 51),
        "identify": lambda: tvident.identify(y, y + 1, sample_rate=1000, method="paper"),
    }
    gc.disable()
    try:
        result = calls[name]()
        if isinstance(result, tvident.Identification):
            assert len(result.columns()) > 0  # everything that is computed when asked for
        gone = weakref.ref(result)
        del result
        assert gone() is None
    finally:
        gc.enable()


def risen_by(name: str, samples: int, window: int, workers: int) -> int:
    """Return the bytes by which a call raises the peak of a process of its own."""
    if not Path("/proc/self/clear_refs").exists():
        pytest.skip("only Linux keeps a record of the most memory held that can be cleared")
    command = [sys.executable, str(Path(__file__).with_name("peak_memory.py")), name, str(samples), str(window)]
    finished = subprocess.run([*command, str(workers)], check=True, capture_output=True, text=True)
    return int(finished.stdout)


@pytest.mark.slow
def test_an_hour_fits_into_400_mib_with_all_its_results() -> None:
    assert risen_by("the paper's method", HOUR, 201, workers=2) < HELD_FOR_AN_HOUR


@pytest.mark.slow
def test_the_automatic_method_needs_little_beside_inputs_and_results() -> None:
    assert risen_by("the automatic method", HOUR, 0, workers=1) < (OF_RESULTS + BESIDE_RESULTS) * HOUR


@pytest.mark.slow
@pytest.mark.parametrize(
    ("window", "workers"), [(3000, 2), (LONGEST, 1), *long((201, 1), (201, 2), (3000, 1), (LONGEST, 2))]
)
@pytest.mark.parametrize(
    "name", ["fit_local_polynomials", "rolling_least_squares", "identify, window", "identify, regression window"]
)
def test_scratch_of_a_thread_stays_small(name: str, window: int, workers: int) -> None:
    samples = 320_000  # four rounds of 10 000 windows in the lanes of the widest vectors: work for two threads
    # The time of every sample is a result; it is computed from their numbers.
    in_numpy = 2 * 8 * samples if name.startswith("identify") else 0
    # The allocator may hold a few hundred kilobytes more from one run to the next, never less than is needed: one of few runs counts.
    runs = range(3 if window == LONGEST else 1)
    assert any(risen_by(name, samples, window, workers) - in_numpy < workers * SCRATCH for _ in runs)
