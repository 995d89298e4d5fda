"""The same numbers on any number of threads, bit for bit, and on any path of instructions, within rounding."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from calls import paper
from parameters import examples
from reference.exact import Window, gains
from signals import signal
from tvident import Status, _core

Array = npt.NDArray[np.float64]

COEFFICIENTS = 2e-12
"""Promised error of a coefficient over the norm of the window's samples; two paths may differ by two of them."""
OUTPUT = float(np.finfo(np.float64).eps)
"""A result is rounded once when it is written."""
TIE = 1e-6
"""Scores are sums of M logarithms of residuals good to 1e-9 or so: closer than this, rounding decides."""
PARAMETERS = 1e-8
"""Promised error of parameters over their scale, times the squared condition number."""


def with_bad_samples(y: Array, seed: int, count: int) -> Array:
    """Give a copy with a few glitches and values that are no number: lanes start afresh there, and windows become NaN."""
    generator = np.random.default_rng(seed)
    bad = y.copy()
    bad[generator.integers(0, y.size, count)] = generator.choice([np.nan, np.inf, 1e8, -1e8, 1e300], count)
    return bad


def arrays(result: object) -> dict[str, npt.NDArray[Any]]:
    """Give every array that a result holds, what is computed when asked for included."""
    match result:
        case np.ndarray():
            return {"result": result}
        case tvident.LocalPolynomialFit():
            names = ("derivatives", "order", "sigma", "status", "stderr")
            return {name: getattr(result, name) for name in names}
        case tvident.RollingRegression():
            return {name: values for name, values in vars(result).items() if isinstance(values, np.ndarray)}
        case tvident.Identification():
            numbers = {
                f"{name}, {part}": np.asarray(x) for name, two in result.constants.items() for part, x in enumerate(two)
            }
            return result.columns() | numbers
    raise TypeError(f"no arrays are known of {result!r}")


def assert_same_bits(one: object, other: object) -> None:
    expected = arrays(one)
    for name, found in arrays(other).items():
        assert found.tobytes() == expected[name].tobytes(), name


Work = Callable[[Array, int, int], object]

WORKS: dict[str, Work] = {
    "fit_local_polynomials": lambda y, window, workers: tvident.fit_local_polynomials(y, window, workers=workers),
    "fit_local_polynomials, fixed order": lambda y, window, workers: tvident.fit_local_polynomials(
        y, window, order=3, max_deriv=3, workers=workers
    ),
    "fit_local_polynomials, every third": lambda y, window, workers: tvident.fit_local_polynomials(
        y, window, step=3, workers=workers
    ),
    "rolling_least_squares": lambda y, window, workers: tvident.rolling_least_squares(
        np.stack([y, np.roll(y, 7), np.ones_like(y)], axis=1), np.roll(y, 3), window, workers=workers
    ),
    "rolling_least_squares, many": lambda y, window, workers: tvident.rolling_least_squares(
        np.stack([np.roll(y, k) for k in range(5)], axis=1),
        np.stack([y, np.roll(y, 9)], axis=1),
        window + 6,
        workers=workers,
    ),
    "identify": lambda y, window, workers: tvident.identify(
        y, np.roll(y, 5), sample_rate=1000, **paper(window_length=window, regression_window=window + 3, workers=workers)
    ),
    "identify, further terms": lambda y, window, workers: tvident.identify(
        y,
        np.roll(y, 5),
        sample_rate=1000,
        **paper(window_length=window, terms=["offset", "coulomb"], damping=0, workers=workers),
    ),
    "identify, constant": lambda y, window, workers: tvident.identify(
        y,
        np.roll(y, 5),
        sample_rate=1000,
        **paper(window_length=window, inertia="constant", damping="constant", stiffness="constant", workers=workers),
    ),
}


@pytest.mark.first(1)
@pytest.mark.parametrize("name", list(WORKS))
@settings(max_examples=examples(15))
@given(
    seed=st.integers(0, 2**32),
    n=st.one_of(st.integers(500, 2000), st.integers(30_000, 80_000)),
    half=st.integers(2, 100),
    workers=st.integers(2, 9),
    bad=st.integers(0, 5),
)
def test_any_number_of_workers_gives_the_same_bits(
    name: str, seed: int, n: int, half: int, workers: int, bad: int
) -> None:
    y = with_bad_samples(signal(seed, n), seed, bad)
    assert_same_bits(WORKS[name](y, 2 * half + 1, 1), WORKS[name](y, 2 * half + 1, workers))


@settings(max_examples=examples(10))
@given(seed=st.integers(0, 2**32), n=st.integers(30_000, 80_000), length=st.integers(5, 300), workers=st.integers(2, 9))
def test_the_filter_gives_the_same_bits_on_any_number_of_workers(seed: int, n: int, length: int, workers: int) -> None:
    y = with_bad_samples(signal(seed, n), seed, 3)
    found = []
    with pytest.MonkeyPatch.context() as patch:
        for setting in (1, workers):
            patch.setenv("TVIDENT_WORKERS", str(setting))
            found.append([tvident.savgol_filter(y, length, order) for order in (3, "aicc")])
    for one, other in zip(*found, strict=True):
        assert_same_bits(one, other)


@given(seed=st.integers(0, 2**32), records=st.integers(1, 6), n=st.integers(60, 30_000), workers=st.integers(1, 9))
@settings(max_examples=examples(20))
def test_a_record_has_the_same_bits_in_any_company(seed: int, records: int, n: int, workers: int) -> None:
    y = np.array([signal(seed + k, n) for k in range(records)])
    together = tvident.fit_local_polynomials(y, 51, workers=workers)
    for k in range(records):
        alone = tvident.fit_local_polynomials(y[k], 51, workers=1)
        for name, expected in arrays(alone).items():
            found = arrays(together)[name]
            assert np.ascontiguousarray(found[..., k, :]).tobytes() == expected.tobytes(), name


@contextmanager
def instructions(name: str) -> Iterator[None]:
    """Force a path for a while."""
    _core.force_instructions(name)
    try:
        yield
    finally:
        _core.force_instructions(None)


def norms(y: Array, half: int) -> Array:
    """Give the norm of the samples of every full window, the one at its centre taken off."""
    windows = np.lib.stride_tricks.sliding_window_view(y, 2 * half + 1)
    return np.asarray(np.linalg.norm(windows - windows[:, half : half + 1], axis=1))


@given(
    seed=st.integers(0, 2**32),
    half=st.sampled_from([2, 5, 25, 100, 1000]),
    more=st.integers(0, 3000),
    noise=st.sampled_from([1e-6, 1e-2, 1.0]),
    order=st.sampled_from([None, 0, 3, 7, 15]),
)
@settings(max_examples=examples(60))
def test_every_path_has_the_same_orders_and_derivatives(
    seed: int, half: int, more: int, noise: float, order: int | None
) -> None:
    y = signal(seed, 2 * half + 1 + more, noise)
    order = None if order is None else min(order, 2 * half - 1)
    fits = {}
    for path in _core.available_instructions():
        with instructions(path):
            fits[path] = tvident.fit_local_polynomials(y, 2 * half + 1, order=order)
    first, *others = fits.values()
    interior = slice(half, y.size - half)
    # What a coefficient's error makes of a derivative, by order.
    passed_on = 2 * COEFFICIENTS * np.abs(gains(half, min(15, 2 * half))[:3]).cumsum(axis=1)
    norm = norms(y, half)
    for other in others:
        np.testing.assert_array_equal(first.status & Status.INVALID, other.status & Status.INVALID)
        same = first.order == other.order
        for i in np.flatnonzero(~same):
            centre = int(np.clip(i, half, y.size - 1 - half))
            window = Window(y[centre - half : centre + half + 1], 15)
            a, b = (int(fit.order[i]) for fit in (first, other))
            assert abs(window.score(a) - window.score(b)) < TIE, f"sample {i}: no tie between orders {a} and {b}"
        chosen = first.order[interior]
        allowed = passed_on[:, chosen] * norm + 2 * OUTPUT * np.abs(first.derivatives[:, interior])
        error = np.abs(first.derivatives - other.derivatives)[:, interior]
        assert (error <= allowed)[:, same[interior]].all()


@given(seed=st.integers(0, 2**32), length=st.integers(5, 400), order=st.integers(0, 9), deriv=st.integers(0, 2))
def test_every_path_filters_alike(seed: int, length: int, order: int, deriv: int) -> None:
    half, order = length // 2, min(order, 2 * (length // 2))
    y = signal(seed, 3000)
    found = []
    for path in _core.available_instructions():
        with instructions(path):
            found.append(tvident.savgol_filter(y, 2 * half + 1, order, deriv))
    passed_on = 2 * COEFFICIENTS * np.abs(gains(half, max(order, deriv))[deriv, : order + 1]).sum()
    interior = slice(half, y.size - half)
    for other in found[1:]:
        allowed = passed_on * norms(y, half) + 2 * OUTPUT * np.abs(found[0][interior])
        assert (np.abs(found[0] - other)[interior] <= allowed).all()


@given(seed=st.integers(0, 2**32), half=st.integers(10, 60), equations=st.integers(60, 200))
@settings(max_examples=examples(20))
def test_every_path_identifies_alike(seed: int, half: int, equations: int) -> None:
    angle = signal(seed, 2000, 1e-3)
    velocity = np.gradient(angle, 1e-3)
    torque = 0.01 * np.gradient(velocity, 1e-3) + 0.1 * velocity + 15 * angle
    found = []
    for path in _core.available_instructions():
        with instructions(path):
            found.append(
                tvident.identify(
                    angle, torque, sample_rate=1000, **paper(window_length=2 * half + 1, regression_window=equations)
                )
            )
    first = found[0]
    for other in found[1:]:
        # A tie that fell the other way changes the equations of the windows around it, and no others.
        apart = np.convolve(first.order != other.order, np.ones(2 * equations + 1), "same") > 0
        np.testing.assert_array_equal(first.status[~apart], other.status[~apart])
        good = ~apart & (first.status & Status.INVALID == 0)
        for name in ("inertia", "damping", "stiffness"):
            one, two = getattr(first, name)[good], getattr(other, name)[good]
            allowed = PARAMETERS * first.condition[good] ** 2 * np.nanmax(np.abs(getattr(first, name)), initial=0)
            assert (np.abs(one - two) <= allowed).all(), name
