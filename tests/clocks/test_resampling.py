from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline

from tvident import _core

Array = npt.NDArray[np.float64]

ROUNDING = 1e-10
"""Of the samples' scale: two solutions of equations whose condition grows as steps shrink, to a tenth here: below 1e5 at order 7."""


def parts(times: Array, channel: Array, bridged: float, *, propagate: bool) -> Iterator[npt.NDArray[np.intp]]:
    """Give the samples between which nothing is known."""
    there = np.flatnonzero(np.isfinite(channel))
    apart = np.diff(times[there]) > bridged
    if propagate:
        apart |= np.diff(there) > 1
    yield from (part for part in np.split(there, np.flatnonzero(apart) + 1) if part.size)


def reference(times: Array, channel: Array, grid: int, order: int, bridged: float, *, propagate: bool) -> Array:
    """Resample by SciPy's splines, one for each part."""
    found = np.full(grid, np.nan)
    for part in parts(times, channel, bridged, propagate=propagate):
        x, y = times[part], channel[part]
        inside = np.arange(np.ceil(x[0] - 1e-9), min(np.floor(x[-1] + 1e-9), grid - 1) + 1).astype(int)
        if x.size == 1:
            found[inside] = y[0]
            continue
        degree = order if x.size > order else (x.size - 2) // 2 * 2 + 1
        found[inside] = make_interp_spline(x, y, k=degree)(np.clip(inside, x[0], x[-1]))
    return found


@given(
    seed=st.integers(0, 2**32 - 1),
    samples=st.integers(1, 400),
    order=st.sampled_from([1, 3, 5, 7]),
    jitter=st.floats(0, 0.9),
    missing=st.floats(0, 0.3),
    propagate=st.booleans(),
)
def test_channels_are_resampled_as_by_scipy(
    seed: int, samples: int, order: int, jitter: float, missing: float, *, propagate: bool
) -> None:
    generator = np.random.default_rng(seed)
    steps = np.where(generator.random(samples) < 0.02, 6.0, 1.0)
    times = np.cumsum(steps) - steps[0] + jitter * generator.uniform(-0.5, 0.5, samples)
    times -= times[0]
    rows = generator.standard_normal((3, samples))
    rows[1, generator.random(samples) < missing] = np.nan
    grid = int(times[-1]) + 1
    found = _core.Resampling(times, grid, order=order, bridged=3.5, propagate=propagate).onto_grid(rows, workers=1)
    for row, one in zip(rows, found, strict=True):
        expected = reference(times, row, grid, order, 3.5, propagate=propagate)
        assert np.array_equal(np.isnan(one), np.isnan(expected))
        scale = max(1.0, float(np.nanmax(np.abs(expected), initial=0.0)))
        np.testing.assert_allclose(one, expected, rtol=0, atol=ROUNDING * scale)


@pytest.mark.parametrize("order", [1, 3, 5])
def test_the_gain_is_that_of_the_integrals_of_all_splines(order: int) -> None:
    times = np.sort(np.arange(60) + np.random.default_rng(order).uniform(-0.45, 0.45, 60))
    times -= times[0]
    weights = [make_interp_spline(times, one, k=order).integrate(times[0], times[-1]) for one in np.eye(60)]
    found = _core.Resampling(times, 59, order=order, bridged=9.0).gain()
    assert found == pytest.approx(np.sum(np.square(weights)) / times[-1], rel=1e-9)


def test_times_that_do_not_increase_are_refused() -> None:
    with pytest.raises(ValueError, match="times must increase"):
        _core.Resampling(np.array([0.0, 1.0, 1.0]), 2, order=3, bridged=3.0)
