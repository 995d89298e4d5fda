"""Windows of a duration: a direct least-squares fit of the rows within, borders that rounding moves, and what times say of themselves."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from tvident import Status
from tvident._units import UnitError

Alignment = Literal["centre", "trailing", "leading"]
Array = npt.NDArray[np.float64]

ROUNDING = 1e-12
"""Orthogonal solutions are good to condition · ε · √rows of the size of what is summed; room for two of them, and for weights."""


def irregular_ticks(generator: np.random.Generator, n: int, kind: str, duration: int) -> npt.NDArray[np.int64]:
    """Give increasing times in ticks on borders of windows, of equal steps or bursts, with a gap that no grid has."""
    steps = {
        "lost": np.where(generator.random(n) < 0.1, 2, 1),
        "even": np.ones(n, dtype=np.int64),
        "random": generator.integers(1, 2 + duration // 3, n),
        "bursts": np.where(generator.random(n) < 0.05, 4 * duration, 1),
        "sparse": generator.integers(1, 2 + 2 * duration, n),
    }[kind]
    steps[generator.integers(1, n)] = 9 * n * duration
    ticks: npt.NDArray[np.int64] = np.cumsum(steps) - steps[0]
    return ticks


def rows_within(since: npt.NDArray[np.int64], duration: int, alignment: str) -> npt.NDArray[np.intp]:
    """Give the rows of a window, times counted from its own row: of both borders one belongs to it."""
    begin = {"centre": 2 * since >= -duration, "trailing": since > -duration, "leading": since >= 0}[alignment]
    end = {"centre": 2 * since < duration, "trailing": since <= 0, "leading": since < duration}[alignment]
    return np.flatnonzero(begin & end)


def fitted(A: Array, b: Array, weights: Array, *, centred: bool) -> dict[str, Any]:
    """Give what NumPy finds in one window, its condition and what the numbers are compared to."""
    root = np.sqrt(weights)
    columns, sides = A * root[:, None], b * root[:, None]
    norms = np.linalg.norm(columns, axis=0)
    x = np.linalg.lstsq(columns / norms, sides)[0] / norms[:, None]
    inverse = np.linalg.pinv(columns / norms)
    rss = ((sides - columns @ x) ** 2).sum(axis=0)
    around = (weights @ b) / weights.sum() if centred else 0.0
    spread = np.linalg.norm(inverse, axis=1) / norms
    return {
        "params": x,
        "stderr": spread[:, None] * np.sqrt(rss / max(b.shape[0] - A.shape[1], 1)),
        "rss": rss,
        "rsquared": 1 - rss / (weights @ (b - around) ** 2),
        "condition": np.sqrt(A.shape[1]) * np.linalg.norm(inverse),
        "scale": np.linalg.norm(sides, axis=0) * spread[:, None],
    }


# What hypothesis draws.
@given(
    seed=st.integers(0, 2**32),
    n=st.sampled_from([130, 40, 700, 9, 3]),
    shape=st.tuples(st.sampled_from([2, 1, 3, 4, 6, 7, 12, 16]), st.integers(1, 3)),
    alignment=st.sampled_from(["centre", "trailing", "leading"]),
    kind=st.sampled_from(["lost", "even", "random", "bursts", "sparse"]),
    duration=st.sampled_from([20, 21, 150, 8, 3]),
    clock=st.sampled_from(
        [(2.0**-10, 0.0), (2.0**-10, 2.0**30), (1e-3, -7.0), (1e-9, 0.0), (3600.0, 0.0), (1e-2, 1.7e9)]
    ),
    lost=st.sampled_from([0.0, 0.03, 0.4]),
    unused=st.sampled_from([None, 0.0, 0.3]),
    least=st.sampled_from([None, 0, 5]),
    step=st.integers(1, 3),
)
def test_windows_of_a_duration_equal_a_direct_least_squares_fit(
    seed: int, n: int, shape: tuple[int, int], alignment: Alignment, kind: str, duration: int, clock: tuple[float, float],
    lost: float, unused: float | None, least: int | None, step: int,
) -> None:  # fmt: skip
    generator = np.random.default_rng(seed)
    ticks = irregular_ticks(generator, n, kind, duration)
    windows = [rows_within(ticks - ticks[row], duration, alignment) for row in range(n)]
    most = max(rows.size for rows in windows)
    p, q = min(shape[0], max(most - 1, 1)), shape[1]
    asked = None if least is None or most <= p else min(p + 1 + least, most)
    A, b = generator.standard_normal((n, p)), generator.standard_normal((n, q))
    has_constant = bool(generator.integers(2))
    A[:, -1] = 7.0 if has_constant else A[:, -1]
    weights = None if unused is None else np.where(generator.random(n) < unused, 0.0, generator.uniform(0.1, 10, n))
    if weights is not None:
        weights[n // 2] = 1.0
    noise = np.ones(n) if weights is None else weights
    missing = (generator.random(n) < lost) & (noise > 0) & (np.arange(n) != n // 2)
    spoiled_A, spoiled_b = A.copy(), b.copy()
    spoiled_A[missing & (np.arange(n) % 2 == 0), 0], spoiled_b[missing & (np.arange(n) % 2 == 1), 0] = np.inf, np.nan
    # A window that never holds enough rows is refused.
    if n <= p + 1 or most <= p:
        return
    found = tvident.rolling_least_squares(
        spoiled_A, spoiled_b, f"{duration * clock[0]!r} s", t=ticks * clock[0] + clock[1], alignment=alignment,
        weights=weights, min_observations=asked, step=step,
    )  # fmt: skip
    usual = float(np.median(np.diff(ticks)))
    before = {"centre": duration / 2, "trailing": duration, "leading": 0}[alignment]
    last = (n - 1) // step
    near = np.r_[:15, -15:0] % (last + 1)
    for place in {*near.tolist(), *generator.integers(last + 1, size=30).tolist()}:
        row = place * step
        every, begin = windows[row], ticks[row] - before
        within = min(begin + duration, ticks[-1] + usual / 2) - max(begin, -usual / 2)
        rows = every[(noise[every] > 0) & ~missing[every]]
        status = Status(int(found.status[place]))
        assert (Status.EDGE in status) == (within < duration)
        assert (Status.GAP in status) == (asked is not None and bool(missing[every].any()))
        spoilt = asked is None and bool(missing[every].any())
        if spoilt or rows.size < (asked or p + 1) or (asked is None and 2 * within < duration):
            assert Status.INVALID in status
            for name in ("params", "stderr", "rss", "rsquared", "residuals"):
                assert np.isnan(getattr(found, name)[place]).all(), name
            continue
        is_constant = has_constant or np.ptp(A[(noise > 0) & ~missing, 0]) == 0
        expected = fitted(A[rows], b[rows], noise[rows], centred=is_constant)
        if expected["condition"] > 1e4:
            continue
        allowed = ROUNDING * expected["condition"]
        assert Status.INVALID not in status
        assert (np.abs(found.params[place] - expected["params"]) <= allowed * expected["scale"]).all()
        assert found.condition[place] == pytest.approx(expected["condition"], rel=allowed)
        size = noise[rows] @ b[rows] ** 2
        assert (np.abs(np.sqrt(found.rss[place]) - np.sqrt(expected["rss"])) <= allowed * np.sqrt(size)).all()
        left = b[row] - A[row] @ expected["params"] if row in rows else np.full(q, np.nan)
        np.testing.assert_allclose(found.residuals[place], left, rtol=0, atol=1e-6)
        if rows.size > p + 1:
            np.testing.assert_allclose(found.stderr[place], expected["stderr"], rtol=1e-5)
            np.testing.assert_allclose(found.rsquared[place], expected["rsquared"], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("alignment", ["centre", "trailing", "leading"])
@pytest.mark.parametrize("duration", ["0.1 s", "0.33 s", "0.7 s"])
def test_rounding_of_times_moves_no_row_over_a_border(alignment: Alignment, duration: str) -> None:
    generator = np.random.default_rng(1)
    ticks = np.flatnonzero(generator.random(3000) < 0.9)
    A, b = np.ones((ticks.size, 1)), generator.standard_normal(ticks.size)
    expected = tvident.rolling_least_squares(A, b, duration, t=0.01 * ticks, alignment=alignment)
    for t in (0.01 * ticks + 1.7e9, 0.01 * ticks - 1e6, (0.01 * ticks).astype(np.float32)):
        found = tvident.rolling_least_squares(A, b, duration, t=t, alignment=alignment)
        np.testing.assert_allclose(found.params, expected.params, rtol=1e-9, atol=1e-12)
        assert np.array_equal(found.status, expected.status)


def test_windows_hold_no_later_row_for_the_sake_of_rounding() -> None:
    generator = np.random.default_rng(2)
    t = 2.0**30 + np.cumsum(generator.integers(1, 9, 100)) * 2.0**-22
    A, b = np.ones((100, 1)), generator.standard_normal(100)
    ticks = np.round((t - t[0]) * 2**22).astype(int)
    found = tvident.rolling_least_squares(A, b, f"{20 * 2.0**-22!r} s", t=t, alignment="trailing")
    for row in range(20, 100):
        expected = b[rows_within(ticks - ticks[row], 20, "trailing")].mean()
        assert found.params[row, 0] == pytest.approx(expected, abs=1e-9)


@pytest.fixture
def rows() -> tuple[Array, Array, Array]:
    """Give regressors, right-hand sides and irregular times in seconds."""
    generator = np.random.default_rng(6)
    A, b = generator.standard_normal((400, 2)), generator.standard_normal(400)
    return A, b, np.cumsum(generator.exponential(0.01, 400))


class WithUnit(np.ndarray[Any, Any]):
    """An array that says its unit by an attribute, as those of other packages do."""

    units = "ms"


def test_times_say_their_unit(rows: tuple[Array, Array, Array]) -> None:
    A, b, t = rows
    expected = tvident.rolling_least_squares(A, b, "500ms", t=t)
    for times in (tvident.Channel(1e3 * t, "ms"), (1e3 * t).view(WithUnit), tvident.Channel(t, "s")):
        found = tvident.rolling_least_squares(A, b, "500ms", t=times)
        np.testing.assert_allclose(found.params, expected.params, rtol=1e-9)
        assert np.array_equal(found.status, expected.status)
    with pytest.raises(UnitError, match="the time must be in a unit that can be converted to s; got 'V'"):
        tvident.rolling_least_squares(A, b, "500ms", t=tvident.Channel(t, "V"))


def test_masked_times_are_missing(rows: tuple[Array, Array, Array]) -> None:
    A, b, t = rows
    masked = np.ma.masked_array(t, mask=np.arange(400) == 50)
    with pytest.raises(ValueError, match=r"t must hold finite times; t\[50\] is nan"):
        tvident.rolling_least_squares(A, b, "500ms", t=masked)
    found = tvident.rolling_least_squares(A, b, "500ms", t=np.ma.masked_array(t))
    assert np.array_equal(found.params, tvident.rolling_least_squares(A, b, "500ms", t=t).params)
