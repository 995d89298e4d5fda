"""Rows for what is away from the usual: short and many records, rare results, automatic choices, records with events."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

import tvident
from speed import signals
from speed.rows import Duel, Row
from speed.timing import Work

_FEW_MILLIONS = 3_600_000
_LEAST = 100_000
"""Records are not shortened below that."""


def _unchecked() -> None:
    """Pass: both sides of these rows are this library's, or compute different things; the tests compare what they compute."""


def _many_records(axis: int) -> Callable[[float], Duel]:
    def prepare(share: float) -> Duel:
        records = np.random.default_rng(22).standard_normal((max(100, int(5000 * share)), 400)).cumsum(axis=1)
        turned = np.ascontiguousarray(np.moveaxis(records, 1, axis))
        return Duel(
            [
                lambda: tvident.fit_local_polynomials(turned, 51, axis=axis, workers=1),
                lambda: savgol_filter(records, 51, 5),
            ],
            _unchecked,
            records.size,
        )

    return prepare


def _against_plain(samples: int, signal: str, *positional: Any, **options: Any) -> Callable[[float], Duel]:
    """Pit a call of `fit_local_polynomials` against the plain one with window 201."""

    def prepare(share: float) -> Duel:
        count = max(min(samples, _LEAST), int(samples * share))
        generator = np.random.default_rng(23)
        sine = np.sin(np.arange(count) / 50) + 0.01 * generator.standard_normal(count)
        y = {"sine": sine, "walk": generator.standard_normal(count).cumsum(), "constant": np.ones(count)}[signal]
        window = positional or (201,)
        return Duel(
            [
                lambda: tvident.fit_local_polynomials(y, *window, workers=1, **options),
                lambda: tvident.fit_local_polynomials(y, 201, workers=1),
            ],
            _unchecked,
            count,
        )

    return prepare


def _regression(count: int = 3, **options: Any) -> Callable[[float], Duel]:
    """Pit an option of `rolling_least_squares` with so many regressors against the plain call."""

    def prepare(share: float) -> Duel:
        regressors, sides = signals.regression(max(_LEAST, int(1_000_000 * share)), count)

        def work(**options: Any) -> Work:
            return lambda: tvident.rolling_least_squares(regressors, sides, 201, workers=1, **options)

        return Duel([work(**options), work()], _unchecked, sides.size)

    return prepare


def _durations(count: int = 3) -> Callable[[float], Duel]:
    """Pit windows of a duration at times that scatter, some 201 rows each, against the plain call."""

    def prepare(share: float) -> Duel:
        regressors, sides = signals.regression(max(_LEAST, int(1_000_000 * share)), count)
        # Steps that scatter as chance arrivals do: windows hold 150 to 250 rows.
        t = np.cumsum(np.random.default_rng(24).exponential(1 / signals.RATE, sides.size))
        return Duel(
            [
                lambda: tvident.rolling_least_squares(regressors, sides, "200ms", t=t, workers=1),
                lambda: tvident.rolling_least_squares(regressors, sides, 201, workers=1),
            ],
            _unchecked,
            sides.size,
        )

    return prepare


def _automatic(**kinds: str) -> Callable[[float], Duel]:
    def prepare(share: float) -> Duel:
        angle, torque = signals.recording(max(_LEAST, int(_FEW_MILLIONS * share)))

        def work(**options: Any) -> Work:
            return lambda: tvident.identify(angle, torque, sample_rate=signals.RATE, workers=1, **options)

        return Duel([work(**kinds), work(method="paper")], _unchecked, angle.size)

    return prepare


def _events(share: float) -> Duel:
    """Pit a record with a break every 4 s against a quarter of it."""
    samples = max(400_000, int(4_000_000 * share))
    angle, torque = signals.recording(4000)
    generator = np.random.default_rng(24)
    angle = np.resize(angle, samples) + 1e-5 * generator.standard_normal(samples)
    torque = np.resize(torque, samples) + 1e-2 * generator.standard_normal(samples)

    def work(count: int) -> Work:
        return lambda: tvident.identify(angle[:count], torque[:count], sample_rate=signals.RATE, workers=1)

    return Duel([work(samples), work(samples // 4)], _unchecked, samples)


def _spoilt(share: float) -> Duel:
    """Pit recordings of many kinds against each other; the clean one is the fastest."""
    samples = max(_LEAST, int(400_000 * share))
    angle, torque = signals.recording(samples)
    hum = np.sin(2 * np.pi * 50 * np.arange(samples) / signals.RATE)
    smooth = np.ones(25) / 25
    largest = float(np.abs(angle).max())
    kinds = [
        (angle, torque),
        (np.convolve(angle, smooth, "same"), np.convolve(torque, smooth, "same")),
        (np.clip(angle, -0.6 * largest, 0.6 * largest), torque),
        (np.repeat(angle[::10], 10)[:samples], torque),
        (angle, torque + 0.5 * hum),
    ]

    def work(angle: signals.Array, torque: signals.Array) -> Work:
        return lambda: tvident.identify(angle, torque, sample_rate=signals.RATE, workers=1)

    return Duel([work(*kind) for kind in kinds], _unchecked, samples)


def _irregular(most: int, **how: Any) -> Callable[[float], Duel]:
    """Pit times that scatter by 0.3 of a step against uniform ones."""

    def duel(share: float) -> Duel:
        angle, torque = signals.recording(max(_LEAST, int(most * share)))
        shift = 0.3 * np.random.default_rng(24).uniform(-0.5, 0.5, angle.size)
        # Samples of the same motion at shifted times, but for what lines between samples of 1 kHz lose.
        count = np.arange(angle.size, dtype=np.float64)
        t, taken = (count + shift) / signals.RATE, [np.interp(count + shift, count, one) for one in (angle, torque)]
        return Duel(
            [
                lambda: tvident.identify(*taken, t=t, workers=1, **how),
                lambda: tvident.identify(angle, torque, sample_rate=signals.RATE, workers=1, **how),
            ],
            _unchecked,
            angle.size,
        )

    return duel


def _own_times(**how: Any) -> Callable[[float], Duel]:
    """Pit local polynomials at times that scatter by half a step against those of uniform ones."""

    def duel(share: float) -> Duel:
        samples = max(_LEAST, int(200_000 * share))
        generator = np.random.default_rng(25)
        count = np.arange(samples, dtype=np.float64)
        times = (count + generator.uniform(-0.25, 0.25, samples)) / signals.RATE
        noise = 1e-3 * generator.standard_normal(samples)
        scattered, uniform = (np.sin(40 * at) + noise for at in (times, count / signals.RATE))
        return Duel(
            [
                lambda: tvident.fit_local_polynomials(scattered, 201, t=times, workers=1, **how),
                lambda: tvident.fit_local_polynomials(uniform, 201, sample_rate=signals.RATE, workers=1, **how),
            ],
            _unchecked,
            samples,
        )

    return duel


_SHORT, _PLAIN = "5000 records of 400 samples, window 51", "window 201"

CORNERS = [
    Row("many-records", f"{_SHORT}, three derivatives", "one pass of `savgol_filter`", _many_records(1), most=0.7),
    Row("many-records-axis-0", "the same along axis 0", "one pass along axis 1", _many_records(0), most=0.7),
    Row("step-100", "`step=100`, 10⁶ samples", "`step=1`", _against_plain(10**6, "sine", step=100), most=0.25),
    Row(
        "average",
        '`selection="average"`, 10⁶ samples',
        '`selection="window"`',
        _against_plain(10**6, "sine", selection="average"),
        most=3,
    ),
    *(
        Row(
            f"automatic-window-{signal}",
            f'`fit_local_polynomials(y, "auto")`, 10⁶ samples, a {signal}',
            _PLAIN,
            _against_plain(10**6, signal, "auto"),
            most=10,
        )
        for signal in ("sine", "walk")
    ),
    *(
        Row(
            f"automatic-window-short-{signal}",
            f"the same, 4000 samples, a {signal}",
            _PLAIN,
            _against_plain(4000, signal, "auto"),
            most=30,
        )
        for signal in ("sine", "walk", "constant")
    ),
    Row(
        "identify-automatic",
        "`identify`, all automatic, 3.6 million samples",
        '`method="paper"`',
        _automatic(),
        most=4,
    ),
    Row(
        "identify-constant",
        "`identify`, all constant",
        '`method="paper"`',
        _automatic(inertia="constant", damping="constant", stiffness="constant"),
        most=4,
    ),
    *(
        Row(f"regression-{name}", f"`rolling_least_squares({words})`, 201 rows", "the plain call", work, most=1.5)
        for name, words, work in (
            ("trailing", 'alignment="trailing"', _regression(alignment="trailing")),
            ("half-life", "half_life=50", _regression(alignment="trailing", half_life=50)),
            ("partial", "min_observations=50", _regression(min_observations=50)),
            ("correlated", 'covariance="hac"', _regression(covariance="hac")),
            ("half-life-5", "half_life=50, five regressors", _regression(5, alignment="trailing", half_life=50)),
            ("correlated-5", 'covariance="hac", five regressors', _regression(5, covariance="hac")),
            ("half-life-8", "half_life=50, eight regressors", _regression(8, alignment="trailing", half_life=50)),
            ("correlated-8", 'covariance="hac", eight regressors', _regression(8, covariance="hac")),
        )
    ),
    *(
        Row(
            f"regression-durations{name}",
            f"`rolling_least_squares` in windows of 200 ms on irregular times, some 200 rows{words}",
            "the plain call, 201 rows",
            _durations(count),
            most=1.5,
        )
        for name, words, count in (("", "", 3), ("-1", ", one regressor", 1), ("-5", ", five regressors", 5))
    ),
    Row(
        "irregular",
        "`identify(t=)`, steps that scatter by 0.3 of a step",
        "uniform times",
        _irregular(_FEW_MILLIONS),
        most=6,
    ),
    Row(
        "irregular-paper",
        '`identify(method="paper", t=)`, 100 000 samples, the same steps',
        "uniform times",
        _irregular(100_000, method="paper"),
        most=6,
    ),
    *(
        Row(
            f"own-times-{name}",
            f"`fit_local_polynomials(t=)`, window 201, {what}",
            "uniform times",
            _own_times(**how),
            most=6,
        )
        for name, what, how in (
            ("4", "order 4", {"order": 4}),
            ("10", "orders to 10", {"max_order": 10}),
            ("15", "orders to 15", {"max_order": 15}),
        )
    ),
    Row("events", "`identify`, 4 million samples, a break every 4 s", "a quarter of them", _events, most=5),
    Row(
        "spoilt",
        "`identify`, 400 000 samples: clean, low-passed, clipped, held, with hum: the slowest",
        "the fastest",
        _spoilt,
        most=3,
        slowest_over_fastest=True,
    ),
]
"""Bars that are not reached yet are there to fail."""
