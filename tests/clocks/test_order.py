from __future__ import annotations

import numpy as np
import pytest

from tvident._clocks import grid_of
from tvident._clocks.order import chosen_order, longest_bridged


@pytest.mark.parametrize("seed", range(12))
def test_chance_where_samples_lie_close_makes_no_gaps(seed: int) -> None:
    generator = np.random.default_rng(seed)
    count = 20_000
    # Times that lie anywhere within two steps: some are hardly apart, where splines amplify noise a thousand times.
    times = np.sort(np.arange(count) + generator.uniform(-0.5, 0.5, count))
    channels = {
        "angle": np.sin(times / 20) + 1e-4 * generator.standard_normal(count),
        "torque": np.cos(times / 20) + 0.1 * generator.standard_normal(count),
    }
    grid = grid_of(times)
    order = chosen_order(grid, channels)
    assert longest_bridged(grid, channels, order) >= 2.0


@pytest.mark.parametrize("seed", range(4))
def test_motion_that_splines_do_not_follow_makes_gaps(seed: int) -> None:
    generator = np.random.default_rng(seed)
    count = 20_000
    times = np.sort(np.arange(count) + generator.uniform(-0.5, 0.5, count))
    tone = {"angle": np.sin(2 * np.pi * 0.35 * times) + 1e-3 * generator.standard_normal(count)}
    grid = grid_of(times)
    assert longest_bridged(grid, tone, chosen_order(grid, tone)) == 1.5
