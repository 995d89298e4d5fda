"""Standard errors of windows whose residuals are correlated: they cover, and are those of statsmodels where windows are long."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import statsmodels.api as sm

import tvident

Array = npt.NDArray[np.float64]
WINDOW = 400


def correlated(generator: np.random.Generator, rows: int, rho: float) -> Array:
    """Return a process of first order with variance 1."""
    steps = generator.standard_normal(rows + 200) * np.sqrt(1 - rho**2)
    values = np.zeros(rows + 200)
    for row in range(1, rows + 200):
        values[row] = rho * values[row - 1] + steps[row]
    return values[200:]


def problem(seed: int, rows: int, rho: float) -> tuple[Array, Array]:
    """Return a constant and a slow regressor, and right-hand sides with correlated noise."""
    generator = np.random.default_rng(seed)
    A = np.stack([np.ones(rows), correlated(generator, rows, rho)], axis=1)
    return A, A @ [1.0, 2.0] + correlated(generator, rows, rho)


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8])
@pytest.mark.parametrize("alignment", ["centre", "trailing"])
def test_errors_of_correlated_residuals_cover(rho: float, alignment: str) -> None:
    A, b = problem(1, 100_000, rho)
    found = tvident.rolling_least_squares(A, b, WINDOW, alignment=alignment, covariance="hac")  # type: ignore[arg-type]
    apart = slice(WINDOW, -WINDOW, WINDOW)
    over = np.abs(found.params[apart] - [1.0, 2.0]) / found.stderr[apart]
    # Two parameters of 248 windows: 0.95 ± 0.01; the uncertainty of the errors takes up to 0.03 where rho is 0.8.
    assert 0.90 < np.mean(over < 1.96) < 0.985
    classic = tvident.rolling_least_squares(A, b, WINDOW, alignment=alignment)  # type: ignore[arg-type]
    if rho == 0:
        ratio = found.stderr[apart] / classic.stderr[apart]
        assert abs(np.sqrt(np.mean(ratio**2)) - 1) < 0.03
    else:
        assert np.mean(np.abs(classic.params[apart] - [1.0, 2.0]) / classic.stderr[apart] < 1.96) < 0.85


def test_in_long_windows_errors_are_those_of_newey_and_west() -> None:
    A, b = problem(2, 6000, 0.6)
    lags, window = 12, 4001
    found = tvident.rolling_least_squares(A, b, window, covariance="hac", lags=lags)
    assert found.lags == lags
    expected = sm.OLS(b[1000:5001], A[1000:5001]).fit(cov_type="HAC", cov_kwds={"maxlags": lags})
    # Both are estimates of the same variance, of residuals of slightly other fits: √(B / w) is the scatter of either.
    np.testing.assert_allclose(found.stderr[3000], expected.bse, rtol=np.sqrt((lags + 1) / window))


def test_lags_are_what_all_neighbours_ask_for() -> None:
    A, b = problem(7, 3000, 0.0)
    window = 201
    # Rows are looked at some at a time: what neighbours on both sides of a border share counts as well.
    b[[1023, 1024, 2047, 2048]] += 20
    found = tvident.rolling_least_squares(A, b, window, covariance="hac")
    around = np.clip(np.arange(3000), window // 2, 2999 - window // 2)
    products = A * (b - np.einsum("np,np->n", A, found.params[around]))[:, None]
    squares = 0.5 * (products[1:] ** 2 + products[:-1] ** 2).sum(axis=0)
    rho = (products[1:] * products[:-1]).sum(axis=0) / squares
    bend = np.max(np.abs(2 * rho / (1 - rho**2)))
    assert found.lags == np.ceil(1.1447 * np.cbrt(bend**2 * window)) - 1
    # Of the others alone none are asked for.
    assert found.lags


def test_errors_are_those_of_the_definition() -> None:
    A, b = problem(6, 400, 0.5)
    window, lags = 101, 4
    together = lags + 1
    weights = np.random.default_rng(6).uniform(0.5, 2, 400)
    found = tvident.rolling_least_squares(A, b, window, covariance="hac", lags=lags, weights=weights)
    root = np.sqrt(weights)[:, None]

    def fit(first: int) -> Array:
        rows = slice(first, first + window)
        return np.asarray(np.linalg.lstsq((root * A)[rows], root[rows, 0] * b[rows], rcond=None)[0])

    around = [fit(min(max(row - window // 2, 0), 400 - window)) for row in range(400)]
    products = weights[:, None] * A * (b - np.einsum("np,np->n", A, np.array(around)))[:, None]
    sums = np.array([products[row : row + together].sum(axis=0) for row in range(400 - lags)])
    for row in range(50, 350, 37):
        first = row - window // 2
        some = sums[first : first + window - lags]
        given_back = window / (window - lags) / together / (1 - (together + 1) / window)
        rows = slice(first, first + window)
        inverse = np.linalg.inv((weights[:, None] * A)[rows].T @ A[rows])
        expected = np.sqrt(np.diagonal(inverse @ (some.T @ some * given_back) @ inverse))
        np.testing.assert_allclose(found.stderr[row], expected, rtol=1e-9)


@pytest.mark.parametrize("regressors", [1, 2, 3, 4, 5, 9])
@pytest.mark.parametrize("lags", [0, 3])
def test_errors_of_any_number_of_regressors_are_those_of_the_definition(regressors: int, lags: int) -> None:
    generator = np.random.default_rng(7 + regressors)
    window, rows = 61, 300
    A = np.stack([np.ones(rows), *generator.standard_normal((regressors - 1, rows)).cumsum(axis=1)], axis=1)
    b = A.sum(axis=1) + correlated(generator, rows, 0.4)
    found = tvident.rolling_least_squares(A, b, window, covariance="hac", lags=lags)

    def held(row: int) -> slice:
        return slice(
            min(max(row - window // 2, 0), rows - window), min(max(row - window // 2, 0), rows - window) + window
        )

    residuals = [b[row] - A[row] @ np.linalg.lstsq(A[held(row)], b[held(row)])[0] for row in range(rows)]
    products, together = A * np.array(residuals)[:, None], lags + 1
    sums = np.array([products[row : row + together].sum(axis=0) for row in range(rows - lags)])
    for row in range(40, 260, 11):
        some = sums[held(row).start : held(row).stop - lags]
        given_back = window / (window - lags) / together / (1 - (lags + regressors) / window)
        triangle = np.linalg.qr(A[held(row)], mode="r")
        inverse = np.linalg.inv(triangle)
        expected = np.linalg.norm(np.sqrt(given_back) * some @ inverse @ inverse.T, axis=0)
        # An inverse of a normal matrix, here and there, is wrong by ε κ², and so is each of the products between two of them.
        rounding = 4 * regressors * np.finfo(float).eps * found.condition[row] ** 2
        np.testing.assert_allclose(found.stderr[row], expected, rtol=rounding + 1e-13)


def test_any_cutting_gives_the_same_errors() -> None:
    A, b = problem(3, 40_000, 0.5)
    one = tvident.rolling_least_squares(A, b, 101, covariance="hac", workers=1)
    many = tvident.rolling_least_squares(A, b, 101, covariance="hac", workers=3)
    np.testing.assert_array_equal(one.stderr, many.stderr)
    some = tvident.rolling_least_squares(A, b, 101, covariance="hac", step=7)
    for name in ("params", "stderr", "residuals", "rsquared", "status"):
        np.testing.assert_array_equal(getattr(some, name), getattr(one, name)[::7])


def test_a_gap_takes_only_the_errors_of_windows_that_hold_it() -> None:
    A, b = problem(4, 6000, 0.5)
    clean = tvident.rolling_least_squares(A, b, 201, covariance="hac", lags=6)
    b[3000:3005] = np.nan
    holed = tvident.rolling_least_squares(A, b, 201, covariance="hac", lags=6)
    assert np.isnan(holed.stderr[2900:3105]).all()
    assert not np.isnan(holed.stderr[:2900]).any()
    # Rows beside the gap have residuals of windows off their centre: a little other, and none is lost.
    near = np.r_[2700:2890, 3115:3300]
    np.testing.assert_allclose(holed.stderr[near], clean.stderr[near], rtol=0.1)
    np.testing.assert_array_equal(holed.stderr[:2500], clean.stderr[:2500])
    omitted = tvident.rolling_least_squares(A, b, 201, covariance="hac", lags=6, min_observations=100)
    assert np.isfinite(omitted.stderr).all()


def test_columns_are_solved_as_alone_and_weights_count() -> None:
    A, b = problem(5, 3000, 0.5)
    weights = np.where(np.arange(3000) % 5 == 0, 0.0, 2.0)
    both = tvident.rolling_least_squares(A, np.stack([b, -3 * b], axis=1), 201, covariance="hac", weights=weights)
    alone = tvident.rolling_least_squares(A, np.where(weights > 0, b, 1e9), 201, covariance="hac", weights=weights / 2)
    np.testing.assert_allclose(both.stderr[..., 0], alone.stderr, rtol=1e-12)
    np.testing.assert_allclose(both.stderr[..., 1], 3 * alone.stderr, rtol=1e-9)
