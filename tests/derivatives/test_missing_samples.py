"""Windows that lack samples are fitted on what is there, and no others change."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from parameters import examples
from tvident import Status
from tvident._huber import pseudo_values

Array = npt.NDArray[np.float64]

# Legendre polynomials at arbitrary places of a window: a design of condition up to 1e3 here, times rounding, times derivatives' gains.
ROUNDING = 1e-8
# What the documentation promises where windows are chosen: errors over those without gaps, and the coverage of nominal 95 % intervals.
PROMISED, COVERED = 3.0, 0.65


def design(places: Array, length: int, order: int, derivative: int = 0) -> Array:
    """Return Legendre polynomials on the window, or their derivatives by the sample number."""
    scale = 2 / length
    columns = []
    for degree in range(order + 1):
        one = np.polynomial.Legendre.basis(degree)
        columns.append((one.deriv(derivative) if derivative else one)(places * scale) * scale**derivative)
    return np.stack(columns, axis=1)


def fitted(
    y: Array, weights: Array, sample: int, length: int, order: int | None, highest: int
) -> tuple[Array, float, int]:
    """Fit the window around a sample by least squares of what has weight: derivatives, noise and order."""
    first = min(max(sample - length // 2, 0), y.size - length)
    rows = np.arange(first, first + length)
    rows = rows[(weights[rows] > 0) & np.isfinite(y[rows])]
    root = np.sqrt(weights[rows])
    best = (np.inf, np.zeros(0), 0.0, 0)
    for n in range(highest + 1) if order is None else [order]:
        if rows.size < n + 3:
            continue
        x = design((rows - sample).astype(float), length, n)
        found = np.linalg.lstsq(x * root[:, None], y[rows] * root, rcond=None)[0]
        rss = float(np.sum((root * (y[rows] - x @ found)) ** 2))
        k, m = n + 1, rows.size
        score = m * np.log(rss) + 2 * k + 2 * k * (k + 1) / (m - k - 1)
        if score < best[0]:
            values = [float((design(np.zeros(1), length, n, d) @ found)[0]) for d in range(3)]
            best = (score, np.array(values), float(np.sqrt(rss / (m - n - 1))), n)
    return best[1], best[2], best[3]


@given(
    seed=st.integers(0, 2**32),
    length=st.sampled_from([9, 21, 51]),
    order=st.sampled_from([2, 3, 4]),
    lost=st.sampled_from([0.01, 0.1, 0.3]),
    weighted=st.booleans(),
)
def test_every_window_is_the_least_squares_of_what_it_holds(
    seed: int, length: int, order: int, lost: float, *, weighted: bool
) -> None:
    generator = np.random.default_rng(seed)
    n = 140
    y = np.sin(np.arange(n) / 9) + 0.1 * generator.standard_normal(n)
    weights = generator.uniform(0.2, 3, n) if weighted else np.ones(n)
    missing = generator.random(n) < lost
    holed = np.where(missing & (np.arange(n) % 2 == 0), np.nan, np.where(missing, np.inf, y))
    options: dict[str, Any] = {"order": order, "max_gap": n, "min_observations": order + 3}
    found = tvident.fit_local_polynomials(
        holed, length, nan_policy="omit", weights=weights if weighted else None, **options
    )
    for sample in {0, n - 1, *generator.integers(n, size=30).tolist()}:
        first = min(max(sample - length // 2, 0), n - length)
        rows = np.arange(first, first + length)
        held = rows[~missing[rows]]
        status = Status(int(found.status[sample]))
        if held.size < order + 3:
            assert Status.INVALID in status
            assert np.isnan(found.derivatives[:, sample]).all()
            continue
        if not missing[rows].any() and not weighted:
            continue
        assert (Status.GAP in status) == bool(missing[rows].any())
        assert (Status.EDGE in status) == (sample - first != length // 2)
        expected, sigma, _ = fitted(holed, np.where(missing, 0, weights), sample, length, order, order)
        size = np.abs(expected) + found.stderr[:, sample]
        assert (np.abs(found.derivatives[:, sample] - expected) <= ROUNDING * size).all()
        assert found.sigma[sample] == pytest.approx(sigma, rel=1e-6)


def test_windows_without_gaps_keep_their_bits_and_errors() -> None:
    generator = np.random.default_rng(0)
    y = np.sin(np.arange(4000) / 40) + 1e-3 * generator.standard_normal(4000)
    clean = tvident.fit_local_polynomials(y, 101)
    holed = y.copy()
    holed[[700, 1500, 1501, 1502, 3990]] = np.nan
    holed[2000:2060] = np.nan
    found = tvident.fit_local_polynomials(holed, 101, nan_policy="omit")
    plain = tvident.fit_local_polynomials(holed, 101)
    whole = plain.status & Status.INVALID == 0
    for name in ("derivatives", "stderr", "order", "sigma", "status"):
        np.testing.assert_array_equal(getattr(found, name)[..., whole], getattr(plain, name)[..., whole])
    # A gap of more than half a window splits the record: nothing in it, and windows end there as at an end.
    assert (found.status[2000:2060] == Status.INVALID | Status.GAP).all()
    assert (found.status[1999 - 40 : 2000] & (Status.EDGE | Status.GAP | Status.INVALID) == Status.EDGE).all()
    assert np.isfinite(found.derivatives[:, :2000]).all()
    assert np.isfinite(found.stderr[:, 2060:]).all()
    assert (found.status[650:751] & Status.GAP != 0).all()
    near = np.r_[655:690, 1510:1550]
    assert np.abs(found.derivatives[2, near] - clean.derivatives[2, near]).max() < 4 * found.stderr[2, near].max()
    some = tvident.fit_local_polynomials(holed, 101, nan_policy="omit", step=7)
    np.testing.assert_allclose(some.derivatives, found.derivatives[:, ::7], rtol=1e-9, equal_nan=True)
    two = tvident.fit_local_polynomials(np.stack([holed, y], axis=1), 101, nan_policy="omit", axis=0)
    np.testing.assert_array_equal(two.derivatives[..., 0], found.derivatives)
    np.testing.assert_array_equal(two.derivatives[..., 1], clean.derivatives)


@pytest.mark.parametrize(("order", "least"), [(4, 0.92), (None, 0.8)])
def test_errors_hold_beside_gaps(order: int | None, least: float) -> None:
    over = []
    for seed in range(15):
        generator = np.random.default_rng(seed)
        t = np.arange(600)
        y = np.sin(t / 60) + 0.02 * generator.standard_normal(600)
        lost = generator.random(600) < 0.05
        found = tvident.fit_local_polynomials(
            np.where(lost, np.nan, y), 61, order=order, max_order=8, nan_policy="omit"
        )
        some = slice(60, -60, 30)
        truth = np.stack([np.sin(t / 60), np.cos(t / 60) / 60, -np.sin(t / 60) / 3600])
        over.append(((found.derivatives - truth) / found.stderr)[:, some])
        assert (found.status & Status.INVALID == 0).all()
        assert (
            np.isnan(found.stderr) == ((np.arange(3)[:, None] > found.order) & (found.status & Status.GAP != 0))
        ).all()
    # Of 15 · 16 windows and three derivatives: 0.95 ± 0.01.
    scores = np.abs(np.concatenate(over, axis=1))
    assert least < np.mean(scores[np.isfinite(scores)] < 1.96) < 0.98


def test_weights_say_how_much_samples_count() -> None:
    generator = np.random.default_rng(1)
    noise = np.where(generator.random(1500) < 0.3, 30.0, 1.0)
    t = np.arange(1500)
    y = 100 * np.sin(t / 50) + noise * generator.standard_normal(1500)
    weights = 1 / noise**2
    plain = tvident.fit_local_polynomials(y, 101, order=4)
    found = tvident.fit_local_polynomials(y, 101, order=4, weights=weights)
    error = [np.sqrt(np.mean((fit.derivatives[0] - 100 * np.sin(t / 50))[60:-60] ** 2)) for fit in (plain, found)]
    assert error[1] < error[0] / 5
    assert abs(np.sqrt(np.mean(found.sigma**2)) - 1) < 0.1
    ones = tvident.fit_local_polynomials(y, 101, order=4, weights=np.ones(1500))
    np.testing.assert_allclose(ones.derivatives[:, 60:-60], plain.derivatives[:, 60:-60], rtol=1e-7, atol=1e-9)
    left_out = np.where(np.arange(1500) == 700, 0.0, 1.0)
    spoiled = np.where(left_out > 0, y, np.nan)
    omitted = tvident.fit_local_polynomials(spoiled, 101, order=4, nan_policy="omit")
    weighted = tvident.fit_local_polynomials(spoiled, 101, order=4, weights=left_out)
    np.testing.assert_allclose(weighted.derivatives[:, 680:720], omitted.derivatives[:, 680:720], rtol=1e-9)


@pytest.mark.slow
@settings(max_examples=examples(5))
@given(seed=st.integers(0, 10_000), missing=st.sampled_from([(0.01, 1), (0.05, 1), (0.3, 1), (0.05, 8)]))
def test_windows_are_chosen_as_if_nothing_were_missing(seed: int, missing: tuple[float, int]) -> None:
    lost, burst = missing
    generator = np.random.default_rng(seed)
    t = np.arange(2000) / 200
    rates, phases = 2 * np.pi * generator.uniform(0.5, 6, (3, 1)), generator.uniform(0, 6, (3, 1))
    truth = np.array([np.sum(rates**k * np.sin(rates * t + phases + k * np.pi / 2), axis=0) for k in range(3)])
    y = truth[0] + 0.02 * generator.standard_normal(t.size)
    holed = y.copy()
    for first in generator.integers(0, t.size - burst, int(lost * t.size / burst)):
        holed[first : first + burst] = np.nan
    # A gap that is longer than any window.
    holed[900:1300] = np.nan
    whole = tvident.fit_local_polynomials(y, "auto", sample_rate=200)
    found = tvident.fit_local_polynomials(np.stack([y, holed]), "auto", sample_rate=200, nan_policy="omit")
    for name in ("derivatives", "stderr"):
        assert np.array_equal(getattr(found, name)[:, 0], getattr(whole, name))
    inside = np.zeros(t.size, bool)
    inside[100:800] = inside[1400:1900] = True
    assert np.isfinite(found.derivatives[:, 1, inside]).all()
    assert np.isnan(found.derivatives[:, 1, 1100]).all()
    assert found.status[1, 1100] & Status.INVALID
    for k in range(3):
        errors = [
            np.sqrt(np.mean((one[k] - truth[k])[inside] ** 2)) for one in (found.derivatives[:, 1], whole.derivatives)
        ]
        assert errors[0] < PROMISED * errors[1]
        away = np.abs(found.derivatives[k, 1] - truth[k])[inside] / found.stderr[k, 1][inside]
        assert np.mean(away < 1.96) > COVERED


@pytest.mark.parametrize("selection", ["pooled", "average"])
def test_windows_that_lack_samples_have_orders_of_their_own_beside_others(selection: Any) -> None:
    generator = np.random.default_rng(5)
    y = np.sin(np.arange(400) / 15) + 0.05 * generator.standard_normal(400)
    y[[150, 151, 240]] = np.nan
    found = tvident.fit_local_polynomials(y, 41, nan_policy="omit", selection=selection)
    others = tvident.fit_local_polynomials(y, 41, selection=selection)
    lack = np.isnan(others.derivatives[0])
    assert lack.sum() == 42 + 41
    assert np.array_equal(found.derivatives[:, ~lack], others.derivatives[:, ~lack])
    own = tvident.fit_local_polynomials(y, 41, nan_policy="omit")
    for name in ("derivatives", "order", "sigma", "stderr"):
        assert np.array_equal(getattr(found, name)[..., lack], getattr(own, name)[..., lack]), name


@pytest.mark.parametrize("loss", ["squares", "huber"])
@pytest.mark.parametrize("held", [np.nan, np.inf, 1e300])
@pytest.mark.filterwarnings("error")
def test_what_has_no_weight_may_hold_anything(loss: Any, held: float) -> None:
    y, weights = np.sin(np.arange(120) / 9), np.ones(120)
    y[50], weights[50] = held, 0
    call: dict[str, Any] = {"order": 2, "weights": weights, "loss": loss}
    found = tvident.fit_local_polynomials(y, 21, nan_policy="raise", **call)
    assert np.isfinite(found.derivatives).all()
    y[50] = 0
    np.testing.assert_array_equal(found.derivatives, tvident.fit_local_polynomials(y, 21, **call).derivatives)
    y[60] = np.nan
    with pytest.raises(ValueError, match="sample 60 is nan"):
        tvident.fit_local_polynomials(y, 21, nan_policy="raise", **call)


@pytest.mark.slow
@pytest.mark.parametrize("weighted", [False, True])
def test_hubers_loss_leaves_out_what_is_missing(weighted: bool) -> None:
    generator = np.random.default_rng(6)
    weights = 10 ** generator.uniform(-1, 1, 120) if weighted else np.ones(120)
    weights[50] = 0 if weighted else 1
    y = np.sin(np.arange(120) / 9) + 0.05 * generator.standard_normal(120) / np.sqrt(np.where(weights > 0, weights, 1))
    y[generator.integers(0, 120, 6)] += 3
    y[[30, 31, 77]] = np.nan
    length, order, used = 21, 3, np.isfinite(y) & (weights > 0)
    roots = np.sqrt(np.where(weights > 0, weights, 1))

    def values(sides: Array, derivative: int = 0) -> Array:
        each = [fitted(sides, weights, place, length, order, order)[0][derivative] for place in range(120)]
        return np.array(each)

    def solve(sides: Array) -> Array:
        return np.asarray((roots * values(sides[:, 0] / roots))[:, None])

    # Residuals times the roots of weights have one scale.
    clipped = pseudo_values(solve, (roots * y)[:, None], used, length, 5)[:, 0] / roots
    assert np.nanmax(np.abs(clipped - y)) > 2
    found = tvident.fit_local_polynomials(
        np.stack([y, np.arange(120.0)]),
        length,
        order=order,
        nan_policy="omit",
        loss="huber",
        weights=weights if weighted else None,
    )
    for derivative in range(3):
        expected = values(clipped, derivative)
        np.testing.assert_allclose(found.derivatives[derivative, 0], expected, rtol=0, atol=ROUNDING)
    if weighted:
        return
    automatic = tvident.fit_local_polynomials(y, "auto", nan_policy="omit", loss="huber")
    # Some standard deviations of the noise, and a tenth of a spike.
    assert np.nanmax(np.abs(automatic.derivatives[0] - np.sin(np.arange(120) / 9))) < 0.3


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            {"window_length": "auto", "weights": np.ones(100)},
            "window_length must be a length where samples have weights .*; got 'auto'",
        ),
        (
            {"selection": "pooled", "weights": np.ones(100)},
            "selection must be 'window' where .* weights .*; got 'pooled'",
        ),
        (
            {"nan_policy": "propagate", "max_gap": 3},
            "max_gap must go with nan_policy='omit' or weights; got 3 with 'prop",
        ),
        ({"min_observations": 12}, "min_observations must be at most 11; got 12"),
        ({"weights": np.ones(99)}, "one value for every sample, shape \\(100,\\); got shape \\(99,\\)"),
        ({"nan_policy": "drop"}, "nan_policy must be 'omit', 'propagate' or 'raise'; got 'drop'"),
    ],
)
def test_what_cannot_be_meant_is_refused(call: dict[str, Any], message: str) -> None:
    good: dict[str, Any] = {"window_length": 11, "nan_policy": "omit"}
    with pytest.raises(ValueError, match=message):
        tvident.fit_local_polynomials(np.sin(np.arange(100.0)), **(good | call))


def test_errors_know_that_the_order_was_chosen() -> None:
    simulated = tvident.simulate_torsional_rig(seed=43)
    whole = tvident.fit_local_polynomials(simulated.angle, 51, sample_rate=1000)
    weights = np.ones(simulated.angle.size)
    weighted = tvident.fit_local_polynomials(simulated.angle, 51, sample_rate=1000, weights=weights)
    inner = slice(25, -25)
    known = np.isfinite(weighted.stderr[:, inner])
    np.testing.assert_allclose(weighted.stderr[:, inner][known], whole.stderr[:, inner][known], rtol=ROUNDING)
    holed = simulated.angle.copy()
    holed[np.random.default_rng(43).uniform(size=holed.size) < 0.01] = np.nan
    found = tvident.fit_local_polynomials(holed, 51, sample_rate=1000, nan_policy="omit")
    beside = found.status & Status.GAP != 0
    truth = [simulated.true_angle, simulated.true_velocity, simulated.true_acceleration]
    inside = np.abs(found.derivatives - truth) < 1.96 * found.stderr
    # Some 8000 windows of 51 samples, of which 390 are apart: 0.95 ± 0.011; with one order's errors they were 0.90, 0.87 and 0.69.
    for covered, error in zip(inside[:, beside], found.stderr[:, beside], strict=True):
        assert np.mean(covered[np.isfinite(error)]) > 0.9


@pytest.mark.parametrize("highest", [3, 5, 8])
def test_full_windows_have_the_order_that_they_name_whatever_its_flags_are(highest: int) -> None:
    generator = np.random.default_rng(3)
    y = np.sin(np.arange(800) / 9) + 0.05 * generator.standard_normal(800)
    alone = tvident.fit_local_polynomials(y, 41, max_order=highest)
    weighted = tvident.fit_local_polynomials(y, 41, max_order=highest, weights=np.ones(800))
    inner = slice(20, -20)
    assert np.any(alone.status[inner] & Status.HIGHEST_ORDER)
    np.testing.assert_array_equal(weighted.order[inner], alone.order[inner])
    np.testing.assert_allclose(weighted.derivatives[:, inner], alone.derivatives[:, inner], rtol=0, atol=1e-12)


def test_beside_gaps_of_chosen_windows_a_step_leaves_out_what_is_not_wanted() -> None:
    generator = np.random.default_rng(5)
    y = np.sin(np.arange(3000) / 40) + 1e-3 * generator.standard_normal(3000)
    y[generator.uniform(size=y.size) < 0.01] = np.nan
    whole = tvident.fit_local_polynomials(y, "auto", delta=0.001, nan_policy="omit")
    some = tvident.fit_local_polynomials(y, "auto", delta=0.001, nan_policy="omit", step=7)
    assert np.isfinite(some.derivatives).all()
    np.testing.assert_array_equal(some.derivatives, whole.derivatives[:, ::7])
    np.testing.assert_array_equal(some.stderr, whole.stderr[:, ::7])
    np.testing.assert_array_equal(some.order, whole.order[::7])
    np.testing.assert_array_equal(some.status, whole.status[::7])
