"""The rows of the table: what is measured, against what, and how much it may cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl
import polars_ols  # noqa: F401 - gives polars its least squares
from scipy.signal import savgol_filter

import tvident
from speed import checks, signals
from speed.timing import Work


@dataclass(frozen=True)
class Duel:
    """Works to be timed in turns: ours first."""

    works: list[Work]
    check: Callable[[], None]
    """Raises unless all of them computed the same thing."""
    samples: int
    """Samples that one call works on."""
    calls: int = 1
    """Calls that are timed together, where one is too short for the clock."""
    close: Callable[[], None] = lambda: None
    """Gives back what the works needed."""


@dataclass(frozen=True)
class Row:
    """One row of the table."""

    name: str
    work: str
    against: str
    prepare: Callable[[float], Duel]
    """Makes the works for a record shortened by a factor."""
    most: float | None = None
    """The ratio that is allowed, or None where a row only informs."""
    aim: float | None = None
    instructions: str | None = None
    """Vector instructions that are forced, or None for the fastest."""
    threads: int = 1
    """Threads that the faster side has."""
    slowest_over_fastest: bool = False
    """The ratio is that of the slowest work over the fastest, not of the first over the second."""


_RAW_POWERS = 1e-7
"""SciPy solves for its coefficients in raw powers: at order 5 and 201 samples they are good to 1e-8 of scale."""
_SUMS = 1e-10
"""What two ways to sum some hundred products may differ by, as a fraction of scale; low orders, short windows."""
_RUNNING = 1e-6
"""polars-ols updates a normal matrix; its parameters drift that far from orthogonal ones within a million rows."""

_CHOICE = "`fit_local_polynomials`, orders 0…15, value and two derivatives"


def _length(samples: int, share: float, least: int) -> int:
    return max(int(samples * share), least)


def _choice(window_length: int, polyorder: int, tolerance: float) -> Callable[[float], Duel]:
    """Pit all orders and three derivatives against one pass of a fixed order."""

    def prepare(share: float) -> Duel:
        y, _ = signals.recording(_length(1_000_000, share, 3 * window_length))

        def check() -> None:
            fixed = tvident.fit_local_polynomials(y, window_length, order=polyorder)
            passed = savgol_filter(y, window_length, polyorder)
            checks.same(f"smoothed samples at {window_length}", fixed.derivatives[0], passed, tolerance)
            checks.local_polynomials(y, window_length, tvident.fit_local_polynomials(y, window_length))

        return Duel(
            [
                lambda: tvident.fit_local_polynomials(y, window_length, workers=1),
                lambda: savgol_filter(y, window_length, polyorder),
            ],
            check,
            y.size,
        )

    return prepare


def _windows(share: float) -> Duel:
    lengths = (51, 201, 2001, 20_001)
    y, _ = signals.recording(_length(1_000_000, share, 10 * lengths[-1]))

    def work(length: int) -> Work:
        return lambda: tvident.fit_local_polynomials(y, length, workers=1)

    def check() -> None:
        for length in lengths:
            checks.local_polynomials(y, length, tvident.fit_local_polynomials(y, length))

    return Duel([work(length) for length in lengths], check, y.size)


def _least_squares(share: float) -> Duel:
    rows, window = _length(1_000_000, share, 10_000), 201
    A, b = signals.regression(rows)
    frame = pl.DataFrame({"first": A[:, 0], "second": A[:, 1], "third": A[:, 2], "side": b})
    side: Any = pl.col("side")
    solved = side.least_squares.rolling_ols(
        *(pl.col(name) for name in ("first", "second", "third")), window_size=window, mode="coefficients"
    )

    def check() -> None:
        ours = tvident.rolling_least_squares(A, b, window).params
        theirs = frame.select(solved).to_series().struct.unnest().to_numpy()
        # Theirs end at their row, ours are centred on it.
        half = window // 2
        checks.same("parameters", ours[half : rows - half], theirs[window - 1 :], _RUNNING)

    return Duel(
        [lambda: tvident.rolling_least_squares(A, b, window, workers=1), lambda: frame.select(solved)], check, rows
    )


def _identification(share: float) -> Duel:
    angle, torque = signals.recording(_length(3_600_000, share, 10_000))

    def check() -> None:
        result = tvident.identify(angle, torque, sample_rate=signals.RATE, method="paper")
        checks.identification(angle, torque, result, 201, signals.RATE)

    return Duel(
        [
            lambda: tvident.identify(angle, torque, sample_rate=signals.RATE, method="paper", workers=1),
            lambda: [savgol_filter(angle, 201, 5, deriv=d, delta=1 / signals.RATE) for d in range(3)],
        ],
        check,
        angle.size,
    )


def _filter(window_length: int, polyorder: int, tolerance: float) -> Callable[[float], Duel]:
    def prepare(share: float) -> Duel:
        y, _ = signals.recording(_length(1_000_000, share, 10_000))

        def check() -> None:
            ours, theirs = (one(y, window_length, polyorder) for one in (tvident.savgol_filter, savgol_filter))
            checks.same("filtered samples", ours, theirs, tolerance)

        return Duel(
            [
                lambda: tvident.savgol_filter(y, window_length, polyorder),
                lambda: savgol_filter(y, window_length, polyorder),
            ],
            check,
            y.size,
        )

    return prepare


def _one_call(window_length: int) -> Callable[[float], Duel]:
    def prepare(_share: float) -> Duel:
        y, _ = signals.recording(201)

        def check() -> None:
            fixed = tvident.fit_local_polynomials(y, window_length, order=5).derivatives[0]
            checks.same("smoothed samples", fixed, savgol_filter(y, window_length, 5), _RAW_POWERS)

        return Duel(
            [lambda: tvident.fit_local_polynomials(y, window_length), lambda: savgol_filter(y, window_length, 5)],
            check,
            y.size,
            calls=100,
        )

    return prepare


def _workers(work: Callable[[int, float], tuple[Callable[[int], Any], int]], *parts: str) -> Callable[[float], Duel]:
    """Pit two threads against one at the same work; `parts` of the results are compared bit for bit."""

    def prepare(share: float) -> Duel:
        call, samples = work(3_600_000, share)

        def check() -> None:
            one, two = call(1), call(2)
            for part in parts:
                if not np.array_equal(getattr(one, part), getattr(two, part), equal_nan=True):
                    raise checks.DifferentError(f"{part} depends on the number of workers")

        return Duel([lambda: call(2), lambda: call(1)], check, samples)

    return prepare


def _polynomials_by(samples: int, share: float) -> tuple[Callable[[int], Any], int]:
    y, _ = signals.recording(_length(samples, share, 100_000))
    return lambda workers: tvident.fit_local_polynomials(y, 201, workers=workers), y.size


def _least_squares_by(samples: int, share: float) -> tuple[Callable[[int], Any], int]:
    A, b = signals.regression(_length(samples, share, 100_000))
    return lambda workers: tvident.rolling_least_squares(A, b, 201, workers=workers), b.size


def _identification_by(samples: int, share: float) -> tuple[Callable[[int], Any], int]:
    angle, torque = signals.recording(_length(samples, share, 100_000))
    return lambda workers: tvident.identify(
        angle, torque, sample_rate=signals.RATE, method="paper", workers=workers
    ), angle.size


def _outputs(share: float) -> Duel:
    """Pit all orders at window 201 against NumPy that only allocates and fills arrays of the same sizes."""
    y, _ = signals.recording(_length(1_000_000, share, 10_000))

    def fill() -> list[Any]:
        kinds = ((np.float64, 3), (np.float64, 1), (np.uint8, 1), (np.uint16, 1))
        filled = [np.zeros((rows, y.size), dtype) for dtype, rows in kinds]
        for array in filled:
            array.fill(1)
        return filled

    return Duel([lambda: tvident.fit_local_polynomials(y, 201, workers=1), fill], lambda: None, y.size)


_TWO = 1 / 1.7
"""Two threads must be 1.7 times one."""

ROWS = [
    Row(
        "choice-201",
        f"{_CHOICE}, window 201, AVX-512",
        "`savgol_filter(y, 201, 5)`",
        _choice(201, 5, _RAW_POWERS),
        most=0.22,
        aim=0.15,
        instructions="avx512",
    ),
    Row(
        "choice-201-avx2",
        f"{_CHOICE}, window 201, AVX2",
        "`savgol_filter(y, 201, 5)`",
        _choice(201, 5, _RAW_POWERS),
        most=0.32,
        instructions="avx2",
    ),
    Row(
        "choice-2001",
        f"{_CHOICE}, window 2001",
        "`savgol_filter(y, 2001, 3)`",
        _choice(2001, 3, _SUMS),
        most=0.045,
        aim=0.03,
    ),
    Row(
        "windows",
        "the same, windows 51, 201, 2001, 20 001: the slowest",
        "the fastest of them",
        _windows,
        most=1.4,
        slowest_over_fastest=True,
    ),
    Row(
        "windows-avx2",
        "the same with AVX2: the slowest",
        "the fastest of them",
        _windows,
        most=1.4,
        instructions="avx2",
        slowest_over_fastest=True,
    ),
    Row(
        "least-squares",
        "`rolling_least_squares`, 3 regressors, 201 rows, with errors and condition",
        "polars-ols, coefficients",
        _least_squares,
        most=1 / 12,
        aim=1 / 20,
    ),
    Row(
        "identify",
        '`identify(method="paper")`, 3.6 million samples',
        "three passes of `savgol_filter(y, 201, 5)`",
        _identification,
        most=0.30,
        aim=0.15,
    ),
    Row(
        "filter-201",
        "`savgol_filter(y, 201, 5)`",
        "SciPy's",
        _filter(201, 5, _RAW_POWERS),
        most=0.12,
        aim=0.06,
    ),
    Row("filter-11", "`savgol_filter(y, 11, 3)`", "SciPy's", _filter(11, 3, _SUMS), most=1.0, aim=0.5),
    Row(
        "one-call",
        "`fit_local_polynomials(y, 201)` on 201 samples",
        "`savgol_filter(y, 201, 5)` on the same",
        _one_call(201),
        most=1.0,
    ),
    Row(
        "one-call-51",
        "`fit_local_polynomials(y, 51)` on 201 samples",
        "`savgol_filter(y, 51, 5)` on the same",
        _one_call(51),
        most=1.0,
    ),
    Row(
        "two-workers",
        "`fit_local_polynomials`, window 201, two threads",
        "one thread",
        _workers(_polynomials_by, "derivatives", "order", "sigma", "status"),
        most=_TWO,
        threads=2,
    ),
    Row(
        "two-workers-least-squares",
        "`rolling_least_squares`, two threads",
        "one thread",
        _workers(_least_squares_by, "params", "stderr", "condition", "status"),
        most=_TWO,
        threads=2,
    ),
    Row(
        "two-workers-identify",
        '`identify(method="paper")`, two threads',
        "one thread",
        _workers(_identification_by, "inertia", "damping", "stiffness", "condition", "status"),
        most=_TWO,
        threads=2,
    ),
    Row(
        "outputs",
        f"{_CHOICE}, window 201",
        "NumPy allocating and filling the same arrays",
        _outputs,
    ),
]
