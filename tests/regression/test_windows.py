"""Windows before, around and after a row, with rows that are missing or fade: what a slow solution of each finds, and statsmodels."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest
import statsmodels.api as sm
from hypothesis import given
from hypothesis import strategies as st
from statsmodels.regression.rolling import RollingOLS

import tvident
from reference.regression import solve_fading, window_rows
from tvident import Status

# The reference solves normal equations: good to condition² · ε · rows, with room for the inverse and for squares of errors.
ROUNDING = 1e-13
Alignment = Literal["centre", "trailing", "leading"]


# What hypothesis draws.
@given(
    seed=st.integers(0, 2**32),
    n=st.integers(20, 120),
    p=st.integers(1, 5),
    extra=st.integers(4, 40),
    alignment=st.sampled_from(["centre", "trailing", "leading"]),
    half_life=st.sampled_from([None, 3.5, 20.0]),
    missing=st.sampled_from([0.0, 0.05, 0.5]),
    unused=st.sampled_from([None, 0.0, 0.3]),
    step=st.integers(1, 3),
)
def test_every_window_is_solved_of_what_is_there(
    seed: int,
    n: int,
    p: int,
    extra: int,
    alignment: Alignment,
    half_life: float | None,
    missing: float,
    unused: float | None,
    step: int,
) -> None:
    generator = np.random.default_rng(seed)
    window = min(p + extra, n)
    least = int(generator.integers(p + 1, window + 1))
    A, b = generator.standard_normal((n, p)), generator.standard_normal(n)
    weights = None if unused is None else np.where(generator.random(n) < unused, 0.0, generator.uniform(0.1, 10, n))
    if weights is not None:
        weights[n // 2] = 1.0
    lost = generator.random(n) < missing
    spoiled_A, spoiled_b = A.copy(), b.copy()
    spoiled_A[lost & (np.arange(n) % 2 == 0), 0], spoiled_b[lost & (np.arange(n) % 2 == 1)] = np.inf, np.nan
    if alignment == "centre" or (half_life is not None and 2 * half_life <= p):
        half_life = None
    found = tvident.rolling_least_squares(
        spoiled_A, spoiled_b, window, alignment=alignment, weights=weights, half_life=half_life, step=step,
        min_observations=least,
    )  # fmt: skip
    noise = np.ones(n) if weights is None else weights
    for place, row in enumerate(range(0, n, step)):
        every = np.arange(n)[window_rows(row, window, n, alignment)]
        rows = every[(noise[every] > 0) & ~lost[every]]
        status = Status(int(found.status[place]))
        assert (Status.EDGE in status) == (every.size < window)
        assert (Status.GAP in status) == bool((lost[every] & (noise[every] > 0)).any())
        if rows.size < least:
            assert Status.INVALID in status
            assert np.isnan(found.params[place]).all()
            assert np.isnan(found.rsquared[place])
            continue
        fading = np.ones(rows.size) if half_life is None else 2.0 ** (-np.abs(rows - row) / half_life)
        norms = np.sqrt((noise[rows] * fading) @ A[rows] ** 2)
        condition = np.linalg.cond(A[rows] * np.sqrt(noise[rows] * fading)[:, None] / norms)
        if condition > 1e3:
            continue
        params, error, rss, rsquared = solve_fading(A[rows], b[rows], noise[rows], fading)
        allowed = ROUNDING * condition**2 * window
        scale = np.sqrt((noise[rows] * fading) @ b[rows] ** 2) / norms
        assert (np.abs(found.params[place] - params) <= allowed * scale).all()
        assert found.rss[place] == pytest.approx(rss, rel=1e-6, abs=allowed)
        assert found.rsquared[place] == pytest.approx(rsquared, rel=1e-6, abs=1e-6)
        if row in rows:
            assert found.residuals[place] == pytest.approx(b[row] - A[row] @ params, abs=1e-6)
        else:
            assert np.isnan(found.residuals[place])
        if rows.size > p + 1 and rss > 1e-6:
            np.testing.assert_allclose(found.stderr[place], error, rtol=1e-5)


@pytest.mark.parametrize("constant", [None, 0, 2])
def test_trailing_windows_are_those_of_statsmodels(constant: int | None) -> None:
    generator = np.random.default_rng(0)
    A = generator.standard_normal((300, 3))
    if constant is not None:
        A[:, constant] = 7.0
    b = A @ [1.0, -2.0, 0.5] + generator.standard_normal(300) + 3
    expected = RollingOLS(b, A, 40).fit()
    found = tvident.rolling_least_squares(A, b, 40, alignment="trailing", min_observations=40)
    np.testing.assert_allclose(found.params, expected.params, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.stderr, expected.bse, rtol=1e-9)
    np.testing.assert_allclose(found.rsquared, expected.rsquared, rtol=1e-9)
    np.testing.assert_allclose(found.rss, expected.ssr, rtol=1e-9)


def test_windows_of_at_least_some_rows_are_those_of_statsmodels() -> None:
    generator = np.random.default_rng(1)
    A = sm.add_constant(generator.standard_normal((300, 2)))
    b = A @ [1.0, -2.0, 0.5] + generator.standard_normal(300)
    b[100:125] = np.nan
    A[200, 1] = np.nan
    found = tvident.rolling_least_squares(A, b, 40, alignment="trailing", min_observations=20)
    for row in range(300):
        rows = np.arange(max(0, row - 39), row + 1)
        rows = rows[np.isfinite(b[rows]) & np.isfinite(A[rows]).all(axis=1)]
        if rows.size < 20:
            assert np.isnan(found.params[row]).all()
            continue
        expected = sm.OLS(b[rows], A[rows]).fit()
        np.testing.assert_allclose(found.params[row], expected.params, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found.stderr[row], expected.bse, rtol=1e-9)
        assert found.rsquared[row] == pytest.approx(expected.rsquared, rel=1e-9)


def test_a_full_window_has_the_same_numbers_at_any_of_its_rows() -> None:
    generator = np.random.default_rng(2)
    A, b = generator.standard_normal((5000, 3)), generator.standard_normal(5000)
    centre, trailing, leading = (
        tvident.rolling_least_squares(A, b, 2501, alignment=where) for where in ("centre", "trailing", "leading")
    )
    for name in ("params", "stderr", "rss", "rsquared", "condition"):
        middle = getattr(centre, name)[1250:-1250]
        np.testing.assert_allclose(getattr(trailing, name)[2500:], middle, rtol=1e-11)
        np.testing.assert_allclose(getattr(leading, name)[:-2500], middle, rtol=1e-11)


@pytest.mark.parametrize("alignment", ["trailing", "leading"])
def test_weights_that_fade_stay_exact_and_errors_hold(alignment: Alignment) -> None:
    generator = np.random.default_rng(3)
    rows, half_life = 300_000, 50.0
    A = np.stack([np.ones(rows), generator.standard_normal(rows)], axis=1)
    b = A @ [1.0, 2.0] + 0.1 * generator.standard_normal(rows)
    found = tvident.rolling_least_squares(A, b, 3000, alignment=alignment, half_life=half_life)
    last = rows - 1 if alignment == "trailing" else 0
    near = slice(rows - 3000, rows) if alignment == "trailing" else slice(0, 3000)
    fading = 2.0 ** (-np.abs(np.arange(rows)[near] - last) / half_life)
    params, error, _, _ = solve_fading(A[near], b[near], np.ones(3000), fading)
    np.testing.assert_allclose(found.params[last], params, rtol=1e-12)
    np.testing.assert_allclose(found.stderr[last], error, rtol=1e-9)
    # 500 windows that share next to nothing: 0.95 ± 0.01 for each parameter. With the weight of 144 rows normal errors cover 0.945.
    apart = slice(4000, -4000, 584)
    over = np.abs(found.params[apart] - [1.0, 2.0]) / found.stderr[apart]
    assert 0.92 < np.mean(over < 1.96) < 0.975


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"alignment": "left"}, "alignment must be 'centre', 'trailing' or 'leading'; got 'left'"),
        ({"min_observations": 2}, "more than the 2 regressors and at most the window's 10 rows; got 2; use 3 to 10"),
        ({"min_observations": 11}, "got 11; use 3 to 10"),
        ({"half_life": -1.0, "alignment": "trailing"}, "half_life must be positive and finite; got -1.0"),
        (
            {"half_life": 0.3, "alignment": "trailing"},
            "more rows than the 2 regressors; got 0.3, .* use 2 rows or more",
        ),
        ({"half_life": 5.0}, "must go with alignment='trailing' or 'leading'; got 5.0 with 'centre'"),
        ({"half_life": 5.0, "alignment": "leading", "loss": "huber"}, "got 5 rows with loss='huber'; leave out one"),
        (
            {"half_life": 5.0, "alignment": "leading", "covariance": "hac"},
            "got 5 rows with covariance='hac'; leave out",
        ),
        ({"covariance": "hac", "loss": "huber"}, "must go with loss='squares'; got 'huber'"),
        ({"covariance": "white"}, "covariance must be 'classic' or 'hac'; got 'white'"),
        ({"lags": 3}, "lags must go with covariance='hac'; got 3 with 'classic'"),
        ({"covariance": "hac", "lags": 5}, "less than half of the window's 10 rows; got 5; use 4 or less"),
        ({"window_length": "2 s"}, "number of rows where no time is given; got '2 s'; give sample_rate, delta or t"),
        ({"window_length": 10, "t": np.arange(100.0) ** 2}, "t must be uniform"),
        ({"window_length": "2 s", "t": np.arange(100.0) // 2}, r"t must increase from row to row; t\[1\] is 0 after 0"),
        (
            {"window_length": "20 s", "t": np.arange(100.0) ** 1.1, "covariance": "hac"},
            "covariance='hac' must go with uniform",
        ),
        (
            {"window_length": "20 s", "t": np.arange(100.0) ** 1.1, "half_life": 5.0},
            "half_life must go with uniform times",
        ),
        (
            {"window_length": "1 us", "t": np.arange(100.0) ** 1.1, "min_observations": 4},
            "must hold more rows than the 2 regressors; got '1 us', and 1 rows in the fullest window; lengthen it",
        ),
        (
            {"A": np.ones((3, 3)), "b": np.ones(3), "window_length": "4 s", "t": np.array([0, 1, 5.0])},
            "must hold more rows than the 3 regressors; got '4 s', and 2 rows",
        ),
        (
            {"window_length": "900 s", "t": np.arange(100.0) ** 1.1},
            "at most the time of the record, 156.* got '900 s'",
        ),
    ],
)
def test_windows_that_cannot_be_meant_are_refused(call: dict[str, Any], message: str) -> None:
    good: dict[str, Any] = {"A": np.ones((100, 2)), "b": np.ones(100), "window_length": 10}
    with pytest.raises(ValueError, match=message):
        tvident.rolling_least_squares(**(good | call))


def residuals(A: npt.NDArray[np.float64], b: npt.NDArray[np.float64], params: npt.NDArray[np.float64]) -> Any:
    return b - np.einsum("np,np->n", A, params)


def test_residuals_are_those_of_what_was_given() -> None:
    generator = np.random.default_rng(4)
    A, b = generator.standard_normal((500, 2)), generator.standard_normal(500)
    b[250] += 100
    for loss in ("squares", "huber"):
        found = tvident.rolling_least_squares(A, np.stack([b, -b], axis=1), 60, loss=loss, weights=np.ones(500), step=7)
        expected = residuals(A[::7], b[::7], found.params[..., 0])
        np.testing.assert_allclose(found.residuals[:, 0], expected, rtol=1e-9, atol=1e-9)


@given(
    seed=st.integers(0, 2**32),
    alignment=st.sampled_from(["centre", "trailing", "leading"]),
    jitter=st.sampled_from([0.05, 0.5, 3.0]),
    least=st.sampled_from([None, 4, 12]),
    n=st.sampled_from([60, 150, 900]),
    p=st.sampled_from([1, 2, 6, 10]),
    lost=st.sampled_from([0.0, 0.03]),
)
def test_windows_of_a_duration_hold_the_rows_within(
    seed: int, alignment: Alignment, jitter: float, least: int | None, n: int, p: int, lost: float
) -> None:
    generator = np.random.default_rng(seed)
    duration = 20.0
    t = np.cumsum(1 + jitter * generator.random(n))
    A, b = generator.standard_normal((n, p)), generator.standard_normal(n)
    missing = generator.random(n) < lost
    b[missing] = np.nan
    asked = max(least, p + 1) if least is not None and jitter < 1 else None
    before = {"centre": duration / 2, "trailing": duration, "leading": 0.0}[alignment]
    ends = np.arange(n) + 1 if alignment == "trailing" else np.searchsorted(t, t - before + duration)
    if (ends - np.searchsorted(t, t - before)).max() <= p:
        with pytest.raises(ValueError, match=f"window_length must hold more rows than the {p} regressors; got '20 s'"):
            tvident.rolling_least_squares(A, b, "20 s", t=t, alignment=alignment, min_observations=asked)
        return
    found = tvident.rolling_least_squares(A, b, "20 s", t=t, alignment=alignment, min_observations=asked)
    for row in {0, n - 1, *generator.integers(n, size=30).tolist()}:
        begin = t[row] - before
        since = t - t[row]
        within_window = {
            "centre": (since >= -duration / 2) & (since < duration / 2),
            "trailing": (since > -duration) & (since <= 0),
            "leading": (since >= 0) & (since < duration),
        }
        rows = np.flatnonzero(within_window[alignment])
        step = float(np.median(np.diff(t)))
        within = min(begin + duration, t[-1] + step / 2) - max(begin, t[0] - step / 2)
        status = Status(int(found.status[row]))
        assert (Status.EDGE in status) == (within < duration * (1 - 1e-8))
        assert (Status.GAP in status) == (asked is not None and bool(missing[rows].any()))
        spoilt = asked is None and missing[rows].any()
        rows = rows[~missing[rows]]
        if spoilt or rows.size < (asked or p + 1) or (asked is None and 2 * within < duration):
            assert Status.INVALID in status
            assert np.isnan(found.params[row]).all()
            continue
        if np.linalg.cond(A[rows]) > 100:
            continue
        params, error, rss, _ = solve_fading(A[rows], b[rows], np.ones(rows.size), np.ones(rows.size))
        np.testing.assert_allclose(found.params[row], params, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(found.stderr[row], error, rtol=1e-6)
        assert found.rss[row] == pytest.approx(rss, rel=1e-6, abs=1e-9)
        assert found.residuals[row] == pytest.approx(b[row] - A[row] @ params, abs=1e-8, nan_ok=True)


def test_a_duration_on_uniform_times_is_a_number_of_rows() -> None:
    generator = np.random.default_rng(5)
    A, b, t = generator.standard_normal((900, 2)), generator.standard_normal(900), 5 + np.arange(900) / 100
    one = tvident.rolling_least_squares(A, b, "0.5 s", t=t, alignment="trailing", half_life="0.1 s")
    other = tvident.rolling_least_squares(A, b, 50, alignment="trailing", half_life=10.0)
    np.testing.assert_allclose(one.params, other.params, rtol=1e-9)
    for time in ({"sample_rate": 100}, {"delta": 0.01}):
        same = tvident.rolling_least_squares(A, b, "0.5 s", alignment="trailing", half_life="0.1 s", **time)
        np.testing.assert_allclose(same.params, other.params, rtol=1e-9)
        with pytest.raises(TypeError, match="give only one of delta, sample_rate and t"):
            tvident.rolling_least_squares(A, b, "0.5 s", t=t, **time)
        with pytest.raises(TypeError, match="give only one of delta, sample_rate and t"):
            tvident.rolling_least_squares(A, b, "0.5 s", t=t**1.1, **time)
    # Times with jitter below the distance to a border hold the same rows.
    shaken = t + 0.002 * generator.uniform(-1, 1, 900)
    plain = tvident.rolling_least_squares(A, b, "0.51 s", t=shaken)
    np.testing.assert_allclose(
        plain.params[100:-100], tvident.rolling_least_squares(A, b, 51).params[100:-100], rtol=1e-9
    )


@pytest.mark.parametrize("alignment", ["centre", "trailing", "leading"])
def test_windows_of_a_duration_are_the_same_wherever_times_count_from(alignment: Alignment) -> None:
    generator = np.random.default_rng(5)
    # Whole parts of 2⁻²⁰ s: seconds since 1970 hold them, too.
    t = np.cumsum(np.maximum(np.round(generator.exponential(0.01, 400) * 2**20), 1)) / 2**20
    A, b = generator.standard_normal((400, 2)), generator.standard_normal(400)
    found = tvident.rolling_least_squares(A, b, "500ms", t=t, alignment=alignment)
    later = tvident.rolling_least_squares(A, b, "500ms", t=t + 2.0**30, alignment=alignment)
    for name in ("params", "stderr", "residuals", "status"):
        assert np.array_equal(getattr(found, name), getattr(later, name), equal_nan=True), name


def test_regressors_in_rows_and_times_that_windows_of_rows_do_not_need_hear_the_cure() -> None:
    """They heard "cut one of them" and "resample the record"."""
    generator = np.random.default_rng(3)
    regressors, b = generator.normal(size=(2, 400)), generator.normal(size=400)
    with pytest.raises(ValueError, match=r"got 2 and 400; pass A\.T, a column for each regressor"):
        tvident.rolling_least_squares(regressors, b, 51)
    irregular = np.sort(generator.random(400))
    with pytest.raises(
        ValueError, match=r"as a duration, such as '0\.2 s', or leave out t: windows of 51 rows need none"
    ):
        tvident.rolling_least_squares(regressors.T, b, 51, t=irregular)
