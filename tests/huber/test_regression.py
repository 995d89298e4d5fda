"""Huber's loss in sliding windows: spikes move estimates by little, and standard errors hold."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import Status

ROWS, WINDOW, NOISE = 4000, 201, 0.1
Array = npt.NDArray[np.float64]

LIMIT = 1.345
"""Of residuals, in standard deviations as their median tells them."""
CHANCE = 1.4
"""Mean squares over 380 windows scatter by 7 %, their ratio by 10 %: more than 1.4 once in 10 000 cases."""


def variance(spikes: float, size: float) -> float:
    """Return the variance of Huber's estimate over that of least squares in normal noise: E ψ² / (E ψ′)² (Huber 1981)."""
    x = np.linspace(-12, 12, 200_001) * np.hypot(1, size)

    def normal(deviation: float) -> Array:
        return np.asarray(np.exp(-0.5 * (x / deviation) ** 2) / deviation / np.sqrt(2 * np.pi) * (x[1] - x[0]))

    weight = (1 - spikes) * normal(1.0) + spikes * normal(float(np.hypot(1, size)))
    order = np.argsort(np.abs(x))
    median = np.abs(x)[order][np.searchsorted(np.cumsum(weight[order]), 0.5)]
    limit = LIMIT * median / 0.6745
    return float(np.sum(weight * np.clip(x, -limit, limit) ** 2) / np.sum(weight[np.abs(x) <= limit]) ** 2)


def rows(seed: int, spikes: float, size: float) -> tuple[Array, Array]:
    """Return regressors and right-hand sides of which a part has spikes of so many standard deviations; the second parameter is 3."""
    generator = np.random.default_rng(seed)
    regressors = generator.standard_normal((ROWS, 2))
    truth = np.stack([2 + np.sin(6 * np.arange(ROWS) / ROWS), np.full(ROWS, 3.0)], axis=1)
    sides = (regressors * truth).sum(axis=1) + NOISE * generator.standard_normal(ROWS)
    hit = generator.random(ROWS) < spikes
    sides[hit] += size * NOISE * generator.standard_normal(hit.sum())
    return regressors, sides


def scores(spikes: float, size: float, loss: str) -> tuple[Array, Array]:
    """Return errors of the second parameter, and the same in standard errors, in windows that share no row."""
    apart = slice(WINDOW // 2, -WINDOW // 2, WINDOW)
    found = [
        tvident.rolling_least_squares(*rows(seed, spikes, size), WINDOW, loss=loss)  # type: ignore[arg-type]
        for seed in range(20)
    ]
    errors = np.concatenate([one.params[apart, 1] - 3.0 for one in found])
    return errors, errors / np.concatenate([one.stderr[apart, 1] for one in found])


@pytest.mark.first(1)
@pytest.mark.parametrize(("spikes", "size"), [(0.0, 0.0), (0.05, 10.0), (0.2, 10.0), (0.1, 1000.0)])
def test_spikes_move_parameters_by_little_and_errors_know(spikes: float, size: float) -> None:
    errors, over = scores(spikes, size, "huber")
    plain, _ = scores(0.0, 0.0, "squares")
    assert np.mean(errors**2) < CHANCE * variance(spikes, size) * np.mean(plain**2)
    # 380 windows: 0.95 ± 0.011.
    assert 0.91 < np.mean(np.abs(over) < 1.96) < 0.99


def test_without_residuals_beyond_the_limit_nothing_changes() -> None:
    regressors, _ = rows(0, 0.0, 0.0)
    exact = regressors @ [2.0, 3.0]
    found = tvident.rolling_least_squares(regressors, exact, WINDOW, loss="huber")
    np.testing.assert_allclose(found.params, np.broadcast_to([2.0, 3.0], (ROWS, 2)), rtol=1e-12)


def test_exact_rows_survive_spikes() -> None:
    regressors, _ = rows(0, 0.0, 0.0)
    sides = regressors @ [2.0, 3.0]
    sides[::40] += 1e3
    found = tvident.rolling_least_squares(regressors, sides, WINDOW, loss="huber")
    # The scale is that of rounding or of what is still to settle: far below one part in a million of a spike.
    np.testing.assert_allclose(found.params, np.broadcast_to([2.0, 3.0], (ROWS, 2)), atol=1e-3)


def test_weights_columns_steps_and_holes_go_together() -> None:
    regressors, sides = rows(3, 0.05, 100.0)
    weights = np.where(np.arange(ROWS) % 7 == 0, 0.0, 2.0)
    garbage = np.where(weights > 0, sides, 1e30)
    both = tvident.rolling_least_squares(
        regressors, np.stack([garbage, -2 * garbage], axis=1), WINDOW, loss="huber", weights=weights, step=5
    )
    np.testing.assert_allclose(both.params[..., 1], -2 * both.params[..., 0], rtol=1e-6)
    assert np.abs(both.params[:, 1, 0] - 3).max() < 6 * both.stderr[:, 1, 0].max()
    alone = tvident.rolling_least_squares(regressors, garbage, WINDOW, loss="huber", weights=weights)
    np.testing.assert_allclose(both.params[..., 0], alone.params[::5], atol=1e-2 * np.nanmax(alone.stderr))
    sides[2000] = np.nan
    holed = tvident.rolling_least_squares(regressors, sides, WINDOW, loss="huber")
    lost = np.isnan(holed.params[:, 0])
    assert (lost == (holed.status & Status.INVALID != 0)).all()
    assert lost.sum() == WINDOW


def test_another_loss_is_refused() -> None:
    with pytest.raises(ValueError, match="loss must be 'squares' or 'huber'"):
        tvident.rolling_least_squares(np.ones(50), np.ones(50), 11, loss="tukey")  # type: ignore[arg-type]
