from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvident._clocks import grid_of

COUNT = np.arange(4000)


@given(seed=st.integers(0, 1000), rate=st.integers(50, 2000), share=st.floats(0.001, 0.3), burst=st.integers(0, 400))
def test_a_uniform_clock_that_lost_samples_is_found_again(seed: int, rate: int, share: float, burst: int) -> None:
    kept = np.random.default_rng(seed).random(COUNT.size) > share
    kept[1000 : 1000 + burst] = False
    kept[[0, -1]] = True
    times = 17.25 + COUNT[kept] / rate
    grid = grid_of(times)
    assert grid.jitter == 0
    assert grid.samples == COUNT.size
    assert np.array_equal(grid.places, COUNT[kept])
    assert grid.period == pytest.approx(1 / rate, rel=1e-9)
    # Stamps of few digits tell samples apart only where their digits are finer than the steps.
    if rate < 400:
        rounded = grid_of(np.round(times, 3))
        assert np.array_equal(rounded.places, COUNT[kept])


@given(seed=st.integers(0, 1000), jitter=st.floats(0.01, 0.9))
def test_jitter_is_told_and_gaps_are_left_out_of_the_period(seed: int, jitter: float) -> None:
    generator = np.random.default_rng(seed)
    times = (COUNT + jitter * generator.uniform(-0.5, 0.5, COUNT.size)) / 500
    times[2000:] += 3.0
    grid = grid_of(times)
    # 4000 steps tell their mean square to some per cent.
    assert grid.jitter == pytest.approx(jitter, rel=0.1)
    assert grid.period == pytest.approx(1 / 500, rel=1e-3)
    assert np.count_nonzero(np.diff(grid.places) > grid.bridged) == 1
    assert grid.numbers[-1] == pytest.approx(COUNT[-1] + 1500, abs=1)


def test_a_record_that_is_mostly_gaps_is_refused() -> None:
    with pytest.raises(ValueError, match=r"t must have no gaps .* the one to t\[3\] is .* on their own"):
        grid_of(np.array([0.0, 0.011, 0.02, 500.0, 500.013]))


@pytest.mark.parametrize("off", [8e-4, 3e-3])
def test_one_time_off_tells_whether_a_clock_is_uniform_wherever_it_is(off: float) -> None:
    numbers = np.delete(np.arange(20_000.0), slice(7000, 7003))
    for place in (0, 1, 2000, 4095, 4096, 10_000, numbers.size - 1):
        times = numbers / 1000
        times[place] += off / 1000
        grid = grid_of(times)
        assert (grid.jitter == 0) == (off < 1e-3), place
        assert grid.samples in {numbers[-1] + 1, numbers[-1]}
