"""Derivatives of a stream whose samples are missing, or have weights, are the batch's."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from parameters import examples
from signals import signal
from stream.test_streams import PIECES, joined, streamed
from tvident._arguments import RowPolicy

Array = npt.NDArray[np.float64]

COUNT = 1500


def spoilt(seed: int) -> Array:
    """Give a signal that lacks samples: some alone, short and long bursts, at its ends too."""
    generator = np.random.default_rng(seed)
    y = signal(seed, COUNT)
    y[generator.random(COUNT) < 0.01] = np.nan
    for length in (3, 12, 60, 150):
        first = generator.integers(0, COUNT - length)
        y[first : first + length] = np.nan
    y[: generator.integers(0, 40)] = np.nan
    y[COUNT - generator.integers(0, 40) :] = np.nan
    return y


def weights_of(seed: int) -> Array:
    generator = np.random.default_rng(seed)
    weights = 10 ** generator.uniform(-1, 1, COUNT)
    weights[generator.random(COUNT) < 0.01] = 0
    weights[700:760] = 0
    return weights


def push_all(stream: Any, y: Array, weights: Array | None, lengths: list[int], resume: int) -> list[Any]:
    def push(one: Any, piece: slice) -> Any:
        return one.push(y[piece], **({} if weights is None else {"weights": weights[piece]}))

    return streamed(stream, y.size, lengths, push, resume)


# What hypothesis chooses.
@settings(max_examples=examples(10))
@given(
    PIECES,
    st.sampled_from([(21, None), (101, 5), (201, None)]),
    st.sampled_from([1, 3]),
    st.sampled_from([0, 7]),
    st.sampled_from(["omit", "propagate", "raise"]),
    st.booleans(),
    st.sampled_from([None, 2, 40, "1.7 s"]),
    st.sampled_from([None, 9]),
    st.integers(0, 5),
)
def test_estimates_beside_gaps_are_those_of_the_batch(
    lengths: list[int],
    window: tuple[int, int | None],
    step: int,
    resume: int,
    policy: RowPolicy,
    weighted: bool,
    max_gap: int | str | None,
    least: int | None,
    seed: int,
) -> None:
    y = signal(seed, COUNT) if policy == "raise" else spoilt(seed)
    weights = weights_of(seed) if weighted else None
    gaps: dict[str, Any] = {}
    if policy == "omit" or weighted:
        gaps = {"max_gap": max_gap, "min_observations": least}
    length, order = window
    more: dict[str, Any] = {"sample_rate": 100, "order": order, "step": step, "nan_policy": policy, **gaps}
    stream = tvident.LocalPolynomialStream(length, stderr=True, **more)
    outs = push_all(stream, y, weights, lengths, resume)
    batch = tvident.fit_local_polynomials(y, length, quantisation=0, weights=weights, **more)
    for name in ("derivatives", "stderr", "order", "sigma", "status"):
        equal_nan = name in {"derivatives", "stderr", "sigma"}
        assert np.array_equal(joined(outs, name), getattr(batch, name), equal_nan=equal_nan), name
    assert np.allclose(joined(outs, "time"), np.arange(0, y.size, step) / 100)


@pytest.mark.parametrize("weighted", [False, True])
def test_an_estimate_comes_with_the_sample_that_the_delay_says(weighted: bool) -> None:
    y, weights = spoilt(3), weights_of(3)
    stream = tvident.LocalPolynomialStream(51, nan_policy="omit", max_gap=30)
    given = 0
    for sample in range(400):
        given += stream.push(y[sample], **({"weights": weights[sample]} if weighted else {})).time.size
        assert given == max(sample + 1 - stream.delay, 0)
    assert stream.delay == 51 + 30


def test_a_stream_without_gaps_is_no_later_for_what_was_not_asked() -> None:
    assert tvident.LocalPolynomialStream(201).delay < 201
    assert tvident.LocalPolynomialStream(201, nan_policy="omit").delay == 301


def test_records_shorter_than_a_window_have_no_number() -> None:
    stream = tvident.LocalPolynomialStream(51, nan_policy="omit", stderr=True)
    stream.push(np.r_[np.nan, np.arange(20.0)])
    out = stream.finish()
    assert np.isnan(out.derivatives).all()
    assert out.status.size == 21


def test_wrong_calls_say_what_to_do() -> None:
    y, weights = np.arange(60.0), np.ones(60)
    stream = tvident.LocalPolynomialStream(21)
    stream.push(y)
    with pytest.raises(ValueError, match="samples of a stream must all have weights, or none of them; got some with"):
        stream.push(y, weights=weights)
    stream = tvident.LocalPolynomialStream(21, max_gap=5)
    with pytest.raises(ValueError, match="max_gap must go with nan_policy='omit' or weights; got 5"):
        stream.push(y)
    stream.push(y, weights=weights)
    with pytest.raises(ValueError, match="got some without after others with"):
        stream.push(y)
    with pytest.raises(ValueError, match="weights must be finite and not negative"):
        stream.push(1.0, weights=-1.0)
    with pytest.raises(ValueError, match="weights must have one value for every sample"):
        stream.push(y, weights=weights[1:])
    with pytest.raises(ValueError, match="selection must be 'window' where samples have weights"):
        tvident.LocalPolynomialStream(21, selection="average").push(y, weights=weights)
    with pytest.raises(ValueError, match="sample 3 is nan"):
        tvident.LocalPolynomialStream(21, nan_policy="raise").push([1, 2, 3, np.nan], weights=[1, 1, 1, 1])
    assert tvident.LocalPolynomialStream(21, nan_policy="raise").push([1.0, np.nan], weights=[1, 0]).time.size == 0
