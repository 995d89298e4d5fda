"""Several masses whose damping swings: eighths of the record are alike, and what constants leave is hardly more than the noise."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]

INERTIA, DAMPING, STIFFNESS = (0.02, 0.03), (0.07, 0.07), (12.0, 18.0)
CONSTANTS = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
SWINGS = "damping_0_1"


def identified(
    seed: int, depth: float, period: float, *, rate: float = 500.0, unit: float = 1.0, **options: Any
) -> Any:
    """Identify two masses in 20 s, the second of whose dampers swings by a part of itself, and give the truth of that.

    Angles are sums of sines, whose derivatives are known, and torques follow from them.
    """
    friction = options.pop("friction", 0.0)
    rng = np.random.default_rng(seed)
    times = np.arange(round(20 * rate)) / rate
    motion = np.zeros((3, 2, times.size))
    for mass in range(2):
        for frequency in np.linspace(0.5, 9, 14) * (1 + 0.05 * rng.uniform(size=14)):
            turning, size = 2 * np.pi * frequency, 0.03 / (1 + (frequency / 4) ** 2)
            angle = turning * times + rng.uniform(0, 6)
            motion[:, mass] += size * np.stack([np.sin(angle), turning * np.cos(angle), -(turning**2) * np.sin(angle)])
    swing = DAMPING[1] * (1 + depth * np.sin(2 * np.pi * times / period + rng.uniform(0, 6)))
    apart = motion.copy()
    apart[:, 1] -= motion[:, 0]
    force = np.stack(
        [STIFFNESS[0] * apart[0, 0] + DAMPING[0] * apart[1, 0], STIFFNESS[1] * apart[0, 1] + swing * apart[1, 1]]
    )
    torque = np.array(INERTIA)[:, None] * motion[2] + force + friction * np.sign(motion[1])
    torque[0] -= force[1]
    scatter = [part * one.std(axis=1, keepdims=True) for part, one in ((1e-3, motion[0]), (0.1, torque))]
    angle = motion[0] + scatter[0] * rng.standard_normal(torque.shape)
    torque = unit * (torque + scatter[1] * rng.standard_normal(torque.shape))
    structure = tvident.Chain(2, [("base", 0), (0, 1)])
    identify: Any = tvident.identify
    return identify(angle, torque, structure=structure, sample_rate=rate, dof_axis=0, **options), unit * swing


@pytest.mark.parametrize(
    ("seed", "rate", "unit", "depth", "period"),
    [
        (0, 500.0, 1.0, 0.25, 3.0),
        *long((1, 1000.0, 1e3, 0.25, 3.0), (2, 250.0, 1e-3, 0.3, 1.7), (1, 1000.0, 1e-3, 0.4, 0.9)),
    ],
)
def test_a_damping_that_swings_is_followed_where_constants_leave_hardly_more_than_noise(
    seed: int, rate: float, unit: float, depth: float, period: float
) -> None:
    found, swing = identified(seed, depth, period, rate=rate, unit=unit)
    assert [name for name, kind in found.kinds.items() if kind == "windowed"] == [SWINGS]
    assert not found.record_status
    off = float(np.sqrt(np.mean((found.elements[SWINGS] - swing) ** 2)))
    # It was constant, and wrong by all that it swings.
    assert off < 0.5 * swing.std()


@pytest.mark.parametrize("seed", [0, *long(1)])
@pytest.mark.parametrize(("depth", "period"), [(0.4, 0.9), *long((0.25, 3.0))])
@pytest.mark.parametrize("options", [CONSTANTS, {"stiffness": "windowed", "damping": "constant"}])
def test_a_damping_that_swings_is_contradicted_where_it_was_given_as_constant(
    seed: int, depth: float, period: float, options: dict[str, Any]
) -> None:
    found, _ = identified(seed, depth, period, **options)
    assert found.record_status & Status.KIND_CONTRADICTED
    assert found.kinds[SWINGS] == "constant"
    assert found.tests[SWINGS] < 5e-4
    assert any(SWINGS in line for line in found.advice)


@pytest.mark.parametrize("seeds", [range(3), *long(range(3, 20))])
@pytest.mark.parametrize("options", [{}, {"stiffness": "windowed"}])
def test_nothing_is_said_where_nothing_swings(seeds: range, options: dict[str, Any]) -> None:
    for seed in seeds:
        found, _ = identified(seed, 0.0, 1.0, rate=(250.0, 500.0, 1000.0)[seed % 3], **options)
        assert not found.record_status, (seed, found.advice)
        assert found.kinds[SWINGS] == "constant"


@pytest.mark.parametrize("friction", [0.002, *long(0.004, 0.008)])
def test_a_friction_that_is_missing_is_no_swing(friction: float) -> None:
    found, _ = identified(5, 0.0, 1.0, friction=friction)
    assert not found.record_status & Status.KIND_CONTRADICTED
    assert set(found.kinds.values()) == {"constant"}
