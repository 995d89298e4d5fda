"""Functions that are constant in cells: errors hold what a curve changes by within these."""

from __future__ import annotations

import numpy as np
import pytest

import tvident
from parameters import long
from tvident._expansion.basis import Basis, Coordinate
from tvident._expansion.families import FAMILIES
from tvident._expansion.steps import variance_of_steps


@pytest.mark.slow
@pytest.mark.parametrize("family", ["block_pulse", "haar"])
@pytest.mark.parametrize("seeds", [range(53010, 53011), *long(range(53011, 53016))])
def test_intervals_of_a_curve_of_steps_hold_the_curve(family: str, seeds: range) -> None:
    """They were those of the mean of each cell: 50 to 80 % held, of 20 s with noise of 1 % without a flag."""
    inside = []
    for seed in seeds:
        rig = tvident.simulate_torsional_rig(duration=20, seed=seed, pattern="slider")
        angle = rig.angle + np.random.default_rng(seed).normal(0, 0.01 * rig.angle.std(), rig.angle.size)
        expansion = tvident.Expansion(family, of=rig.slider_position)
        result = tvident.identify(angle, rig.torque, sample_rate=1000, stiffness=expansion)
        inside.append(np.abs(result.stiffness - rig.stiffness) < 1.96 * result.stderr["stiffness"])
        curve = result.expansions["stiffness"]
        np.testing.assert_allclose(curve.stderr_at(rig.slider_position), result.stderr["stiffness"], rtol=1e-9)
    assert np.mean(inside) > 0.88


def of_steps(family: str, levels: list[float], error: float, places: np.ndarray | None = None) -> np.ndarray:
    """Return the variance of steps at some places, or in the middle of each cell."""
    size = len(levels)
    middles = (np.arange(size) + 0.5) / size
    basis = Basis([Coordinate(middles, np.zeros((2, size)), (0.0, 1.0))], [FAMILIES[family]], [size])
    factors = np.linalg.solve(basis.at([middles]), np.array(levels))
    return np.asarray(variance_of_steps(basis, factors, error * np.eye(size), [middles if places is None else places]))


@pytest.mark.parametrize("family", ["block_pulse", "haar"])
def test_a_line_has_a_twelfth_of_the_square_of_its_change(family: str) -> None:
    np.testing.assert_allclose(of_steps(family, [3.0 * k for k in range(8)], 0.0), 9 / 12)


@pytest.mark.parametrize(
    ("family", "size"), [("block_pulse", 8), ("block_pulse", 10), ("block_pulse", 49), ("haar", 8)]
)
def test_borders_of_cells_belong_to_cells(family: str, size: int) -> None:
    """Beyond the upper limit and at inner borders, where rounding decided, nothing was added."""
    borders = np.arange(size + 1) / size
    for places in (borders, np.nextafter(borders, 1).clip(0, 1), np.nextafter(borders, 0)):
        np.testing.assert_allclose(of_steps(family, [3.0 * k for k in range(size)], 0.0, places), 9 / 12)


@pytest.mark.parametrize("family", ["block_pulse", "haar"])
def test_errors_at_the_upper_limit_are_those_beside_it(family: str) -> None:
    rig = tvident.simulate_torsional_rig(duration=5, seed=53010, pattern="slider", angle_noise=1e-2)
    expansion = tvident.Expansion(family, size=8, of=rig.slider_position)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, stiffness=expansion)
    low, high = rig.slider_position.min(), rig.slider_position.max()
    at = result.expansions["stiffness"].stderr_at
    width = high - low
    np.testing.assert_allclose(at([low, high]), at([low + 0.01 * width, high - 0.01 * width]), rtol=1e-9)


@pytest.mark.parametrize("family", ["block_pulse", "haar"])
def test_a_jump_between_level_parts_and_noise_add_nothing(family: str) -> None:
    np.testing.assert_allclose(of_steps(family, [1.0] * 3 + [5.0] * 5, 0.0), 0, atol=1e-20)
    assert not of_steps("block_pulse", [0.0, 0.1, 0.2, 0.1, 0.2, 0.3, 0.1, 0.2], 1.0).any()


def test_smooth_functions_have_none() -> None:
    assert of_steps("legendre", [3.0 * k for k in range(8)], 0.0) == 0
