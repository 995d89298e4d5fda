"""Derivatives with Huber's loss: spikes move them by little, and standard errors hold."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import tvident

Array = npt.NDArray[np.float64]

SAMPLES, RATE, NOISE = 4000, 1000, 0.01
INSIDE = slice(250, -250)
LOSS = 1.35
"""Errors over those of least squares without spikes: a tenth of spikes costs 1.2 in large windows (Huber 1981), chance does the rest."""
COVERAGE = 0.9
"""Of nominal 95 % intervals; some 30 windows of one record share no sample, which scatters coverage by 4 %."""


def signal(spikes: float, size: float, seed: int = 0) -> tuple[Array, Array]:
    """Return samples with spikes of so many standard deviations, and the second derivative of what is below."""
    generator = np.random.default_rng(seed)
    t = np.arange(SAMPLES) / RATE
    w = 2 * np.pi * np.array([3.0, 7.0])[:, None]
    parts = np.array([[1.0], [0.4]]) * np.sin(w * t + np.array([[0.0], [1.0]]))
    values = parts.sum(axis=0) + NOISE * generator.standard_normal(SAMPLES)
    hit = generator.random(SAMPLES) < spikes
    values[hit] += size * NOISE * generator.choice([-1, 1], hit.sum())
    return values, -(w**2 * parts).sum(axis=0)


def error(fit: tvident.LocalPolynomialFit, truth: Array) -> float:
    return float(np.sqrt(np.mean((fit.derivatives[2] - truth)[INSIDE] ** 2)))


@pytest.mark.parametrize("window_length", [151, "auto"])
@pytest.mark.parametrize(("spikes", "size"), [(0.01, 1000.0), (0.1, 100.0)])
def test_spikes_move_derivatives_by_little_and_errors_know(
    window_length: int | str, spikes: float, size: float
) -> None:
    plain, truth = signal(0.0, 0.0)
    spoilt, _ = signal(spikes, size)
    order = 6 if window_length == 151 else None
    alone = tvident.fit_local_polynomials(plain, window_length, order=order, sample_rate=RATE)
    squares = tvident.fit_local_polynomials(spoilt, window_length, order=order, sample_rate=RATE)
    found = tvident.fit_local_polynomials(spoilt, window_length, order=order, sample_rate=RATE, loss="huber")
    assert error(found, truth) < LOSS * error(alone, truth)
    assert error(squares, truth) > 5 * error(alone, truth)
    assert found.settings["loss"] == "huber"
    covered = np.abs(found.derivatives[2] - truth) < 1.96 * found.stderr[2]
    assert covered[INSIDE].mean() > COVERAGE


def test_axes_and_gaps_stay_where_they_are() -> None:
    one, other = signal(0.02, 50.0, seed=1)[0], signal(0.02, 50.0, seed=2)[0]
    other[2000:2003] = np.nan
    both = tvident.fit_local_polynomials(np.stack([one, other], axis=1), 101, axis=0, loss="huber")
    for column, samples in enumerate((one, other)):
        alone = tvident.fit_local_polynomials(samples, 101, loss="huber")
        # Rounds end where the worst of all records has settled, a thousandth of the noise before all of them have.
        np.testing.assert_allclose(both.derivatives[0][:, column], alone.derivatives[0], atol=0.01 * NOISE)
    assert np.isnan(both.derivatives[0][1952:2051, 1]).all()
    assert np.isfinite(both.derivatives[0][:, 0]).all()


def test_a_loss_has_a_name() -> None:
    with pytest.raises(ValueError, match=r"loss must be .squares. or .huber."):
        tvident.fit_local_polynomials(np.arange(100.0), 21, loss="tukey")  # type: ignore[arg-type]
