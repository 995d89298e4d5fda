"""Orders chosen with more than one window's criterion in view."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from reference.local_polynomials import akaike_average, errors_around, fit_windows, pooled_scores, pooled_weights
from signals import signal
from tvident import Status, _core

Array = npt.NDArray[np.float64]
Selection = Literal["window", "pooled", "average"]

SELECTIONS: tuple[Selection, ...] = ("window", "pooled", "average")
# The library promises derivatives to 1e-9 of scale; the reference itself is good to 1e-12.
SCALE = 1e-9
# Scores are sums of logarithms of numbers good to about 1e-10: closer than this, rounding decides.
TIE = 1e-6


records = st.fixed_dictionaries(
    {"seed": st.integers(0, 2**32), "half": st.integers(3, 120), "more": st.integers(0, 300)}
)
noises = st.sampled_from([1e-6, 1e-3, 0.1, 1.0])


@given(record=records, noise=noises, max_order=st.integers(0, 15), delta=st.sampled_from([1.0, 1e-3]))
def test_pooled_orders_are_best_by_the_sum_over_neighbours(
    record: dict[str, int], noise: float, max_order: int, delta: float
) -> None:
    half = record["half"]
    y = signal(record["seed"], 2 * half + 1 + record["more"], noise)
    fit = tvident.fit_local_polynomials(y, 2 * half + 1, delta=delta, max_order=max_order, selection="pooled")
    windows = fit_windows(y, half, delta, max_order, 2)
    sums = pooled_scores(windows, 2 * half)
    full, each = slice(half, y.size - half), np.arange(y.size - 2 * half)
    order = fit.order[full].astype(int)
    scale = np.abs(fit.derivatives).max(axis=1)
    np.testing.assert_array_less(sums[each, order] - sums.min(axis=1), TIE * each.size)
    expected = windows.derivatives[each, :, order]
    distance = np.abs(fit.derivatives[:, full].T - expected)
    np.testing.assert_array_less(distance, np.broadcast_to(SCALE * scale + 1e-300, distance.shape))
    sigma = np.sqrt(windows.rss[each, order] / (2 * half - order))
    np.testing.assert_allclose(fit.sigma[full], sigma, rtol=1e-6, atol=1e-12)
    neighbours = np.minimum(each + 2 * half, each.size - 1) - np.maximum(each - 2 * half, 0) + 1
    weights = pooled_weights(sums, neighbours, 2 * half + 1)
    errors = errors_around(windows, weights, expected)
    np.testing.assert_allclose(fit.stderr[:, full].T, errors, rtol=1e-3, atol=1e-9 * scale.max())


@given(record=records, noise=noises, max_order=st.integers(0, 15), delta=st.sampled_from([1.0, 1e-3]))
def test_average_takes_akaikes_weights(record: dict[str, int], noise: float, max_order: int, delta: float) -> None:
    half = record["half"]
    y = signal(record["seed"], 2 * half + 1 + record["more"], noise)
    fit = tvident.fit_local_polynomials(y, 2 * half + 1, delta=delta, max_order=max_order, selection="average")
    scale = np.abs(fit.derivatives).max(axis=1)
    full = slice(half, y.size - half)
    windows = fit_windows(y, half, delta, max_order, 2)
    weights, average, errors = akaike_average(windows)
    # The residual of a window is good to 1e-6 of itself: so the criterion, and the weights, are to M of those.
    tolerance = 1e-6 * (2 * half + 1) * np.ptp(windows.derivatives, axis=2)
    np.testing.assert_array_less(np.abs(fit.derivatives[:, full].T - average), SCALE * scale + tolerance + 1e-300)
    chosen = np.take_along_axis(weights, fit.order[full, None].astype(int), axis=1)[:, 0]
    assert (chosen > weights.max(axis=1) - 1e-3).all()
    np.testing.assert_allclose(fit.stderr[:, full].T, errors, rtol=1e-3, atol=1e-9 * scale.max())


@given(
    seed=st.integers(0, 2**32),
    half=st.integers(3, 60),
    gain=st.sampled_from([1e-6, 3.0, 1e6]),
    shift=st.sampled_from([0.0, 1.0, 1e3]),
    selection=st.sampled_from(SELECTIONS),
)
def test_scale_shift_and_time_reversal(seed: int, half: int, gain: float, shift: float, selection: Selection) -> None:
    y = signal(seed, 6 * half + 1, 0.1)
    plain = tvident.fit_local_polynomials(y, 2 * half + 1, selection=selection)
    scaled = tvident.fit_local_polynomials(gain * (y + shift), 2 * half + 1, selection=selection)
    turned = tvident.fit_local_polynomials(y[::-1].copy(), 2 * half + 1, selection=selection)
    # A shift costs digits of the samples themselves: 1e3 on a signal of 1 leaves 1e-13.
    allowed = 1e-7 * np.abs(plain.derivatives).max(axis=1)[:, None]
    expected = plain.derivatives + np.array([[shift], [0], [0]])
    same = plain.order == scaled.order
    assert same.mean() > 0.95
    if selection != "window":
        assert (np.abs(scaled.derivatives / gain - expected) <= allowed + 1e-9 * shift)[:, same].all()
    sign = np.array([[1], [-1], [1]])
    same = plain.order == turned.order[::-1]
    assert same.mean() > 0.95
    assert (np.abs(turned.derivatives[:, ::-1] * sign - plain.derivatives) <= allowed)[:, same].all()


@pytest.mark.parametrize("selection", SELECTIONS)
@pytest.mark.parametrize("order", [0, 1, 4, 9])
def test_an_exact_polynomial_keeps_its_order(selection: Selection, order: int) -> None:
    x = np.linspace(-1, 1, 700)
    y = np.polynomial.Legendre.basis(order)(x)
    fit = tvident.fit_local_polynomials(y, 101, delta=x[1] - x[0], selection=selection)
    expected = np.array([np.polynomial.Legendre.basis(order).deriv(d)(x) if d else y for d in range(3)])
    # Fits of order 9 lose digits in derivatives: gain of rounding at 101 samples.
    assert (np.abs(fit.derivatives - expected) <= 1e-7 * np.abs(expected).max(axis=1, keepdims=True) + 1e-9).all()
    assert (fit.order[50:-50] <= order).all()


@pytest.mark.parametrize("selection", ["pooled", "average"])
def test_the_same_bits_from_any_number_of_workers(selection: Selection) -> None:
    y = signal(5, 70_000, 0.1)
    alone = tvident.fit_local_polynomials(y, 301, selection=selection, workers=1)
    for workers in (2, 3):
        together = tvident.fit_local_polynomials(y, 301, selection=selection, workers=workers)
        assert np.array_equal(alone.derivatives, together.derivatives)
        assert np.array_equal(alone.order, together.order)
        assert np.array_equal(alone.stderr, together.stderr)
    stepped = tvident.fit_local_polynomials(y, 301, selection=selection, step=7)
    assert np.array_equal(stepped.derivatives, alone.derivatives[:, ::7])
    assert np.array_equal(stepped.stderr, alone.stderr[:, ::7])


@pytest.mark.parametrize("selection", ["pooled", "average"])
def test_values_that_are_no_number_stay_in_their_windows(selection: Selection) -> None:
    y = signal(6, 1000, 0.1)
    y[400] = np.nan
    fit = tvident.fit_local_polynomials(y, 51, selection=selection)
    invalid = np.isnan(fit.derivatives[2])
    assert np.array_equal(np.flatnonzero(invalid), np.arange(375, 426))
    assert ((fit.status & Status.INVALID != 0) == invalid).all()
    assert np.array_equal(np.isnan(fit.stderr[0]), invalid)
    at_the_end = tvident.fit_local_polynomials(np.r_[np.nan, y[:300]], 51, selection=selection)
    assert np.isnan(at_the_end.derivatives[:, :26]).all()
    assert np.isfinite(at_the_end.derivatives[:, 26:]).all()


def test_a_resting_channel_is_flat() -> None:
    y = np.r_[np.zeros(300), signal(7, 700, 0.1)]
    for selection in SELECTIONS:
        fit = tvident.fit_local_polynomials(y, 51, selection=selection)
        assert not fit.derivatives[:, :200].any()
        assert np.isfinite(fit.derivatives).all()


@pytest.mark.parametrize("selection", SELECTIONS)
@pytest.mark.parametrize("noise", [1e-3, 1e-2, 1e-1])
@pytest.mark.parametrize("window", [101, 201])
def test_standard_errors_know_that_another_recording_would_choose_another_order(
    selection: Selection, noise: float, window: int
) -> None:
    """The noise of the order chosen alone is too small by 1.1 to 1.8 times for the derivatives of the simulated rig."""
    recording = tvident.simulate_torsional_rig(duration=30.0, seed=12, angle_noise=noise)
    truth = (recording.true_angle, recording.true_velocity, recording.true_acceleration)
    fit = tvident.fit_local_polynomials(recording.angle, window, sample_rate=1000.0, selection=selection)
    inside = slice(200, -200)
    for found, error, true in zip(fit.derivatives, fit.stderr, truth, strict=True):
        distance = np.abs(found - true)[inside]
        ratio = np.sqrt(np.mean(distance**2) / np.mean(error[inside] ** 2))
        assert 0.8 < ratio < 1.15
        assert 0.91 < np.mean(distance <= 1.96 * error[inside]) < 0.985


@pytest.mark.parametrize(("snr_db", "limit"), [(40, 1.05), (20, 1.25)])
def test_pooling_comes_near_the_best_order(snr_db: int, limit: float) -> None:
    """Second derivative of the simulated rig, windows of 101 samples: RMSE over that of the order best for all of them."""
    recording = tvident.simulate_torsional_rig(duration=20.0, seed=11, angle_noise=10 ** (-snr_db / 20))
    inside = slice(200, -200)

    def error(**options: object) -> float:
        fit = tvident.fit_local_polynomials(recording.angle, 101, sample_rate=1000.0, **options)  # type: ignore[arg-type]
        return float(np.sqrt(np.mean((fit.derivatives[2] - recording.true_acceleration)[inside] ** 2)))

    best = min(error(order=order) for order in range(2, 16))
    assert error(selection="pooled") <= limit * best
    assert error(selection="average") < error(selection="window")


def test_names() -> None:
    with pytest.raises(ValueError, match=r"selection must be 'window', 'pooled' or 'average'; got 'best'"):
        tvident.fit_local_polynomials(np.zeros(100), 11, selection="best")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no selection"):
        _core.LocalPolynomials(11, None, 5, "aicc", "best", [0], 1.0, noise=True, quantisation=0.0)
