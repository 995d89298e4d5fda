"""Standard errors of a stream that know of correlated residuals are those of the batch."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from parameters import examples
from stream.test_streams import PIECES, assert_same_windows, streamed
from tvident._regression import Alignment

Array = npt.NDArray[np.float64]


def rows(p: int, q: int, window: int) -> tuple[Array, Array]:
    """Give rows whose residuals are correlated."""
    generator = np.random.default_rng(p + 10 * q + window)
    A, noise = generator.standard_normal((1000, p)), generator.standard_normal((1000, q))
    for row in range(1, 1000):
        noise[row] += 0.7 * noise[row - 1]
    return A, A @ np.ones((p, q)) + noise


@settings(max_examples=examples(15))
@given(
    PIECES,
    st.tuples(st.integers(1, 6), st.integers(1, 2), st.sampled_from([16, 64, 300])),
    st.tuples(st.sampled_from(get_args(Alignment)), st.sampled_from([None, 9]), st.sampled_from([0, 3, 7])),
    st.sampled_from([1, 4]),
    st.sampled_from([0, 7]),
    st.booleans(),
)
def test_correlated_errors_are_those_of_the_batch(
    lengths: list[int],
    shape: tuple[int, int, int],
    told: tuple[Alignment, int | None, int],
    step: int,
    resume: int,
    weighted: bool,
) -> None:
    (p, q, window), (alignment, least, lags) = shape, told
    A, b = rows(p, q, window)
    A[400, 0] = np.nan
    b[[0, 405, 600, 601, 640, 998], -1] = np.nan
    weights = 10 ** np.random.default_rng(1).uniform(-1, 1, 1000)
    weights[[10, 405, *range(700, 730)]] = 0
    more: dict[str, Any] = {"alignment": alignment, "min_observations": least, "step": step}
    more |= {"covariance": "hac", "lags": lags}
    stream = tvident.RollingStream(window, **more)
    assert (
        stream.delay
        == {"centre": window - 1 - window // 2, "trailing": 0, "leading": window - 1}[alignment] + 2 * window
    )

    def push(one: tvident.RollingStream, piece: slice) -> Any:
        return one.push(A[piece], b[piece], weights=weights[piece] if weighted else None)

    outs = streamed(stream, 1000, lengths, push, resume)
    batch = tvident.rolling_least_squares(A, b, window, weights=weights if weighted else None, **more)
    assert np.isfinite(batch.stderr).any()
    assert_same_windows(outs, batch)
    assert np.array_equal(np.concatenate([out.row for out in outs]), np.arange(0, 1000, step))


def test_each_row_comes_with_its_delay_and_memory_is_flat() -> None:
    A, b = rows(2, 1, 50)
    stream = tvident.RollingStream(50, alignment="trailing", covariance="hac", lags=5)
    sizes = []
    for row in range(1000):
        out = stream.push(A[row], b[row, 0])
        expected = [row - 100] if row >= 100 else []
        assert out.row.tolist() == expected
        sizes.append(stream.__getstate__()["_stream"][1].size)
    assert max(sizes[500:]) <= max(sizes[:500])
    assert max(sizes) <= 7 * 50 * 3


def test_lags_of_a_stream_are_given() -> None:
    with pytest.raises(ValueError, match=r"lags must be given where covariance='hac' in a stream.*\.lags"):
        tvident.RollingStream(50, covariance="hac")
    with pytest.raises(ValueError, match="lags must go with covariance='hac'"):
        tvident.RollingStream(50, lags=3)
    with pytest.raises(ValueError, match="half_life must go with covariance='classic'"):
        tvident.RollingStream(50, covariance="hac", lags=3, half_life=10, alignment="trailing")
