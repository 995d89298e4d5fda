"""Derivatives under noise whose samples are correlated, beside the best Savitzky-Golay filter known afterwards."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import butter, lfilter, savgol_filter

import tvident
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]

RATE = 1000.0
SAMPLES = 4000
INSIDE = slice(200, -200)

AT_MOST = 1.5
"""Error over that of the best filter."""

COVERAGE = (0.90, 0.98)
"""Of nominal 95 % intervals over several records."""


def noise(kind: str, seed: int, samples: int = SAMPLES) -> Array:
    """Return noise of variance one: first-order autoregressive, or of density 1/f."""
    white = np.random.default_rng(seed).standard_normal(samples + 2000)
    if kind == "1/f":
        spectrum = np.fft.rfft(white)
        spectrum[1:] /= np.sqrt(np.arange(1, spectrum.size))
        coloured: Array = np.asarray(np.fft.irfft(spectrum, n=white.size), dtype=np.float64)
    else:
        coloured = np.asarray(lfilter([1.0], [1.0, -float(kind)], white), dtype=np.float64)
    coloured = coloured[2000:]
    return np.asarray(coloured / coloured.std())


def motion(kind: str, samples: int = SAMPLES) -> list[Array]:
    """Return a motion and its two derivatives."""
    t = np.arange(samples) / RATE
    if kind == "constant":
        return [np.ones_like(t), 0 * t, 0 * t]
    if kind == "line":
        return [3 * t, 3 + 0 * t, 0 * t]
    frequencies: Array = np.array([3.0]) if kind == "sine" else np.arange(0.5, 12, 0.5, dtype=np.float64)
    amplitudes: Array = np.where(frequencies == 3.0, 1.0, 0.2)
    phases: Array = np.square(np.arange(frequencies.size, dtype=np.float64))
    turns = 2j * np.pi * frequencies
    waves = amplitudes * np.exp(1j * phases) * np.exp(np.outer(t, turns))
    return [np.asarray((waves * turns**d).sum(axis=1).imag) for d in range(3)]


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def best_filter(y: Array, truth: Array, derivative: int) -> float:
    """Return the least error of any Savitzky-Golay filter of up to half the record."""
    errors = []
    for window in (11, 31, 51, 71, 101, 141, 201, 281, 301, 401, 561, 801, 1121, 1601, 1999):
        # SciPy's own filters of high order lose all digits in long windows.
        for order in range(derivative, 6 if window <= 401 else 4, 2):
            found = savgol_filter(y, window, order, deriv=derivative, delta=1 / RATE)
            errors.append(rms((found - truth)[INSIDE]))
    return min(errors)


def beside_the_best_filter(truth: list[Array], noises: list[Array]) -> tuple[list[list[float]], list[list[float]]]:
    """Return, of every noise, errors of all derivatives over those of the best filter, and which part of the intervals hold the truth."""
    ratios, covered = [], []
    for one in noises:
        y = truth[0] + one
        fit = tvident.fit_local_polynomials(y, "auto", sample_rate=RATE)
        errors = [(fit.derivatives[d] - truth[d]) for d in range(3)]
        ratios.append([rms(errors[d][INSIDE]) / best_filter(y, truth[d], d) for d in range(3)])
        covered.append([float(np.mean(np.abs(errors[d]) <= 1.96 * fit.stderr[d])) for d in range(3)])
    return ratios, covered


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("colour", ["0.5", "0.8", *long("0.9"), "1/f"])
@pytest.mark.parametrize("kind", ["sine", *long("several sines"), "constant", "line"])
def test_no_worse_than_the_best_filter(kind: str, colour: str) -> None:
    """Taken for white, noise of correlation 0.8 made the second derivative 450 times worse: the shortest windows seemed best."""
    ratios, covered = beside_the_best_filter(motion(kind), [0.03 * noise(colour, seed) for seed in range(4)])
    assert (np.exp(np.mean(np.log(ratios), axis=0)) <= AT_MOST).all(), ratios
    if kind not in {"constant", "line"} and colour != "1/f":
        # Errors of windows as long as half the record are the same all along it: four records give few of them.
        low, high = COVERAGE
        assert (np.mean(covered, axis=0) >= low).all(), covered
        assert (np.mean(covered, axis=0)[1:] <= high).all(), covered


LOW_PASSES = {
    "mean of two": (np.full(2, 0.5), [1.0]),
    "mean of five": (np.full(5, 0.2), [1.0]),
    "mean of nine": (np.full(9, 1 / 9), [1.0]),
    "two poles": ([1.0], np.convolve([1.0, -0.7], [1.0, -0.4])),
    "Butterworth": butter(2, 100.0, fs=RATE),
}


def low_passed(name: str, seed: int) -> Array:
    """Return noise of variance one behind a filter."""
    passed = lfilter(*LOW_PASSES[name], np.random.default_rng(seed).standard_normal(SAMPLES + 2000))[2000:]
    return np.asarray(passed / passed.std(), dtype=np.float64)


# Means of seven to nine beside motion up to 12 Hz are still taken for motion: second derivatives are 22 to 34 times worse than the best
# filter.
NOT_TOLD = pytest.mark.xfail(strict=True, reason="noise of so low a corner is taken for motion")
LOW_PASSED = [
    pytest.param(kind, name, marks=NOT_TOLD if (kind, name) == ("several sines", "mean of nine") else ())
    for kind in ("sine", "several sines")
    for name in LOW_PASSES
]


@pytest.mark.first(1)
@pytest.mark.parametrize(("kind", "name"), LOW_PASSED)
def test_low_passed_noise_is_no_motion(kind: str, name: str) -> None:
    """It falls faster than sums of first-order noises: taken for motion, it made second derivatives 200 to 1800 times worse."""
    ratios, covered = beside_the_best_filter(motion(kind), [0.03 * low_passed(name, seed) for seed in range(3)])
    assert (np.exp(np.mean(np.log(ratios), axis=0)) <= 1.0).all(), ratios
    assert (np.mean(covered, axis=0) >= COVERAGE[0]).all(), covered


RISING = {"rising": [-0.5], "at both ends": [0.7, -0.5, 0.3, -0.3]}
"""Poles of noises that are stronger at the highest frequencies than below."""


def of_poles(name: str, seed: int) -> Array:
    """Return autoregressive noise of variance one."""
    coloured = lfilter([1.0], np.poly(RISING[name]), np.random.default_rng(seed).standard_normal(SAMPLES + 2000))[2000:]
    return np.asarray(coloured / coloured.std(), dtype=np.float64)


@pytest.mark.first(1)
@pytest.mark.parametrize("name", RISING)
@pytest.mark.parametrize("kind", ["line", "several sines", *long("constant", "sine")])
def test_noise_that_rises_to_the_highest_frequencies_is_no_motion(kind: str, name: str) -> None:
    """No sum of noises that fall explained it: second derivatives of a line were a million times worse, of sines 20 times."""
    # The error of a constant is the same all along it: each record gives one.
    seeds = range(10 if kind in {"constant", "line"} else 3)
    ratios, covered = beside_the_best_filter(motion(kind), [0.03 * of_poles(name, seed) for seed in seeds])
    assert (np.exp(np.mean(np.log(ratios), axis=0)) <= AT_MOST).all(), ratios
    assert (np.mean(covered, axis=0) >= COVERAGE[0]).all(), covered


@pytest.mark.parametrize("samples", [20_000, *long(200_000)])
def test_noise_of_density_one_over_frequency_is_no_motion_in_long_records(samples: int) -> None:
    """It was known down to a period of 4000 samples. What is slower was taken for motion: second derivatives were 7 to 700 times worse."""
    truth = motion("line", samples)
    x = np.linspace(-1, 1, samples)
    ratios, covered = [], []
    for seed in range(60, 66):
        y = truth[0] + 0.03 * noise("1/f", seed, samples)
        fit = tvident.fit_local_polynomials(y, "auto", sample_rate=RATE, max_deriv=1)
        slope = np.polynomial.Legendre.fit(x, y, 1).deriv()(x) * 2 * RATE / (samples - 1)
        ratios.append(rms(fit.derivatives[1] - truth[1]) / rms(np.asarray(slope - truth[1])))
        covered.append([np.mean(np.abs(fit.derivatives[d] - truth[d]) < 1.96 * fit.stderr[d]) for d in (0, 1)])
    assert np.exp(np.mean(np.log(ratios))) <= AT_MOST, ratios
    assert np.mean(covered, axis=0).min() > COVERAGE[0], covered


@pytest.mark.parametrize("noisy", [0.0, 1e-3, 0.1])
def test_a_motion_of_limited_band_is_no_noise(noisy: float) -> None:
    # Up to a tenth of the sample rate, as flat as noise below.
    generator = np.random.default_rng(1)
    waves = np.linspace(0.015, 0.62, 40)
    phases = np.outer(np.arange(SAMPLES), waves) + generator.uniform(0, 6.28, waves.size)
    y = np.sin(phases).sum(axis=1) + noisy * generator.standard_normal(SAMPLES)
    fit = tvident.fit_local_polynomials(y, "auto")
    slope = (waves * np.cos(phases)).sum(axis=1)
    assert rms((fit.derivatives[1] - slope)[INSIDE]) < 0.05 * rms(slope)


@pytest.mark.parametrize("kind", ["constant", "line"])
@pytest.mark.parametrize("colour", ["0", "0.8", *long("0.5", "0.9", "1/f")])
def test_errors_of_a_trend_hold_up_to_its_ends(kind: str, colour: str) -> None:
    """Near the ends coefficients below their noise are shrunk to nothing. Their errors were nothing, too: half of a record was 0 ± 0."""
    truth = motion(kind)
    covered = []
    for seed in range(20, 28):
        fit = tvident.fit_local_polynomials(truth[0] + 0.03 * noise(colour, seed), "auto", sample_rate=RATE)
        assert (fit.stderr > 0).all()
        covered.append([np.mean(np.abs(fit.derivatives[d] - truth[d]) < 1.96 * fit.stderr[d]) for d in (1, 2)])
    # All of a record is one window: eight records hold eight that share nothing.
    assert (np.mean(covered, axis=0) > COVERAGE[0] - 0.06).all(), covered


@pytest.mark.parametrize("colour", ["0", "0.5", *long("0.3", "0.8", "0.9")])
@pytest.mark.parametrize(("kind", "degree"), [("constant", 0), ("line", 1)])
@pytest.mark.parametrize("samples", [2000, 70_001, *long(20_000, 200_001)])
def test_a_trend_has_windows_as_long_as_itself(kind: str, degree: int, colour: str, samples: int) -> None:
    """They were half of it at most: second derivatives were seven times worse than a polynomial over all of it.

    Of long records windows had to be the longest for each derivative by itself: second derivatives of one of eight were
    300 to 1300 times worse.
    """
    truth = motion(kind, samples)
    x = np.linspace(-1, 1, samples)
    ratios, covered = [], []
    for seed in range(30, 42):
        y = truth[0] + 0.03 * noise(colour, seed, samples)
        fit = tvident.fit_local_polynomials(y, "auto", sample_rate=RATE)
        for d in range(3):
            polynomial = np.polynomial.Legendre.fit(x, y, max(degree, d))
            best = polynomial.deriv(d)(x) * (2 * RATE / (samples - 1)) ** d if d else polynomial(x)
            error = fit.derivatives[d] - truth[d]
            ratios.append(rms(error) / rms(np.asarray(best - truth[d])))
            covered.append(np.mean(np.abs(error) < 1.96 * fit.stderr[d]))
    assert np.exp(np.mean(np.log(np.reshape(ratios, (-1, 3))), axis=0)).max() <= AT_MOST, np.reshape(ratios, (-1, 3))
    assert np.mean(np.reshape(covered, (-1, 3)), axis=0).min() > COVERAGE[0] - 0.03, covered


@pytest.mark.parametrize("samples", [4000, *long(100_000)])
@pytest.mark.parametrize("colour", ["0", "0.8"])
def test_a_slow_change_is_no_trend(colour: str, samples: int) -> None:
    t = np.linspace(0, 1, samples)
    away = 0.3 / np.sqrt(samples / 4000)
    size = 3 if colour == "0.8" else 1
    changes = {
        "bend": size * away * np.maximum(t - 0.6, 0),
        "one slow cycle": size * away / 3 * np.sin(2 * np.pi * t),
        "bump": size * away * np.exp(-(((t - 0.4) / 0.02) ** 2)),
    }
    for name, change in changes.items():
        y = 5 + 2 * t + change + 0.03 * noise(colour, 50, samples)
        fit = tvident.fit_local_polynomials(y, "auto", max_deriv=1)
        assert (np.asarray(fit.window_length) < samples // 2).all(), name
        straight = np.polynomial.Legendre.fit(t, 5 + 2 * t + change, 1)(t)
        assert rms(fit.derivatives[0] - (5 + 2 * t + change)) < 0.7 * rms(np.asarray(5 + 2 * t + change - straight)), (
            name
        )
        assert np.mean(np.abs(fit.derivatives[0] - (5 + 2 * t + change)) < 1.96 * fit.stderr[0]) > 0.8, name


def test_the_noise_that_is_reported_is_all_of_it() -> None:
    y = motion("sine")[0] + 0.03 * noise("0.8", 5)
    fit = tvident.fit_local_polynomials(y, "auto", sample_rate=RATE)
    # 4000 samples of correlation 0.8 know their variance as well as 880 independent ones.
    assert fit.settings["noise"] == pytest.approx(0.03, rel=0.15)


@pytest.mark.parametrize("seed", range(3))
def test_a_random_walk_is_motion(seed: int) -> None:
    y = np.random.default_rng(seed).standard_normal(SAMPLES).cumsum()
    fit = tvident.fit_local_polynomials(y, "auto", max_deriv=0)
    assert rms(fit.derivatives[0] - y) < 1.0


def test_steps_are_motion() -> None:
    y = np.sign(np.sin(np.arange(SAMPLES) * 0.016 + 0.3))
    noisy = y + 0.03 * noise("0.8", 6)
    fit = tvident.fit_local_polynomials(noisy, "auto", max_deriv=0)
    assert rms(fit.derivatives[0] - y) < 0.1


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("gain", [1e-6, 1.0, 1e6])
def test_scale_offset_and_reversed_time(gain: float, offset: float) -> None:
    y = motion("sine")[0] + 0.03 * noise("0.8", 7)
    plain = tvident.fit_local_polynomials(y, "auto")
    other = tvident.fit_local_polynomials(gain * (y + offset)[::-1], "auto")
    np.testing.assert_array_equal(other.window_length, plain.window_length)
    sign = np.array([[1], [-1], [1]])
    allowed = 1e-6 * np.abs(plain.derivatives).max(axis=1, keepdims=True)
    turned = other.derivatives[:, ::-1] * sign / gain - np.array([[offset], [0], [0]])
    assert (np.abs(turned - plain.derivatives) <= allowed * (1 + 1e-3 * offset)).all()
    np.testing.assert_array_equal(other.status[::-1] & Status.INVALID, plain.status & Status.INVALID)
