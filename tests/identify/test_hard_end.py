"""The hard end of what recordings hold: long windows and records, large offsets, hardly any noise, encoders at rest."""

from __future__ import annotations

import subprocess
import sys
import time

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import savgol_filter

import tvident
from parameters import long
from reference.local_polynomials import fit_window
from tvident import Status

Array = npt.NDArray[np.float64]

# Coefficients of every window are good to this fraction of the window's norm, in the bounds of the projection.
COEFFICIENTS = 2e-12
# AICc costs 1.3 to 1.7 times the error of the best fixed order, measured from 20 to 40 dB.
OF_THE_BEST = 2.0
# Noise found in M samples is good to 1/√(2M); of some thousand windows none is farther off than five times that.
FARTHEST = 5.0
# All orders compared and three derivatives, beside one pass of SciPy's filter of a fixed order: 1.1 in the build of the tests, without
# AVX-512; .3 with what is shipped.
AS_LONG_AS_A_FILTER = 1.5


def rounding(fit: tvident.LocalPolynomialFit, y: Array, window: int) -> Array:
    """Give the error of every derivative that the coefficients' errors make: their norm times the gain of the filter."""
    gain = fit.stderr / fit.sigma
    return np.asarray(COEFFICIENTS * np.sqrt(window) * np.abs(y - y.mean()).max() * gain)


def assert_nearly_the_best_order(y: Array, truth: Array, window: int) -> None:
    """Compare the second derivative at the chosen orders with that of the best fixed order, known afterwards only."""
    inside = slice(window // 2, -(window // 2))

    def error(order: int | None) -> float:
        fit = tvident.fit_local_polynomials(y, window, sample_rate=1000, order=order)
        return float(np.sqrt(np.mean((fit.derivatives[2] - truth)[inside] ** 2)))

    assert error(None) < OF_THE_BEST * min(error(order) for order in range(2, 16))


def waves(t: Array, *, fastest: float) -> tuple[Array, Array]:
    """Give three waves and their second derivative."""
    y, acceleration = np.zeros(t.size), np.zeros(t.size)
    for share, phase in ((1.0, 0.3), (0.61, 1.1), (0.27, 2.0)):
        omega = 2 * np.pi * fastest * share
        y += np.sin(omega * t + phase)
        acceleration -= omega**2 * np.sin(omega * t + phase)
    return y, acceleration


@pytest.mark.slow
def test_order_15_in_windows_of_100001_samples() -> None:
    window, n = 100_001, 100_400
    half = window // 2
    y = waves(np.arange(n) / window, fastest=4.0)[0] + 1e-3 * np.random.default_rng(0).standard_normal(n)
    fit = tvident.fit_local_polynomials(y, window, order=15)
    chosen = tvident.fit_local_polynomials(y, window)
    bound = rounding(fit, y, window)
    for i in (half, half + 133, n - half - 1):
        expected = fit_window(y[i - half : i + half + 1], 1.0, 15, 2)
        # The reference is as good; both may err.
        assert (np.abs(fit.derivatives[:, i] - expected.derivatives[:, 15, half]) < 2 * bound[:, i]).all()
        assert chosen.order[i] == expected.scores("aicc").argmin()
        assert fit.sigma[i] == pytest.approx(np.sqrt(expected.rss[15] / (window - 16)), rel=1e-9)


def test_an_offset_of_a_million_leaves_only_the_rounding_of_the_samples() -> None:
    t = np.arange(20_000) / 1000
    wave, acceleration = waves(t, fastest=3.0)
    y = 1e6 + 1e-3 * wave
    fit = tvident.fit_local_polynomials(y, 201, sample_rate=1000)
    inside = slice(100, -100)
    # Samples of 1e6 are rounded to steps of 2^-33, which is uniform noise.
    step = float(np.spacing(1e6))
    assert np.median(fit.sigma[inside]) == pytest.approx(step / np.sqrt(12), rel=FARTHEST / np.sqrt(2 * 201))
    assert_nearly_the_best_order(y, 1e-3 * acceleration, 201)


@pytest.mark.parametrize("noise", [1e-4, 1e-7, 1e-10])
def test_noise_a_ten_thousand_millionth_of_the_signal_is_seen(noise: float) -> None:
    # Within a window the waves turn by 1.9 rad at most, so that a polynomial of order 15 follows them to 1e-15.
    t = np.arange(20_000) / 1000
    y, acceleration = waves(t, fastest=3.0)
    y = y + noise * np.random.default_rng(1).standard_normal(t.size)
    fit = tvident.fit_local_polynomials(y, 101, sample_rate=1000)
    inside = slice(50, -50)
    ratio = fit.sigma[inside] / noise
    assert np.median(ratio) == pytest.approx(1, abs=0.02)
    assert np.abs(ratio - 1).max() < FARTHEST / np.sqrt(2 * (101 - 16))
    assert not (fit.status & Status.EXACT).any()
    assert_nearly_the_best_order(y, acceleration, 101)


@pytest.mark.parametrize("level", [0.0, 1.0, -1e6, 1e-30, 123456.789])
def test_a_resting_encoder_rests(level: float) -> None:
    fit = tvident.fit_local_polynomials(np.full(3000, level), 201, sample_rate=1000)
    np.testing.assert_array_equal(fit.derivatives[0], level)
    np.testing.assert_array_equal(fit.derivatives[1:], 0)
    assert (fit.order == 0).all()
    assert (fit.status & ~np.uint16(Status.EDGE) == Status.EXACT | Status.LOWEST_ORDER).all()
    assert (fit.sigma == 0).all()


def test_an_encoder_that_comes_to_rest_takes_the_lowest_order_there() -> None:
    t = np.arange(6000) / 1000
    count = 2 * np.pi / 4096
    y = np.round(np.where(t < 3, np.sin(4 * np.pi * t), 0.0) / count) * count
    fit = tvident.fit_local_polynomials(y, 201, sample_rate=1000)
    rests = slice(3100, 5900)
    np.testing.assert_array_equal(fit.derivatives[:, rests], 0)
    assert (fit.order[rests] == 0).all()
    assert (fit.order[200:2900] > 0).all()


def test_nothing_moves_and_nothing_is_identified() -> None:
    result = tvident.identify(np.zeros(2000), np.zeros(2000), sample_rate=1000, method="paper")
    flags = Status.INVALID | Status.RANK_DEFICIENT
    assert (result.status[100:-100] & flags == flags).all()
    assert np.isnan(result.stiffness).all()


def test_steps_of_an_encoder_are_noise_of_a_known_size() -> None:
    clean = tvident.simulate_torsional_rig(angle_noise=1e-9)
    rig = tvident.simulate_torsional_rig(encoder_counts=4096)
    fit = tvident.fit_local_polynomials(rig.angle, 201, sample_rate=1000)
    count = 2 * np.pi / 4096
    # A motion of several counts makes rounding errors uniform.
    assert np.median(fit.sigma) == pytest.approx(count / np.sqrt(12), rel=0.05)

    def error(recording: tvident.Recording) -> float:
        result = tvident.identify(recording.angle, recording.torque, sample_rate=1000, method="paper")
        return float(np.sqrt(np.nanmean((result.stiffness - recording.stiffness) ** 2)) / recording.stiffness.mean())

    # The steps are 0.4 % of the angle's standard deviation: noise of 1 % adds 2 % to the error, in the documented table.
    assert error(rig) < 1.05 * error(clean)


@pytest.mark.parametrize("factor", [1e-100, 1e100])
def test_units_do_not_matter(factor: float) -> None:
    y = waves(np.arange(3000) / 1000, fastest=5.0)[0] + 0.01 * np.random.default_rng(2).standard_normal(3000)
    power = 2.0 ** np.round(np.log2(factor))  # a power of two rounds nothing
    fit, scaled = (tvident.fit_local_polynomials(samples, 101) for samples in (y, power * y))
    np.testing.assert_array_equal(scaled.derivatives, power * fit.derivatives)
    np.testing.assert_array_equal(scaled.order, fit.order)


def test_a_glitch_leaves_with_its_sample() -> None:
    y = waves(np.arange(5000) / 1000, fastest=5.0)[0] + 1e-3 * np.random.default_rng(3).standard_normal(5000)
    struck = y.copy()
    struck[2500] = 1e12
    fit, other = (tvident.fit_local_polynomials(samples, 201, order=9) for samples in (y, struck))
    without = np.abs(np.arange(5000) - 2500) > 100
    # Rounding errors of 1e12 stay below 1e-9 of what a window holds without it: 500 times those of its coefficients.
    bound = 500 * rounding(fit, y, 201)
    assert (np.abs(fit.derivatives - other.derivatives) <= bound)[:, without].all()


# Ten million samples, and less than a third of them.
@pytest.mark.slow
@pytest.mark.parametrize("repeats", [50, *long(167)])
def test_millions_of_samples_take_a_filters_time_and_the_last_are_as_good_as_the_first(repeats: int) -> None:
    # The same minute again and again: the truth of the last is the result for the first.
    minute = 60_000
    once = waves(np.arange(minute) / minute, fastest=100.0)[0]
    y = np.tile(once + 0.01 * np.random.default_rng(4).standard_normal(minute), repeats)
    ratios = []
    for _ in range(3):
        # The processor's time of one thread, so that neighbours on the machine do not count, beside one pass of SciPy's filter: seconds
        # say how fast a processor is.
        started = time.process_time()
        savgol_filter(y, 201, 5)
        filtered = time.process_time()
        fit = tvident.fit_local_polynomials(y, 201, workers=1)
        ratios.append((time.process_time() - filtered) / (filtered - started))
        if ratios[-1] < AS_LONG_AS_A_FILTER:
            break
    assert min(ratios) < AS_LONG_AS_A_FILTER
    first, last = slice(200, minute - 200), slice(y.size - minute + 200, y.size - 200)
    same = fit.order[first] == fit.order[last]
    assert same.mean() > 0.999  # ties may fall either way
    bound = rounding(tvident.fit_local_polynomials(y[:minute], 201), y[:minute], 201)[:, first]
    difference = np.abs(fit.derivatives[:, first] - fit.derivatives[:, last])
    assert (difference < 2 * bound)[:, same].all()


@pytest.mark.slow
def test_identification_takes_the_memory_of_its_results() -> None:
    # Derivatives of two million samples alone would take 48 MB. Two threads hold pieces of some 20 000 rows of a dozen numbers: 4 MB.
    program = """
import resource
import numpy as np
import tvident
n = 2_000_000
generator = np.random.default_rng(0)
angle, torque = np.cumsum(generator.standard_normal((2, n)), axis=1)
call = dict(sample_rate=1000.0, method="paper", step=1000, workers=2)
tvident.identify(angle[:100_000], torque[:100_000], **call)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
tvident.identify(angle, torque, **call)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    kilobytes = int(done.stdout) / (1024 if sys.platform == "darwin" else 1)
    assert kilobytes < 16_000
