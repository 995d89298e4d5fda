"""Arguments that nobody can mean are refused at once, or answered as cheaply as SciPy answers them."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import savgol_filter as scipys

import tvident

Y = np.sin(np.arange(2000) / 50)

AT_ONCE = 1.0
"""Seconds: a table of the size asked for takes minutes, a message takes microseconds, and other programs may be busy."""


@pytest.mark.parametrize("deriv", [4, 16, 10**5, 10**8, 2**31, 2**62])
@pytest.mark.parametrize("mode", ["interp", "wrap"])
def test_derivatives_above_the_order_are_zero_as_scipys_are(deriv: int, mode: Any) -> None:
    began = time.perf_counter()
    found = tvident.savgol_filter(Y, 101, 3, deriv=deriv, mode=mode, delta=0.01)
    assert time.perf_counter() - began < AT_ONCE
    np.testing.assert_array_equal(found, np.zeros(Y.size))
    np.testing.assert_array_equal(found, scipys(Y, 101, 3, deriv=min(deriv, 100), mode=mode))


def test_derivatives_above_the_order_are_missing_where_samples_are() -> None:
    bad = np.where(np.arange(Y.size) == 1000, np.nan, Y)
    found = tvident.savgol_filter(bad, 101, 3, deriv=10**9)
    np.testing.assert_array_equal(np.isnan(found), np.abs(np.arange(Y.size) - 1000) <= 50)


@pytest.mark.parametrize("window_length", [100_003, 2**27 + 1, 2**40 + 1, 2**62])
@pytest.mark.parametrize("mode", ["mirror", "constant", "nearest", "wrap"])
def test_windows_are_not_longer_than_the_record_by_far(window_length: int, mode: Any) -> None:
    began = time.perf_counter()
    with pytest.raises(ValueError, match=rf"at most 100001 for a record of 2000 samples; got {window_length}; shorten"):
        tvident.savgol_filter(Y, window_length, 1, mode=mode)
    assert time.perf_counter() - began < AT_ONCE


@given(
    samples=st.integers(1, 12),
    length=st.integers(2, 60),
    mode=st.sampled_from(["mirror", "constant", "nearest", "wrap"]),
)
def test_windows_longer_than_the_record_give_what_scipys_give(samples: int, length: int, mode: Any) -> None:
    y = np.random.default_rng(samples).standard_normal((2, samples))
    expected = scipys(y, length, 1, mode=mode, cval=0.5)
    # SciPy's coefficients are good to some units in the last place of the largest sample.
    np.testing.assert_allclose(tvident.savgol_filter(y, length, 1, mode=mode, cval=0.5), expected, atol=1e-13 * length)


@pytest.mark.parametrize("max_deriv", [16, 10**5, 10**8, 2**31, 2**62])
@pytest.mark.parametrize("window_length", [101, "auto"])
def test_no_derivative_is_fitted_above_the_highest_order(max_deriv: int, window_length: int | str) -> None:
    began = time.perf_counter()
    with pytest.raises(ValueError, match=f"max_deriv must be at most 15; got {max_deriv}; pass 15 or less"):
        tvident.fit_local_polynomials(Y, window_length, max_deriv=max_deriv)
    assert time.perf_counter() - began < AT_ONCE


@pytest.mark.parametrize("period", [1e-30, 1e-12, 1e12, 1e30])
def test_derivatives_stay_within_the_range_of_doubles(period: float) -> None:
    most = math.floor(100 / abs(math.log10(period)))
    fit = tvident.fit_local_polynomials(Y * 1e20, 31, max_deriv=min(most, 15), delta=period)
    assert np.isfinite(fit.derivatives).all()
    assert np.isfinite(fit.stderr).all()
    if most < 15:
        with pytest.raises(ValueError, match=f"max_deriv must be at most {most} with a sample period of"):
            tvident.fit_local_polynomials(Y, 31, max_deriv=most + 1, delta=period)
        with pytest.raises(ValueError, match=f"deriv must be at most {most} with a sample period of"):
            tvident.savgol_filter(Y, 31, 15, deriv=most + 1, delta=period)


@pytest.mark.parametrize(
    ("given", "rule"),
    [
        ({"delta": 5e-324}, "delta must be between 1e-30 and 1e[+]30 s; got 4.94e-324|got 4.94066e-324"),
        ({"delta": 1e308}, "delta must be between 1e-30 and 1e[+]30 s; got 1e[+]308"),
        ({"delta": 10**400}, "delta must be positive and finite; got 10{10,}"),
        ({"sample_rate": 1e300}, "sample_rate must be between 1e-30 and 1e[+]30 Hz; got 1e[+]300"),
        (
            {"sample_rate": 10**5000},
            "sample_rate must be positive and finite; got a whole number of thousands of digits",
        ),
        ({"t": np.arange(2000) * 1e-300}, "the step of t must be between"),
        ({"t": np.arange(2000) * 1e304}, r"t must hold finite times; t\[1\] is 1e[+]304"),
        ({"quantisation": 1e300}, "quantisation must be at most 1e[+]70; got 1e[+]300"),
        ({"quantisation": 10**400}, "quantisation must be positive and finite; got 1000"),
        ({"window_length": "1e300 s"}, "less than or equal to the length of the record; got '1e300 s'"),
        ({"window_length": 10**400 + 1}, "window_length must be less than 2.63; got 1000"),
    ],
)
def test_numbers_beyond_all_doubles_are_refused(given: dict[str, Any], rule: str) -> None:
    call: dict[str, Any] = {"y": Y, "window_length": 101} | given
    with pytest.raises(ValueError, match=rule):
        tvident.fit_local_polynomials(**call)
