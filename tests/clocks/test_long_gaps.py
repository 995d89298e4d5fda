"""Gaps of more than two samples that leave no window whole: packets with pauses, and records most of which is missing."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long
from tvident._clocks.grid import grid_of
from tvident._clocks.missing import Bridge, bridge_of
from tvident._clocks.order import chosen_order, longest_bridged

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

INERTIA, DAMPING, STIFFNESS = 0.02, 0.2, 60.0
RATE, SAMPLES = 800, 12_000


def rig(seed: int, noise: float, time: Array) -> tuple[Array, Array]:
    """Return the angle of a sum of sines of up to 17 Hz at some times, and the torque that it needs, both with noise."""
    generator = np.random.default_rng(seed)
    angle, torque = np.zeros((2, time.size))
    for frequency, phase in zip(generator.uniform(1, 17, 40), generator.uniform(0, 2 * np.pi, 40), strict=True):
        rate = 2j * np.pi * frequency
        needed = INERTIA * rate**2 + DAMPING * rate + STIFFNESS
        wave = np.exp(rate * time + 1j * phase) / abs(needed)
        angle, torque = angle + wave.real, torque + (needed * wave).real
    channels = np.stack([angle, torque])
    return tuple(channels + noise * channels.std(axis=1, keepdims=True) * generator.standard_normal(channels.shape))


def packets(recorded: int, missing: int) -> Bools:
    return np.asarray(np.arange(SAMPLES) % (recorded + missing) < recorded)


def at_random(share: float, seed: int) -> Bools:
    return np.asarray(np.random.default_rng(seed).random(SAMPLES) >= share)


def check(found: tvident.Identification) -> None:
    """Constants are known to a percent, and are right within their errors."""
    assert found.trusted.mean() > 0.9
    for name, true in (("inertia", INERTIA), ("damping", DAMPING)):
        value, error = found.constants[name]
        assert abs(value - true) < 4 * error, name
        assert error < 0.01 * true, name
    assert np.mean(np.abs(found.stiffness - STIFFNESS) > 4 * found.stderr["stiffness"]) < 0.01


@pytest.mark.parametrize("noise", [1e-3, *long(1e-2, 3e-2)])
@pytest.mark.parametrize(("recorded", "missing"), [(4, 6), *long((4, 3), (4, 5), (20, 3), (20, 5))])
def test_packets_with_pauses_are_bridged(recorded: int, missing: int, noise: float) -> None:
    """Nothing was identified: no test function fits between pauses, though the motion is slow beside them."""
    time = np.arange(SAMPLES) / RATE
    angle, torque = rig(recorded, noise, time)
    there = packets(recorded, missing)
    check(tvident.identify(angle[there], torque[there], t=time[there]))
    check(tvident.identify(np.where(there, angle, np.nan), np.where(there, torque, np.nan), sample_rate=RATE))


@pytest.mark.parametrize("noise", [1e-2, *long(1e-3, 3e-2)])
@pytest.mark.parametrize("share", [0.3, *long(0.4)])
def test_each_channel_may_lack_many_of_its_samples(share: float, noise: float) -> None:
    """A third of the samples of both channels, each on its own, was too much: nothing was trusted."""
    angle, torque = rig(7, noise, np.arange(SAMPLES) / RATE)
    angle, torque = (np.where(at_random(share, seed), one, np.nan) for seed, one in enumerate((angle, torque), start=1))
    check(tvident.identify(angle, torque, sample_rate=RATE))


@pytest.mark.parametrize("seed", [1, *long(2, 3, 4)])
def test_steps_that_jitter_by_more_than_half_are_bridged_where_no_window_is_left(seed: int) -> None:
    """Steps of more than one and a half usual ones were gaps wherever splines added a little to the noise: 4 of 12 found nothing."""
    generator = np.random.default_rng(seed)
    time = np.cumsum(np.maximum(0.05, 1 + 0.5 * generator.standard_normal(SAMPLES))) / RATE
    check(tvident.identify(*rig(seed, 1e-3, time), t=time))


@pytest.mark.parametrize("seed", [1, 2])
def test_motion_that_long_gaps_hide_is_not_bridged(seed: int) -> None:
    """A wave of seven samples in packets of four and pauses of six."""
    noise = 1e-3 * np.random.default_rng(seed).standard_normal(SAMPLES)
    wave = np.sin(2 * np.pi * np.arange(SAMPLES) / 7 + seed) + noise
    there = packets(4, 6)
    assert bridge_of({"angle": np.where(there, wave, np.nan)}).longest <= 3
    times = np.sort(np.arange(SAMPLES) + np.random.default_rng(seed).uniform(-0.5, 0.5, SAMPLES))
    tone = {"angle": np.sin(2 * np.pi * 0.35 * times) + noise}
    grid = grid_of(times)
    assert longest_bridged(grid, tone, chosen_order(grid, tone)) == 1.5


def test_rare_and_longer_gaps_stay() -> None:
    """Long gaps are bridged only where that leaves many more equations."""
    wave = np.sin(np.arange(SAMPLES) / 30)
    rare = wave.copy()
    rare[::12] = np.nan
    for start in range(200, SAMPLES - 200, 400):
        rare[start : start + 4] = np.nan
    assert bridge_of({"angle": rare}).longest == 3
    pauses = np.where(packets(60, 40), wave, np.nan)
    assert bridge_of({"angle": pauses}).longest <= 3
    assert bridge_of({"angle": np.where(packets(4, 6), wave, np.nan)}, order=3) == Bridge(3, 7.0)
