"""Short gaps of a uniform clock: bridged by splines where that costs less than the equations over them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident._arguments import check_no_lost_samples
from tvident._clocks import bridged
from tvident._clocks.missing import Bridge, bridge_of

Array = npt.NDArray[np.float64]
SAMPLES = 6000


def holed(values: Array, share: float, seed: int) -> Array:
    return np.where(np.random.default_rng(seed).random(values.size) < share, np.nan, values)


def wave(period: float) -> Array:
    return np.asarray(np.sin(2 * np.pi * np.arange(SAMPLES) / period))


@pytest.mark.parametrize("seed", [1, 2])
def test_the_order_is_the_one_that_misses_least(seed: int) -> None:
    noise = np.random.default_rng(seed).standard_normal(SAMPLES)
    assert bridge_of({"angle": holed(wave(9.0), 0.05, seed)}).order == 5
    # Splines of high order pass more noise.
    assert bridge_of({"angle": holed(wave(900.0) + noise, 0.05, seed)}).order == 1


@pytest.mark.parametrize("seed", [1, 2])
def test_gaps_are_bridged_where_splines_add_less_than_is_lost(seed: int) -> None:
    slow, fast = (wave(period) + 1e-4 * np.random.default_rng(seed).standard_normal(SAMPLES) for period in (60.0, 10.0))
    assert bridge_of({"angle": holed(slow, 0.01, seed)}).longest == 3
    # Over two samples of ten splines are wrong by sixty times the noise, over one by four times.
    assert bridge_of({"angle": holed(slow, 0.01, seed), "torque": holed(fast, 0.01, seed)}).longest == 2


def test_samples_stay_as_they_are_and_rare_and_long_gaps_are_left_out() -> None:
    angle, torque = wave(60.0), wave(40.0)
    some = holed(angle, 0.05, 3)
    some[1000:1010] = np.nan
    found = bridged({"angle": some, "torque": torque}, None, 1)
    assert found is not None
    there = np.isfinite(some)
    assert np.array_equal(found.channels["angle"][there], some[there])
    assert found.channels["torque"] is torque
    assert set(found.passed) == {"angle"}
    assert np.isnan(found.channels["angle"][1000:1010]).all()
    gone = ~there & np.isfinite(found.channels["angle"])
    assert gone.sum() > 250
    assert np.quantile(np.abs(found.channels["angle"] - angle)[gone], 0.95) < 1e-4
    rare = angle.copy()
    rare[::500] = np.nan
    assert bridged({"angle": rare}, None, 1) is None
    # What an earlier result did is done.
    assert bridged({"angle": rare}, found.settings, 1) is not None
    assert bridged({"angle": some}, {"spline_order": 5, "bridged": 1.5}, 1) is None
    assert bridged({"angle": angle}, None, 1) is None
    assert bridge_of({"angle": some}, order=3) == Bridge(3, 3.0)


@pytest.mark.parametrize("every", [5, 20, 500, 2000])
def test_samples_lost_at_regular_places_are_no_digits(every: int) -> None:
    """Times of 1000 Hz that lost a sample in 500 were those of 998 Hz in three digits: an inertia .4 % off beside an error of .16 %."""
    rig = tvident.simulate_torsional_rig(duration=5.0, seed=1)
    left = np.arange(rig.angle.size) % every != 0
    found = tvident.identify(rig.angle[left], rig.torque[left], t=rig.time[left], stiffness="windowed")
    assert f"at {1000:g} Hz" in found.summary()
    value, error = found.constants["inertia"]
    whole, _ = tvident.identify(rig.angle, rig.torque, sample_rate=1000, stiffness="windowed").constants["inertia"]
    assert abs(value - whole) < error
    fit = tvident.fit_local_polynomials(rig.angle[left], 101, t=rig.time[left])
    expected = tvident.fit_local_polynomials(rig.angle, 101, sample_rate=1000)
    inside = slice(200, -200)
    slope = np.interp(rig.time, fit.time, fit.derivatives[1])
    spread = np.sqrt(np.mean((slope - expected.derivatives[1])[inside] ** 2))
    assert spread < 0.01 * np.std(expected.derivatives[1])


@pytest.mark.slow
@pytest.mark.parametrize("rate", [998.0, 960.0, 990.0])
@pytest.mark.parametrize("noise", [0.0, 1e-5, 1e-2])
def test_digits_of_an_even_clock_are_no_lost_samples(rate: float, noise: float) -> None:
    rig = tvident.simulate_torsional_rig(duration=5.0, sample_rate=rate, seed=2)
    angle = rig.angle + noise * np.random.default_rng(0).standard_normal(rig.angle.size)
    found = tvident.identify(angle, rig.torque, t=np.round(rig.time, 3), stiffness="constant")
    assert f"at {rate:g} Hz" in found.summary()


def test_fast_tones_in_times_of_few_digits_are_of_an_even_clock() -> None:
    """Five steps of 999 Hz are 2 ms in three digits: of a tenth of such records both tones stepped there as if samples were lost."""
    for seed in range(100):
        generator = np.random.default_rng(seed)
        time = generator.random() + np.arange(4995) / 999
        angle = sum(np.sin(2 * np.pi * one * time + 6 * generator.random()) for one in (83, 150))
        check_no_lost_samples(np.round(time, 3), angle + 1e-4 * generator.standard_normal(time.size))
