from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt
import pytest

import tvident

Work = Callable[[npt.NDArray[np.float64], int], object]

WORKS: dict[str, Work] = {
    "fit_local_polynomials": lambda y, workers: tvident.fit_local_polynomials(y, 201, workers=workers),
    "rolling_least_squares": lambda y, workers: tvident.rolling_least_squares(y, y, 201, workers=workers),
    "identify": lambda y, workers: tvident.identify(y, y, sample_rate=1000, workers=workers),
    "identify constant": lambda y, workers: tvident.identify(
        y, y, sample_rate=1000, workers=workers, inertia="constant", damping="constant", stiffness="constant"
    ),
    "savgol_filter": lambda y, _workers: tvident.savgol_filter(y, 201, 5),
}
SAMPLES = {"savgol_filter": 60_000_000, "fit_local_polynomials": 12_000_000}


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("name", list(WORKS))
def test_ctrl_c_is_raised_within_a_tenth_of_a_second(name: str, workers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TVIDENT_WORKERS", str(workers))
    y = np.random.default_rng(0).standard_normal(SAMPLES.get(name, 3_000_000))
    WORKS[name](y[:1000], workers)
    sent = []

    def interrupt() -> None:
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    def work() -> None:
        WORKS[name](y, workers)
        time.sleep(0.2)  # it was faster than the timer

    timer = threading.Timer(0.05, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        work()
    elapsed = time.perf_counter() - sent[0]
    timer.join()
    # What was said is 0.1 s; a busy machine may be slow to hand the signal over.
    assert elapsed < 0.2


def _in_child(y: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return tvident.fit_local_polynomials(y, 51, workers=2).derivatives


@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork")
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_it_works_in_child_processes(method: str) -> None:
    y = np.random.default_rng(0).standard_normal(100_000)
    expected = _in_child(y)  # the pool has threads now
    with multiprocessing.get_context(method).Pool(2) as pool:
        for found in pool.map(_in_child, [y, y, y]):
            np.testing.assert_array_equal(found, expected)


def test_it_works_inside_other_thread_pools() -> None:
    y = np.random.default_rng(0).standard_normal(200_000)
    expected = _in_child(y)
    with ThreadPoolExecutor(5) as pool:
        for found in pool.map(_in_child, [y] * 10):
            np.testing.assert_array_equal(found, expected)


def test_what_progress_raises_is_raised_however_long_the_threads_take_to_stop() -> None:
    # With 16 regressors and windows of 10 000 rows a piece takes longer than the watch waits, so it looks again after the call.
    A = np.random.default_rng(0).standard_normal((320_000, 16))
    calls = []

    def refuse(done: int, total: int) -> None:
        calls.append((done, total))
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        tvident.rolling_least_squares(A, A[:, 0], 10_000, workers=2, progress=refuse)
    assert len(calls) == 1
