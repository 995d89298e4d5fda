from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

import tvident

# SciPy's least squares in raw powers lose digits with the order and the window; up to order 5 and 101 samples they keep ten.
SCIPY = 1e-9


# What hypothesis draws.
@given(
    seed=st.integers(0, 2**32),
    length=st.integers(1, 101),
    polyorder=st.integers(0, 5),
    deriv=st.integers(0, 3),
    delta=st.sampled_from([1.0, 0.01, 20.0]),
    mode=st.sampled_from(["interp", "mirror", "constant", "nearest", "wrap"]),
    dtype=st.sampled_from(["f8", "f4", "i4", ">f8"]),
    axis=st.sampled_from([0, 1, -1]),
)
def test_results_are_scipys(
    seed: int,
    length: int,
    polyorder: int,
    deriv: int,
    delta: float,
    mode: Literal["interp", "mirror", "constant", "nearest", "wrap"],
    dtype: str,
    axis: int,
) -> None:
    polyorder = min(polyorder, length - 1)
    shape = [2, 2]
    shape[axis] = 150
    x = (np.random.default_rng(seed).standard_normal(shape) * 100).astype(dtype)
    call: dict[str, Any] = {"deriv": deriv, "delta": delta, "axis": axis, "mode": mode, "cval": 3.0}
    found = tvident.savgol_filter(x, length, polyorder, **call)
    expected = signal.savgol_filter(x, length, polyorder, **call)
    assert found.shape == expected.shape
    assert found.dtype == expected.dtype.newbyteorder("=")
    # Scaled by what white samples of 100 become, so that a derivative that is almost zero is not held to its own size.
    scale = 100 / delta**deriv
    tolerance = SCIPY * scale if found.dtype == np.float64 else 1e-4 * scale
    np.testing.assert_allclose(found, expected, rtol=1e-4 if found.dtype == np.float32 else 1e-7, atol=tolerance)


def test_an_order_chosen_in_every_window_is_that_of_local_polynomials() -> None:
    y = np.sin(np.arange(500) / 20) + 0.01 * np.random.default_rng(0).standard_normal(500)
    fit = tvident.fit_local_polynomials(y, 51, delta=0.1)
    for deriv in range(3):
        filtered = tvident.savgol_filter(y, 51, "aicc", deriv=deriv, delta=0.1)
        np.testing.assert_allclose(filtered, fit.derivatives[deriv], rtol=1e-9, atol=1e-9)


def test_high_orders_are_exact_where_scipys_are_not() -> None:
    x = np.linspace(-1, 1, 401)
    y = np.polynomial.legendre.legval(x, np.ones(12))
    np.testing.assert_allclose(tvident.savgol_filter(y, 201, 11), y, atol=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"window_length": 11, "polyorder": 11}, "polyorder must be less than window_length"),
        ({"window_length": 51, "polyorder": 16}, "polyorder must be at most 15; got 16.*shorten the window"),
        ({"window_length": 51, "polyorder": "bic"}, "polyorder must be a whole number or 'aicc'; got 'bic'"),
        ({"window_length": 201, "polyorder": 3}, "less than or equal to the length of the record; got 201"),
        ({"window_length": 11, "polyorder": 3, "mode": "none"}, "mode must be 'interp'"),
        ({"window_length": 0, "polyorder": 0}, "window_length must be at least 1"),
        ({"window_length": 11, "polyorder": 3, "deriv": -1}, "deriv must be at least 0"),
        ({"window_length": 11, "polyorder": 3, "delta": 0.0}, "delta must be positive"),
    ],
)
def test_misuse_says_the_rule_the_value_and_the_cure(call: dict[str, Any], message: str) -> None:
    x: npt.NDArray[np.float64] = np.arange(100.0)
    with pytest.raises(ValueError, match=message):
        tvident.savgol_filter(x, **call)


def test_scipys_own_tests_pass_in_its_place(tmp_path: Path) -> None:
    # In a folder of its own, so that this project's pytest settings do not apply to SciPy's tests.
    command = [sys.executable, "-m", "pytest", "-q", "-p", "reference.in_scipys_place", "-p", "no:cacheprovider"]
    command += ["--pyargs", "scipy.signal.tests.test_savitzky_golay"]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    calls = re.search(r"(\d+) calls of tvident.savgol_filter", done.stdout)
    assert calls is not None
    assert int(calls[1]) > 20
