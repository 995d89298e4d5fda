from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from reference.regression import solve_windows, window_rows
from tvident import Status

# Orthogonal solutions are good to condition · ε · √rows; room for two of them.
ROUNDING = 1e-14


@given(
    seed=st.integers(0, 2**32),
    n=st.integers(20, 300),
    p=st.integers(1, 16),
    q=st.sampled_from([0, 1, 3]),
    extra=st.integers(1, 60),
    step=st.integers(1, 4),
    dtype=st.sampled_from(["f8", "f4", ">f8", "i4"]),
)
def test_every_window_is_numpys_least_squares(
    seed: int, n: int, p: int, q: int, extra: int, step: int, dtype: str
) -> None:
    generator = np.random.default_rng(seed)
    window = min(p + extra, n)
    p = min(p, window - 1)
    A: npt.NDArray[Any] = (generator.standard_normal((n, p)) * 1000).astype(dtype)
    b: npt.NDArray[Any] = (generator.standard_normal((n, q) if q else n) * 1000).astype(dtype)
    found = tvident.rolling_least_squares(A, b, window, step=step)
    centres = range(0, n, step)
    assert found.params.shape == ((len(centres), p, q) if q else (len(centres), p))
    assert found.stderr.shape == found.params.shape
    assert found.rss.shape == ((len(centres), q) if q else (len(centres),))
    windows = [np.arange(n)[window_rows(i, window, n)] for i in centres]
    held = np.array([rows.size for rows in windows])
    np.testing.assert_array_equal(found.status & Status.EDGE != 0, held < window)
    solved = (2 * held >= window) & (held > p)
    assert (found.status[~solved] & Status.INVALID != 0).all()
    assert np.isnan(found.params[~solved]).all()
    columns, sides = A.astype(np.float64), b.astype(np.float64).reshape(n, -1)
    windows, held = [rows for rows in windows if 2 * rows.size >= window and rows.size > p], held[solved]
    norms = np.array([np.linalg.norm(columns[rows], axis=0) for rows in windows])
    for side in range(max(q, 1)):
        expected = solve_windows(columns, sides[:, side], windows)
        norm = np.array([np.linalg.norm(sides[rows, side]) for rows in windows])
        at = (solved, slice(None), side) if q else (solved,)
        allowed = ROUNDING * expected.condition * np.sqrt(held)
        scale = (expected.condition * norm)[:, None] / norms
        assert (np.abs(found.params[at] - expected.params) <= allowed[:, None] * scale).all()
        assert (np.abs(found.condition[solved] - expected.condition) <= allowed * expected.condition).all()
        rss = found.rss[(solved, side) if q else solved]
        assert (np.abs(np.sqrt(rss) - np.sqrt(expected.rss)) <= allowed * norm).all()
        more = held > p + 1
        np.testing.assert_allclose(found.stderr[at][more], expected.stderr[more], rtol=1e-6)


def test_a_glitch_leaves_with_its_row() -> None:
    generator = np.random.default_rng(0)
    A, b = generator.standard_normal((5000, 3)), generator.standard_normal(5000)
    clean = tvident.rolling_least_squares(A, b, 201)
    A[2000] *= 1e4
    b[2000] = 1e9
    dirty = tvident.rolling_least_squares(A, b, 201)
    away = np.abs(np.arange(5000) - 2000) > 101
    np.testing.assert_array_equal(clean.params[away], dirty.params[away])


def test_missing_values_stay_in_their_windows() -> None:
    generator = np.random.default_rng(0)
    A, b = generator.standard_normal((1000, 2)), generator.standard_normal(1000)
    clean = tvident.rolling_least_squares(A, b, 51)
    A[300, 1], b[700] = np.nan, np.inf
    dirty = tvident.rolling_least_squares(A, b, 51)
    i = np.arange(1000)
    hit = (np.abs(i - 300) <= 25) | (np.abs(i - 700) <= 25)
    np.testing.assert_array_equal(dirty.status & Status.INVALID != 0, hit)
    np.testing.assert_array_equal(np.isnan(dirty.params).all(axis=1), hit)
    np.testing.assert_array_equal(dirty.params[~hit], clean.params[~hit])


def test_dependent_regressors_are_flagged_and_nan() -> None:
    x = np.random.default_rng(0).standard_normal(500)
    found = tvident.rolling_least_squares(np.stack([x, 2 * x], axis=1), x, 50)
    assert (found.status & Status.RANK_DEFICIENT != 0).all()
    assert np.isnan(found.params).all()
    assert np.isnan(found.stderr).all()


@given(workers=st.integers(2, 7), window=st.integers(5, 5000))
def test_the_numbers_do_not_depend_on_the_number_of_workers(workers: int, window: int) -> None:
    generator = np.random.default_rng(window)
    A, b = generator.standard_normal((60_000, 3)), generator.standard_normal(60_000)
    one = tvident.rolling_least_squares(A, b, window, workers=1)
    many = tvident.rolling_least_squares(A, b, window, workers=workers)
    np.testing.assert_array_equal(one.params, many.params)
    np.testing.assert_array_equal(one.stderr, many.stderr)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        ({"A": np.ones((100, 17))}, ValueError, "at most 16 columns; got 17"),
        ({"b": np.ones(99)}, ValueError, "as many rows as each other; got 100 and 99"),
        ({"window_length": 2}, ValueError, "window_length must be at least 3 samples; got 2"),
        ({"window_length": 101}, ValueError, "less than or equal to the length of the record; got 101"),
        ({"A": np.ones((10, 5, 2))}, ValueError, r"shape \(n, p\)"),
        ({"b": np.ones(100) * 1j}, TypeError, "b must be real"),
        ({"step": 0}, ValueError, "step must be at least 1"),
        ({"window_length": 10.5}, TypeError, "whole number; got 10.5"),
    ],
)
def test_misuse_says_the_rule_the_value_and_the_cure(
    call: dict[str, Any], error: type[Exception], message: str
) -> None:
    good: dict[str, Any] = {"A": np.ones((100, 2)), "b": np.ones(100), "window_length": 10}
    with pytest.raises(error, match=message):
        tvident.rolling_least_squares(**(good | call))
