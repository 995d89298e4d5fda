"""Noise and quantisation of channels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from tvident import Status, _core


def test_a_resting_encoder_has_order_zero() -> None:
    step = 2 * np.pi / 4096
    moving = np.round(np.sin(np.arange(1500) * 0.02) / step) * step
    y = np.r_[np.full(500, moving[0]), moving]
    # Now and then one count off, as a resting encoder is near the edge of a count: less than rounding leaves on average.
    y[100:400] += step * (np.random.default_rng(0).uniform(size=300) < 0.03)
    fit = tvident.fit_local_polynomials(y, 51)
    resting = slice(30, 470)
    assert (fit.order[resting] == 0).all()
    assert (fit.status[resting] & Status.EXACT != 0).mean() > 0.5
    assert fit.sigma[:470].min() >= step / np.sqrt(12)
    unaware = tvident.fit_local_polynomials(y, 51, quantisation=0)
    assert unaware.order[resting].max() > 1
    given_step = tvident.fit_local_polynomials(y, 51, quantisation=step)
    np.testing.assert_array_equal(given_step.order, fit.order)


@given(
    counts=st.sampled_from([256, 4096, 65536]),
    dtype=st.sampled_from(["f8", "f4"]),
    offset=st.sampled_from([0.0, 0.3]),
    seed=st.integers(0, 2**32),
)
def test_the_step_of_an_encoder_is_found(counts: int, dtype: str, offset: float, seed: int) -> None:
    generator = np.random.default_rng(seed)
    step = 2 * np.pi / counts
    angle = np.cumsum(generator.standard_normal(3000)) * 3 * step
    y = (np.round(angle / step) * step + offset).astype(dtype)
    assert _core.quantisation_step(y) == pytest.approx(step, rel=1e-9 if dtype == "f8" else 1e-2)


@given(seed=st.integers(0, 2**32), n=st.integers(25, 3000), level=st.sampled_from([1e-9, 1.0, 1e9]))
def test_no_step_is_found_in_noise(seed: int, n: int, level: float) -> None:
    y = level * np.random.default_rng(seed).standard_normal(n)
    assert _core.quantisation_step(y) == 0


def test_noise_of_every_channel() -> None:
    generator = np.random.default_rng(1)
    t = np.arange(20_000) * 1e-3
    level = np.array([[1e-4], [1e-2], [1.0]])
    y = np.sin(30 * t) + level * generator.standard_normal((3, t.size))
    found = _core.noise(y)
    # 20 000 samples know the noise to some 1 %.
    np.testing.assert_allclose([one.sigma for one in found], level[:, 0], rtol=0.02)
    assert [one.quantisation for one in found] == [0, 0, 0]
    assert _core.noise(y, 0.5)[0].sigma == pytest.approx(0.5 / np.sqrt(12))
    with pytest.raises(ValueError, match="at least 25 samples"):
        _core.noise(y[:, :24])


@pytest.mark.parametrize("bad", [-1.0, np.nan, np.inf])
def test_a_step_is_positive(bad: float) -> None:
    with pytest.raises(ValueError, match="quantisation must be positive and finite"):
        tvident.fit_local_polynomials(np.zeros(100), 11, quantisation=bad)
