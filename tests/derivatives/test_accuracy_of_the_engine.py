"""What rounding does to the sliding projection, against exact arithmetic, over ten million samples."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from reference.exact import Window, gains

Array = npt.NDArray[np.float64]

SAMPLES = 10_000_000
RATE = 1000.0
MINUTE = int(60 * RATE)
STEP = 487
"""Every so manieth window is compared: 123 in a minute."""
HALF = 100
"""Half of the paper's window of 201."""

COEFFICIENTS = 2e-12
"""Promised error of a coefficient over the norm of the window's samples, the one at its centre taken off."""
ACCELERATION = 1e-6
"""Promised error of θ̈ of order 7 over its amplitude, where an offset is 1e9 times the signal."""
RESIDUALS = 1e-6
"""Promised relative error of the residual sum of squares where noise is 1e-6 of the signal."""
GLITCH = 1e-9
"""What a glitch of 1e8 may leave beyond its own windows, the signal being of order one."""
OUTPUT = float(np.finfo(np.float64).eps)
"""A result is rounded once when it is written, and the one it is compared with once more."""


@lru_cache(maxsize=1)
def record(kind: str) -> Array:
    t = np.arange(SAMPLES) / RATE
    if kind == "offset":
        return np.asarray(1e6 + 1e-3 * np.sin(2 * np.pi * 5 * t))
    waves = sum(a * np.sin(2 * np.pi * f * t + a) for f, a in ((0.3, 1.0), (1.7, 0.5), (7.3, 0.2)))
    noise = np.random.default_rng(0).standard_normal(SAMPLES)
    if kind == "quiet":
        return np.asarray(waves + 1e-6 * noise)
    return np.asarray(5 + 1e-3 * t + waves + 1e-3 * noise)  # drifts by ten times its amplitude


def centres(half: int) -> dict[str, list[int]]:
    """Give the windows that are compared: those of the first minute, of the middle, and of the last minute."""
    places = [i for i in range(0, SAMPLES, STEP) if half <= i < SAMPLES - half]
    return {
        "first": [i for i in places if i < MINUTE],
        "middle": places[:: len(places) // 100],
        "last": [i for i in places if i >= SAMPLES - MINUTE],
    }


@lru_cache(maxsize=2000)
def exact(samples: bytes, highest: int) -> Window:
    """Fit a window in exact arithmetic, once for all tests that look at it."""
    return Window(np.frombuffer(samples), highest)


def window(y: Array, centre: int, half: int = HALF, highest: int = 15) -> tuple[Window, float]:
    """Give a window in exact arithmetic, and the norm of its samples."""
    samples = y[centre - half : centre + half + 1]
    return exact(samples.tobytes(), highest), float(np.linalg.norm(samples - samples[half]))


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("kind", ["drift", "offset"])
def test_coefficients_of_every_order_keep_their_digits(kind: str) -> None:
    """A coefficient shows as what one order more adds: to the value where it is even, to the first derivative where it is odd."""
    y = record(kind)
    derivatives = []
    for order in range(16):
        fit = tvident.fit_local_polynomials(y, 2 * HALF + 1, order=order, max_deriv=order % 2, step=STEP)
        derivatives.append(fit.derivatives[order % 2])
    table = gains(HALF, 15)
    for part, places in centres(HALF).items():
        for i in places:
            fitted, norm = window(y, i)
            for order, expected in enumerate(fitted.coefficients()):
                here = Fraction(float(derivatives[order][i // STEP]))
                level = Fraction(float(y[i])) if order == 0 else Fraction(0)
                below = Fraction(float(derivatives[order - 2][i // STEP])) if order > 1 else level
                gain = table[order % 2, order]
                error = abs(float(here - below) / gain - expected)
                written = OUTPUT * float(abs(here)) / abs(gain)
                assert error <= COEFFICIENTS * norm + written, (
                    f"{part}, sample {i}, degree {order}: {error / norm} of norm"
                )


@pytest.mark.first(1)
@pytest.mark.parametrize("half", [25, 100, 1000])
def test_derivatives_of_chosen_orders_have_the_errors_of_their_coefficients(half: int) -> None:
    y = record("drift")
    fit = tvident.fit_local_polynomials(y, 2 * half + 1, step=STEP)
    allowed = COEFFICIENTS * np.abs(gains(half, 15)).cumsum(axis=1)
    for part, places in centres(half).items():
        for i in places[:: 1 if half < 1000 else 20]:
            fitted, norm = window(y, i, half)
            order = int(fit.order[i // STEP])
            for d in range(3):
                found = Fraction(float(fit.derivatives[d, i // STEP]))
                error = float(abs(found - fitted.derivative(order, d)))
                assert error <= allowed[d, order] * norm + OUTPUT * float(abs(found)), (
                    f"{part}, sample {i}, derivative {d}"
                )


def test_an_offset_costs_the_acceleration_nothing() -> None:
    y, omega = record("offset"), 2 * np.pi * 5
    amplitude = 1e-3 * omega**2
    fit = tvident.fit_local_polynomials(y, 2 * HALF + 1, order=7, sample_rate=RATE, step=STEP)
    for part, places in centres(HALF).items():
        for i in places:
            # The samples as they are, rounded at 1e-10 ...
            found = float(fit.derivatives[2, i // STEP])
            fitted, norm = window(y, i, highest=7)
            error = abs(found - float(fitted.derivative(7, 2)) * RATE**2)
            rounding = COEFFICIENTS * norm * np.abs(gains(HALF, 7)[2]).sum() * RATE**2
            assert error <= rounding + OUTPUT * abs(found), f"{part}, sample {i}"
            # ... and what they are rounded from.
            t = np.arange(i - HALF, i + HALF + 1) / RATE
            wave, _ = window(1e-3 * np.sin(omega * t), HALF, highest=7)
            assert abs(found - float(wave.derivative(7, 2)) * RATE**2) <= ACCELERATION * amplitude, (
                f"{part}, sample {i}"
            )


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("half", [25, 100, 1000])
def test_residuals_keep_their_digits_where_noise_is_a_millionth(half: int) -> None:
    y = record("quiet")
    fit = tvident.fit_local_polynomials(y, 2 * half + 1, step=STEP)
    for part, places in centres(half).items():
        for i in places[:: 1 if half < 1000 else 20]:
            fitted, _ = window(y, i, half)
            order = int(fit.order[i // STEP])
            found = float(fit.sigma[i // STEP]) ** 2 * (2 * half - order)
            expected = float(fitted.rss(order))
            assert abs(found - expected) <= RESIDUALS * expected, f"{part}, sample {i}: {found / expected - 1}"


@pytest.mark.slow
def test_the_last_minute_is_as_accurate_as_the_first() -> None:
    """Rounding is chance; over 120 windows its root mean square is the same within a third, were there no drift."""
    y = record("drift")
    fit = tvident.fit_local_polynomials(y, 2 * HALF + 1, order=15, step=STEP)
    errors = {}
    for part, places in centres(HALF).items():
        rows = []
        for i in places:
            fitted, norm = window(y, i)
            rss = float(fit.sigma[i // STEP]) ** 2 * (2 * HALF - 15)
            rows.append(
                [float(fit.derivatives[2, i // STEP]) - float(fitted.derivative(15, 2)), rss - float(fitted.rss(15))]
            )
            rows[-1] = [error / norm for error in rows[-1]]
        errors[part] = np.sqrt(np.mean(np.square(rows), axis=0))
    assert (errors["last"] <= 1.5 * errors["first"]).all(), errors


glitches = given(
    half=st.sampled_from([2, 3, 5, 10, 25, 100, 1000]),
    first=st.integers(0, 2000),
    apart=st.integers(20, 40),
    seed=st.integers(0, 2**32),
    order=st.one_of(st.none(), st.integers(0, 15)),
    glitch=st.sampled_from([1e8, -1e8]),
)


def with_glitches(
    half: int, first: int, apart: int, seed: int, glitch: float
) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Give a record with a glitch every few windows, the same without, and the samples whose window holds none."""
    n = 20 * half + 1000
    t = np.arange(n)
    clean = np.sin(0.05 * t) + 1e-3 * np.random.default_rng(seed).standard_normal(n)
    dirty, bad = clean.copy(), np.arange(first % n, n, 4 * half + apart)
    dirty[bad] = glitch
    centre = np.clip(t, half, n - 1 - half)
    return dirty, clean, (np.abs(centre[:, None] - bad) > half).all(axis=1)


@glitches
def test_a_glitch_leaves_nothing_beyond_its_own_windows(
    half: int, first: int, apart: int, seed: int, order: int | None, glitch: float
) -> None:
    dirty, clean, away = with_glitches(half, first, apart, seed, glitch)
    order = None if order is None else min(order, 2 * half - 1)  # one more leaves no residual
    found, expected = (tvident.fit_local_polynomials(y, 2 * half + 1, order=order) for y in (dirty, clean))
    assert np.abs(found.derivatives - expected.derivatives)[:, away].max(initial=0) <= GLITCH
    assert np.abs(found.sigma - expected.sigma)[away].max(initial=0) <= GLITCH


@glitches
def test_a_glitch_leaves_nothing_behind_in_the_filter(
    half: int, first: int, apart: int, seed: int, order: int | None, glitch: float
) -> None:
    dirty, clean, away = with_glitches(half, first, apart, seed, glitch)
    polyorder: Any = "aicc" if order is None else min(order, 2 * half)
    found, expected = (tvident.savgol_filter(y, 2 * half + 1, polyorder) for y in (dirty, clean))
    assert np.abs(found - expected)[away].max(initial=0) <= GLITCH
