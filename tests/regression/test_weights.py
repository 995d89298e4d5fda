"""Weights of rows are those of numpy's least squares, and rows without weight are not there."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from reference.regression import solve, window_rows
from tvident import Status

# Orthogonal solutions are good to condition · ε · √rows; room for the roots of weights and for two of them.
ROUNDING = 1e-13


@given(
    seed=st.integers(0, 2**32),
    n=st.integers(20, 120),
    p=st.integers(1, 5),
    q=st.sampled_from([0, 2]),
    extra=st.integers(1, 40),
    step=st.integers(1, 4),
    unused=st.sampled_from([0.0, 0.3, 0.8]),
)
def test_every_window_is_weighted_least_squares(
    seed: int, n: int, p: int, q: int, extra: int, step: int, unused: float
) -> None:
    generator = np.random.default_rng(seed)
    window = min(p + extra, n)
    p = min(p, window - 1)
    A: npt.NDArray[np.float64] = generator.standard_normal((n, p))
    b = generator.standard_normal((n, q) if q else n)
    weights = np.where(generator.random(n) < unused, 0.0, generator.uniform(0.1, 10, n))
    weights[n // 2] = 1.0
    spoiled_A, spoiled_b = A.copy(), b.copy()
    spoiled_A[weights == 0], spoiled_b[weights == 0] = np.nan, 1e300
    found = tvident.rolling_least_squares(spoiled_A, spoiled_b, window, weights=weights, step=step)
    for place, centre in enumerate(range(0, n, step)):
        rows = np.arange(n)[window_rows(centre, window, n)]
        full, rows = rows.size, rows[weights[rows] > 0]
        if rows.size <= p or 2 * full < window or full <= p:
            assert found.status[place] & Status.INVALID
            assert np.isnan(found.params[place]).all()
            assert np.isnan(found.stderr[place]).all()
            continue
        root = np.sqrt(weights[rows])
        for side in range(max(q, 1)):
            expected = solve(A[rows] * root[:, None], b.reshape(n, -1)[rows, side] * root)
            if expected.condition > 1e6:
                continue
            at = (place, slice(None), side) if q else (place,)
            allowed = ROUNDING * expected.condition**2 * np.sqrt(rows.size)
            np.testing.assert_allclose(found.params[at], expected.params, rtol=allowed, atol=allowed)
            assert found.rss[(place, side) if q else place] == pytest.approx(expected.rss, rel=1e-6, abs=1e-9)
            if rows.size > p + 1:
                np.testing.assert_allclose(found.stderr[at], expected.stderr, rtol=1e-6)


def test_weights_are_relative() -> None:
    generator = np.random.default_rng(0)
    A, b, weights = generator.standard_normal((200, 2)), generator.standard_normal(200), generator.uniform(1, 2, 200)
    plain, ones = tvident.rolling_least_squares(A, b, 50), tvident.rolling_least_squares(A, b, 50, weights=np.ones(200))
    one, other = (tvident.rolling_least_squares(A, b, 50, weights=factor * weights) for factor in (1.0, 1e-9))
    for name in ("params", "stderr", "condition"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(ones, name))
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-12)
    masked = np.ma.masked_array(weights, mask=np.arange(200) == 100)
    found = tvident.rolling_least_squares(A, b, 50, weights=masked)
    expected = tvident.rolling_least_squares(A, b, 50, weights=np.where(np.arange(200) == 100, 0, weights))
    np.testing.assert_array_equal(found.params, expected.params)


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (-np.ones(50), r"finite and not negative; weights\[0\] is -1.0"),
        (np.full(50, np.inf), "finite and not negative"),
        (np.ones(49), "one value for every sample, shape \\(50,\\); got shape \\(49,\\)"),
        (np.zeros(50), "must leave something to use"),
    ],
)
def test_weights_that_cannot_be_are_refused(weights: npt.NDArray[np.float64], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tvident.rolling_least_squares(np.ones((50, 1)), np.ones(50), 11, weights=weights)
