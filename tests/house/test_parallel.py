from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from calls import paper

for _name in tvident.__all__:
    # Rooms are loaded when first asked for, and an interrupt may come in the midst of that: not what is timed here.
    getattr(tvident, _name)

Work = Callable[[], object]
Prepare = Callable[[npt.NDArray[np.float64], int], Work]


def columns(y: npt.NDArray[np.float64], count: int) -> npt.NDArray[np.float64]:
    """Give so many regressors without copying the samples."""
    return np.lib.stride_tricks.sliding_window_view(y, count)


def errors_of_a_fit(y: npt.NDArray[np.float64], workers: int) -> Work:
    fit = tvident.fit_local_polynomials(y, 201, workers=workers)
    return lambda: fit.stderr


def ends_of_a_long_window(y: npt.NDArray[np.float64], _workers: int) -> Work:
    tvident.savgol_filter(y, y.size, 9)  # tables are kept for the next call
    return lambda: tvident.savgol_filter(y, y.size, 9)


def columns_of_a_result(y: npt.NDArray[np.float64], workers: int) -> Work:
    result = tvident.identify(y, y, sample_rate=1000, method="paper", workers=workers)
    return result.columns


WORKS: dict[str, tuple[int, Prepare]] = {
    "fit_local_polynomials": (
        12_000_000,
        lambda y, workers: lambda: tvident.fit_local_polynomials(y, 201, workers=workers),
    ),
    "fit_local_polynomials, fixed order": (
        12_000_000,
        lambda y, workers: lambda: tvident.fit_local_polynomials(y, 201, order=15, workers=workers),
    ),
    "fit_local_polynomials, long windows": (
        12_000_000,
        lambda y, workers: lambda: tvident.fit_local_polynomials(y, 100_001, workers=workers),
    ),
    "fit_local_polynomials, many records": (
        12_000_000,
        lambda y, workers: lambda: tvident.fit_local_polynomials(y.reshape(-1, 1000), 201, workers=workers),
    ),
    "errors of a fit": (12_000_000, errors_of_a_fit),
    "rolling_least_squares": (
        3_000_000,
        lambda y, workers: lambda: tvident.rolling_least_squares(y, y, 201, workers=workers),
    ),
    "rolling_least_squares, 16 regressors": (
        1_000_000,
        lambda y, workers: lambda: tvident.rolling_least_squares(columns(y, 16), y[15:], 201, workers=workers),
    ),
    "rolling_least_squares, 16 regressors, long windows": (
        1_000_000,
        lambda y, workers: lambda: tvident.rolling_least_squares(columns(y, 16), y[15:], 10_000, workers=workers),
    ),
    "identify": (
        3_000_000,
        lambda y, workers: lambda: tvident.identify(y, y, sample_rate=1000, method="paper", workers=workers),
    ),
    "identify, nothing to find": (
        1,
        lambda _y, workers: (
            lambda: tvident.identify(*2 * [np.broadcast_to(1.0, 8_000_000)], sample_rate=1000, workers=workers)
        ),
    ),
    "identify, long windows": (
        3_000_000,
        lambda y, workers: (
            lambda: tvident.identify(y, y, sample_rate=1000, **paper(regression_window=10_000, workers=workers))
        ),
    ),
    "identify, constant": (
        3_000_000,
        lambda y, workers: (
            lambda: tvident.identify(
                y,
                y,
                sample_rate=1000,
                method="paper",
                workers=workers,
                inertia="constant",
                damping="constant",
                stiffness="constant",
            )
        ),
    ),
    "identify, a term of one's own": (
        3_000_000,
        lambda y, workers: (
            lambda: tvident.identify(
                y,
                y,
                sample_rate=1000,
                method="paper",
                workers=workers,
                terms=[tvident.Term("drag", lambda _t, _angle, velocity: velocity)],
            )
        ),
    ),
    "columns of a result": (3_000_000, columns_of_a_result),
    "savgol_filter": (60_000_000, lambda y, _workers: lambda: tvident.savgol_filter(y, 201, 5)),
    "savgol_filter, aicc": (12_000_000, lambda y, _workers: lambda: tvident.savgol_filter(y, 201, "aicc")),
    "savgol_filter, mirror": (12_000_000, lambda y, _workers: lambda: tvident.savgol_filter(y, 201, 5, mode="mirror")),
    "tables of a long window": (4_000_001, lambda y, _workers: lambda: tvident.savgol_filter(y, 4_000_001, 9)),
    "ends of a long window": (4_000_001, ends_of_a_long_window),
    "simulate_torsional_rig": (1, lambda _y, _workers: lambda: tvident.simulate_torsional_rig(600.0)),
}
# A busy machine may hand the signal over late, and one short of memory takes long to clear pages for a large array: neither is this
# library's. What the process itself works after the signal is what was promised.
PROMISED = 0.1
BUSY = 1.0


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("name", list(WORKS))
def test_ctrl_c_is_raised_within_a_tenth_of_a_second(name: str, workers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TVIDENT_WORKERS", str(workers))
    samples, prepare = WORKS[name]
    work = prepare(np.random.default_rng(0).standard_normal(samples), workers)
    sent = []

    def interrupt() -> None:
        sent.append((time.perf_counter(), os.times().user))
        os.kill(os.getpid(), signal.SIGINT)

    def until_interrupted() -> None:
        work()
        time.sleep(0.2)  # it was faster than the timer

    timer = threading.Timer(0.05, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        until_interrupted()
    (began, had_worked), elapsed, worked = sent[0], time.perf_counter(), os.times().user
    timer.join()
    assert (worked - had_worked) / workers < PROMISED
    assert elapsed - began < BUSY


def test_a_sample_that_another_thread_writes_is_read_whole() -> None:
    either = np.ones(200_000), np.full(200_000, 2.0**0.5)
    y, stop = either[0].copy(), threading.Event()

    def write() -> None:
        while not stop.is_set():
            for values in either:
                y[:] = values

    writer = threading.Thread(target=write)
    writer.start()
    try:
        found = np.concatenate([tvident.savgol_filter(y, 1, 0, mode="nearest") for _ in range(20)])
    finally:
        stop.set()
        writer.join()
    np.testing.assert_array_equal(np.unique(found), np.unique(either)[np.isin(np.unique(either), found)])


@pytest.mark.parametrize("offset", [0, 1, 4])
def test_samples_are_read_from_any_place(offset: int) -> None:
    values = np.random.default_rng(1).standard_normal(500)
    memory = bytearray(offset) + bytearray(values.tobytes())
    y = np.frombuffer(memory, np.float64, offset=offset)
    np.testing.assert_array_equal(tvident.savgol_filter(y, 21, 3), tvident.savgol_filter(values, 21, 3))
    mask = np.arange(500, dtype=np.uint8).view(np.bool_)
    expected = tvident.identify(values, values[::-1], sample_rate=1, mask=np.arange(500) % 256 > 0, **paper())
    found = tvident.identify(y, values[::-1], sample_rate=1, mask=mask, **paper())
    np.testing.assert_array_equal(found.stiffness, expected.stiffness)


def everything(y: npt.NDArray[np.float64]) -> dict[str, npt.NDArray[np.float64]]:
    """Call every function that has threads, and give some of what it returned."""
    result = tvident.identify(y, np.roll(y, 3), sample_rate=1000, method="paper", workers=2)
    return {
        "fit_local_polynomials": tvident.fit_local_polynomials(y, 51, workers=2).derivatives,
        "rolling_least_squares": tvident.rolling_least_squares(y, np.roll(y, 3), 51, workers=2).params,
        "identify": np.stack([result.inertia, result.damping, result.stiffness]),
        "savgol_filter": tvident.savgol_filter(y, 51, 3),
    }


def assert_equal(found: dict[str, npt.NDArray[np.float64]], expected: dict[str, npt.NDArray[np.float64]]) -> None:
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values, err_msg=name)


@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork")
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_it_works_in_child_processes(method: str) -> None:
    y = np.random.default_rng(0).standard_normal(100_000)
    expected = everything(y)  # the pool has threads now
    with multiprocessing.get_context(method).Pool(2) as pool:
        for found in pool.map(everything, [y, y, y]):
            assert_equal(found, expected)


@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork")
def test_a_fork_in_the_midst_of_work_harms_neither_side() -> None:
    y = np.random.default_rng(0).standard_normal(100_000)
    expected = everything(y)
    stop = threading.Event()
    seen = []

    def go_on() -> None:
        while not stop.is_set():
            seen.append(everything(y))

    thread = threading.Thread(target=go_on)
    thread.start()
    try:
        for _ in range(3):
            with multiprocessing.get_context("fork").Pool(1) as pool:
                assert_equal(pool.apply_async(everything, [y]).get(timeout=60), expected)
    finally:
        stop.set()
        thread.join()
    for found in seen:
        assert_equal(found, expected)


TASKS = Path("/proc/self/task")


def threads_of_pools() -> int:
    """Count the threads that the core has started and that still live."""
    count = 0
    for task in TASKS.iterdir():
        try:
            count += (task / "comm").read_text().startswith("tvident-")
        except (FileNotFoundError, ProcessLookupError):  # it has just ended
            continue
    return count


@pytest.mark.skipif(not TASKS.exists(), reason="counts threads as Linux lists them")
def test_threads_of_outgrown_pools_end() -> None:
    y = np.random.default_rng(0).standard_normal(400_000)
    most = max(threads_of_pools(), 40)
    for workers in (2, 10, 20, 40):
        tvident.rolling_least_squares(y, np.roll(y, 3), 51, workers=workers)
    waited_until = time.perf_counter() + 10
    while threads_of_pools() > most and time.perf_counter() < waited_until:
        time.sleep(0.01)
    assert 0 < threads_of_pools() <= most


def test_it_works_inside_other_thread_pools() -> None:
    y = np.random.default_rng(0).standard_normal(100_000)
    expected = everything(y)
    with ThreadPoolExecutor(5) as pool:
        for found in pool.map(everything, [y] * 10):
            assert_equal(found, expected)


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
