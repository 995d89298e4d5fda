"""Rows of a stream with weights: all of them or none, in one unit."""

from __future__ import annotations

import numpy as np
import pytest

import tvident


def test_rows_of_a_stream_all_have_weights_or_none() -> None:
    A, b = np.arange(40.0).reshape(20, 2) % 7, np.arange(20.0)
    weighted, plain = tvident.RollingStream(9), tvident.RollingStream(9)
    weighted.push(A, b, weights=np.zeros(20))
    with pytest.raises(ValueError, match="must all have weights, or none of them; got some without after others with"):
        weighted.push(A, b)
    plain.push(A, b)
    with pytest.raises(ValueError, match="got some with after others without"):
        plain.push(A[0], b[0], weights=1.0)
    with pytest.raises(ValueError, match=r"weights must be finite and not negative; weights\[1\] is -1"):
        weighted.push(A[:2], b[:2], weights=[1, -1])
    assert np.isfinite(weighted.push(A, b, weights=np.ones(20)).params[-1]).all()


def test_the_unit_of_weights_is_that_of_the_first_that_are_not_zero() -> None:
    generator = np.random.default_rng(0)
    A, b = generator.standard_normal((60, 2)), generator.standard_normal(60)
    weights = np.r_[np.zeros(20), np.full(40, 1e-300)]
    stream = tvident.RollingStream(10, alignment="trailing")
    pushed = [stream.push(A[piece], b[piece], weights=weights[piece]) for piece in (slice(20), slice(20, 60))]
    batch = tvident.rolling_least_squares(A, b, 10, weights=weights, alignment="trailing")
    np.testing.assert_array_equal(pushed[-1].params[-1], batch.params[-1])
    assert np.isfinite(batch.params[-1]).all()
    with pytest.raises(
        ValueError, match=r"weights of a stream must be at most 1e\+100 times the first that are not 0; got 1"
    ):
        stream.push(A[0], b[0], weights=1.0)
