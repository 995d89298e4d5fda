"""Records and windows as small as they can be."""

from __future__ import annotations

import gc
import weakref
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

import tvident
from calls import paper
from reference.identification import derivatives, windowed
from reference.local_polynomials import fit_window
from reference.regression import solve, window_rows
from tvident import Status

Array = npt.NDArray[np.float64]

# The library promises derivatives to 1e-9 of scale; the reference itself is good to 1e-12.
SCALE = 1e-9
# Scores this close are a tie: rounding decides.
TIE = 1e-6
# Parameters lose digits with the square of the condition number.
PARAMETERS = 1e-8

SHORT = st.integers(2, 25).map(lambda half: 2 * half + 1)
MANY = 8
"""More threads than there are windows."""


def samples(seed: int, n: int) -> Array:
    generator = np.random.default_rng(seed)
    return np.asarray(np.sin(np.arange(n) * generator.uniform(0.05, 0.5)) + 0.1 * generator.standard_normal(n))


@given(seed=st.integers(0, 2**32), window=SHORT, order=st.integers(0, 15), workers=st.sampled_from([1, MANY]))
def test_a_record_of_one_window_is_one_polynomial(seed: int, window: int, order: int, workers: int) -> None:
    y, order = samples(seed, window), min(order, window - 1)
    fit = tvident.fit_local_polynomials(y, window, order=order, workers=workers)
    expected = fit_window(y, 1.0, order, 2).derivatives[:, order]
    scale = np.abs(expected).max(axis=1, keepdims=True)
    assert (np.abs(fit.derivatives - expected) <= SCALE * scale + 1e-12).all()
    edge = fit.status & Status.EDGE != 0
    np.testing.assert_array_equal(np.flatnonzero(~edge), [window // 2])
    np.testing.assert_allclose(tvident.savgol_filter(y, window, order), expected[0], rtol=0, atol=SCALE * scale[0, 0])


@given(seed=st.integers(0, 2**32), window=SHORT, workers=st.sampled_from([1, MANY]))
def test_the_order_is_chosen_in_a_record_of_one_window(seed: int, window: int, workers: int) -> None:
    y = samples(seed, window)
    fit = tvident.fit_local_polynomials(y, window, workers=workers)
    reference = fit_window(y, 1.0, min(15, window - 3), 2)
    scores, order = reference.scores(), int(fit.order[window // 2])
    assert scores[order] - scores.min() < TIE
    np.testing.assert_allclose(
        fit.derivatives[:, window // 2], reference.derivatives[:, order, window // 2], rtol=0, atol=SCALE
    )
    assert np.isfinite(fit.derivatives).all()
    assert np.isfinite(fit.stderr).all()
    np.testing.assert_allclose(fit.scores(0), scores, rtol=1e-9)


@given(seed=st.integers(0, 2**32), window=SHORT, more=st.integers(0, 60))
def test_orders_that_a_window_cannot_judge_are_left_out(seed: int, window: int, more: int) -> None:
    """AICc is defined where M - K - 1 > 0, K = n + 1: up to order M - 3."""
    y = samples(seed, window + more)
    fit = tvident.fit_local_polynomials(y, window, max_order=15)
    assert fit.order.max() <= min(15, window - 3)
    assert np.isfinite(fit.scores(0)).sum() == min(15, window - 3) + 1
    asked = tvident.fit_local_polynomials(y, window, max_order=min(15, window - 3))
    np.testing.assert_array_equal(fit.derivatives, asked.derivatives)


@given(seed=st.integers(0, 2**32), window=st.sampled_from([5, 7, 9, 15]), more=st.integers(0, 30))
def test_the_highest_order_that_is_determined_goes_through_every_sample(seed: int, window: int, more: int) -> None:
    y = samples(seed, window + more)
    fit = tvident.fit_local_polynomials(y, window, order=window - 1)
    np.testing.assert_allclose(fit.derivatives[0], y, rtol=0, atol=1e-10)  # off the centre it loses two digits
    assert np.isnan(fit.sigma).all()  # no sample is left to tell noise by


@pytest.mark.parametrize("n", [5, 6, 7, 12])
def test_windows_of_five(n: int) -> None:
    y = samples(n, n)
    fit = tvident.fit_local_polynomials(y, 5, workers=MANY)
    for i in range(2, n - 2):
        window = fit_window(y[i - 2 : i + 3], 1.0, 2, 2)
        order = int(fit.order[i])
        assert window.scores()[order] - window.scores().min() < TIE
        np.testing.assert_allclose(fit.derivatives[:, i], window.derivatives[:, order, 2], rtol=0, atol=1e-12)
    for order in range(5):
        filtered = tvident.savgol_filter(y, 5, order)
        np.testing.assert_allclose(filtered, signal.savgol_filter(y, 5, order), rtol=0, atol=1e-12)


@given(n=st.integers(1, 40), length=st.integers(1, 40), order=st.integers(0, 5), seed=st.integers(0, 2**32))
def test_the_filter_of_any_length_on_any_record(n: int, length: int, order: int, seed: int) -> None:
    y, length = samples(seed, n), min(length, n)
    order = min(order, length - 1)
    expected = signal.savgol_filter(y, length, order)
    np.testing.assert_allclose(tvident.savgol_filter(y, length, order), expected, rtol=0, atol=1e-8)


@given(
    seed=st.integers(0, 2**32),
    p=st.integers(1, 5),
    extra=st.integers(1, 5),
    more=st.integers(0, 5),
    workers=st.sampled_from([1, MANY]),
)
def test_least_squares_of_hardly_more_rows_than_regressors(
    seed: int, p: int, extra: int, more: int, workers: int
) -> None:
    window = p + extra
    n = window + more
    generator = np.random.default_rng(seed)
    A, b = generator.standard_normal((n, p)), generator.standard_normal(n)
    found = tvident.rolling_least_squares(A, b, window, workers=workers)
    for i in range(n):
        rows = window_rows(i, window, n)
        if rows.stop - rows.start <= p or 2 * (rows.stop - rows.start) < window:
            assert found.status[i] & Status.INVALID
            continue
        expected = solve(A[rows], b[rows])
        if expected.condition < 1e6:
            allowed = PARAMETERS * expected.condition**2 * float(np.abs(expected.params).max())
            assert np.abs(found.params[i] - expected.params).max() <= allowed


@pytest.mark.parametrize("workers", [1, MANY])
@pytest.mark.parametrize("more", [0, 1, 5, 9, 30])
def test_identification_of_a_record_that_holds_hardly_an_equation(more: int, workers: int) -> None:
    half, equations = 10, 8
    n = 2 * half + 1 + more
    angle, torque = samples(0, n), samples(1, n)
    call: dict[str, Any] = {
        "sample_rate": 1.0,
        "window_length": 2 * half + 1,
        "regression_window": equations,
    }
    result = tvident.identify(angle, torque, **paper(workers=workers, **call))
    theta, velocity, acceleration = derivatives(angle, half, 1.0, result.order)
    expected = windowed(np.stack([acceleration, velocity, theta], axis=1), torque, equations)
    assert result.inertia.shape == (n,)
    for i in range(n):
        solution = expected.one(i)
        invalid = bool(result.status[i] & Status.INVALID)
        if solution is None:
            assert invalid
        elif not invalid and solution.condition < 1e3:
            found = np.array([result.inertia[i], result.damping[i], result.stiffness[i]])
            allowed = PARAMETERS * solution.condition**2 * np.abs(solution.params).max()
            assert np.abs(found - solution.params).max() <= allowed
    assert invalid_everywhere(result) == (more + 1 < equations // 2)


def invalid_everywhere(result: tvident.Identification) -> bool:
    return bool((result.status & Status.INVALID != 0).all())


def test_more_workers_than_windows_change_nothing() -> None:
    y = samples(3, 60)
    for window in (5, 31, 59):
        one, many = (tvident.fit_local_polynomials(y, window, workers=workers) for workers in (1, 1000))
        np.testing.assert_array_equal(one.derivatives, many.derivatives)
        np.testing.assert_array_equal(one.order, many.order)


@pytest.mark.parametrize("method", ["auto", "paper"])
def test_a_result_that_nobody_holds_is_freed_at_once(method: Literal["auto", "paper"]) -> None:
    rig = tvident.simulate_torsional_rig(duration=4.0)
    angle = np.array(rig.angle)
    held = weakref.ref(angle)
    gc.disable()
    try:
        result = tvident.identify(angle, rig.torque, sample_rate=1000, method=method)
        assert held() is not None
        del angle, result
        # No cycle waits for the collector: pieces of long records would, with all their samples.
        assert held() is None
    finally:
        gc.enable()
