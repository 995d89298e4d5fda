"""Windows at the samples' own times, against every order's own least squares."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from parameters import examples
from reference.own_times import fit, parts_of, window_of
from tvident import Status, _core
from tvident._huber import pseudo_values

Array = npt.NDArray[np.float64]

SAME = 1e-8
"""Of the largest derivative by any order: the condition of Legendre polynomials at jittering times stays below 1e4 at order 8."""

TIE = 1e-6
"""Scores closer than this may fall either way."""


def record(seed: int, samples: int) -> tuple[Array, Array]:
    generator = np.random.default_rng(seed)
    times = 3.0 + np.cumsum(generator.uniform(0.3, 1.7, samples)) / 200
    waves = sum(np.sin(2 * np.pi * f * times + generator.uniform(0, 6)) for f in generator.uniform(1, 8, 3))
    return times, np.asarray(waves + 0.02 * generator.standard_normal(samples))


@settings(max_examples=examples(15))
@given(
    seed=st.integers(0, 10_000),
    samples=st.integers(60, 150),
    length=st.one_of(st.integers(4, 20).map(lambda half: 2 * half + 1), st.floats(0.08, 0.25)),
)
def test_every_window_has_its_own_design(seed: int, samples: int, length: float) -> None:
    times, y = record(seed, samples)
    given_length = length if isinstance(length, int) else f"{length!r} s"
    if not isinstance(length, int):
        length = float(f"{length!r}")
    found = tvident.fit_local_polynomials(y, given_length, t=times, max_order=8, workers=1)
    for sample in range(0, samples, 7):
        window = window_of(times, sample, length)
        if window.size < 5:
            assert found.status[sample] == Status.INVALID
            assert np.isnan(found.derivatives[:, sample]).all()
            continue
        values, gains, residuals, scores = fit(times[window], y[window], times[sample], 2, 8)
        np.testing.assert_allclose(found.scores(sample)[: scores.size], scores, rtol=1e-6, atol=1e-6)
        best = int(scores.argmin())
        if np.sort(scores)[1] - scores[best] < TIE:
            continue
        assert found.order[sample] == best
        sigma = np.sqrt(residuals / (window.size - np.arange(residuals.size) - 1))
        assert found.sigma[sample] == pytest.approx(sigma[best], rel=1e-6)
        if found.status[sample] & Status.EDGE:
            continue
        scale = np.abs(values).max(axis=0)
        np.testing.assert_allclose(found.derivatives[:, sample], values[best], rtol=0, atol=SAME * scale.max())
        shares = np.exp(-(scores - scores[best]) / 2)
        shares /= shares.sum()
        error = shares @ np.sqrt((sigma**2)[:, np.newaxis] * gains + (values - values[best]) ** 2)
        np.testing.assert_allclose(found.stderr[:, sample], error, rtol=1e-4)


# All that such a call depends on.
@settings(max_examples=examples(25))
@given(
    seed=st.integers(0, 10_000),
    length=st.one_of(st.integers(3, 15).map(lambda half: 2 * half + 1), st.floats(0.08, 0.25)),
    order=st.one_of(st.none(), st.integers(0, 4)),
    max_gap=st.one_of(st.none(), st.integers(3, 12), st.just("0.03 s")),
    span=st.sampled_from([0.0, 1.0, 4.0]),
    lost=st.sampled_from([0.0, 0.1]),
    unit=st.sampled_from([1.0, 1e-40, 3e250]),
    omit=st.booleans(),
)
def test_every_window_is_the_weighted_least_squares_of_what_it_holds(
    seed: int,
    length: float,
    order: int | None,
    max_gap: int | str | None,
    span: float,
    lost: float,
    unit: float,
    *,
    omit: bool,
) -> None:
    times, y = record(seed, 140)
    generator = np.random.default_rng(seed + 1)
    weights = 10 ** generator.uniform(-span / 2, span / 2, y.size)
    weights[generator.random(y.size) < lost] = 0
    weights[generator.integers(y.size - 20) :][:15] = 0
    y = np.where((weights == 0) & (generator.random(y.size) < 0.5), np.nan, y)
    if omit:
        y[generator.random(y.size) < lost] = np.nan
    given_length = length if isinstance(length, int) else f"{length!r} s"
    how: dict[str, Any] = {"order": order, "max_order": 6, "max_gap": max_gap, "quantisation": 0}
    how |= {"nan_policy": "omit" if omit else "propagate", "workers": 1}
    found = tvident.fit_local_polynomials(y, given_length, t=times, weights=weights * unit, **how)
    usual = np.median(np.diff(times))
    gap = (
        np.inf if max_gap is None else max_gap + 1.5 if isinstance(max_gap, int) else max(1, round(0.03 / usual)) + 1.5
    )
    there = (weights > 0) & np.isfinite(y)
    assert (found.status[~there] == Status.INVALID | Status.GAP).all()
    assert np.isnan(found.derivatives[:, ~there]).all()
    for part in parts_of(times, there, gap * usual):
        is_short = part.size < length if isinstance(length, int) else times[part[-1]] - times[part[0]] < length
        least = max((length + 1) // 2 if isinstance(length, int) else 5, 0 if order is None else order + 1)
        for place in range(0, part.size, 5):
            sample = part[place]
            window = part[window_of(times[part], place, length)]
            assert bool(found.status[sample] & Status.GAP) == is_short
            if window.size < least:
                assert found.status[sample] & Status.INVALID
                continue
            assert not found.status[sample] & Status.INVALID
            values, gains, residuals, scores = fit(times[window], y[window], times[sample], 2, 6, weights[window])
            best = order
            if best is None:
                best = int(scores.argmin())
                if np.sort(scores)[1:2] - scores[best] < TIE:
                    continue
            if best >= scores.size:
                continue
            assert found.order[sample] == best
            sigma = np.sqrt(residuals / (window.size - np.arange(residuals.size) - 1))
            assert found.sigma[sample] == pytest.approx(sigma[best] * np.sqrt(unit), rel=1e-6)
            if order is None and found.status[sample] & Status.EDGE:
                continue
            errors = sigma[best] * np.sqrt(gains[best])
            if order is None:
                shares = np.exp(-(scores - scores[best]) / 2)
                errors = shares / shares.sum() @ np.sqrt((sigma**2)[:, None] * gains + (values - values[best]) ** 2)
            np.testing.assert_allclose(found.stderr[:, sample], errors, rtol=1e-4)
            off = np.abs(found.derivatives[:, sample] - values[best])
            assert (off <= 1e-6 * errors + SAME * np.abs(values).max(axis=0)).all()


def test_weights_of_zero_and_one_are_samples_that_are_missing_and_there() -> None:
    times, y = record(4, 400)
    y = np.stack([y, y[::-1]], axis=1)
    weights = np.where(np.random.default_rng(0).random(y.shape) < 0.1, 0.0, 1.0)
    for length in (21, "0.12 s"):
        holed = tvident.fit_local_polynomials(
            np.where(weights > 0, y, np.nan), length, t=times, nan_policy="omit", axis=0
        )
        for factor in (1.0, 4.0):
            found = tvident.fit_local_polynomials(y, length, t=times, weights=factor * weights, axis=0)
            for name in ("derivatives", "stderr", "order", "status"):
                np.testing.assert_array_equal(getattr(found, name), getattr(holed, name))
            np.testing.assert_array_equal(found.sigma, holed.sigma * np.sqrt(factor))
            for sample in (0, 100, 101, 399):
                np.testing.assert_array_equal(found.scores(sample), holed.scores(sample))


def test_weights_halve_errors_where_half_the_samples_are_noisy_and_errors_hold() -> None:
    over, errors = [], []
    for seed in range(12):
        generator = np.random.default_rng(seed)
        times = np.cumsum(generator.uniform(0.2, 1.8, 800)) / 200
        noise = np.where(generator.random(800) < 0.5, 0.2, 0.02)
        y = np.sin(9 * times) + noise * generator.standard_normal(800)
        truth = np.stack([np.sin(9 * times), 9 * np.cos(9 * times), -81 * np.sin(9 * times)])
        inner = slice(60, -60, 15)
        for weights in (None, 1 / noise**2):
            found = tvident.fit_local_polynomials(y, 61, t=times, max_order=6, weights=weights)
            off = (found.derivatives - truth)[:, inner]
            errors.append(np.sqrt(np.mean(off**2, axis=1)))
        over.append(off / found.stderr[:, inner])
        assert np.median(found.sigma[inner]) == pytest.approx(1, rel=0.2)
    plain, weighted = np.mean(errors[::2], axis=0), np.mean(errors[1::2], axis=0)
    # Weighted least squares have 0.2 of the variance's root.
    assert (weighted < 0.5 * plain).all()
    assert 0.9 < np.mean(np.abs(over) < 1.96) < 0.98


def test_times_that_are_hardly_irregular_give_what_uniform_ones_do() -> None:
    count = np.arange(2000)
    y = np.sin(count / 40) + 1e-3 * np.random.default_rng(0).standard_normal(count.size)
    uniform = tvident.fit_local_polynomials(y, 101, sample_rate=500)
    times = (count + 2e-3 * np.sin(count)) / 500
    found = tvident.fit_local_polynomials(y, 101, t=times)
    same = found.order == uniform.order
    assert same.mean() > 0.98
    inside = same & (found.status & Status.EDGE == 0)
    # Shifts of two thousandths of a step, twice, move values by as much of what they change in a step.
    np.testing.assert_allclose(found.derivatives[0, inside], uniform.derivatives[0, inside], rtol=0, atol=2 * 2e-3 / 40)
    # Weights of orders that are nearly as good move by more.
    ratio = found.stderr[1, inside] / uniform.stderr[1, inside]
    assert np.mean(np.abs(ratio - 1) < 0.05) > 0.99
    edges = (found.status & Status.EDGE).astype(bool)
    assert np.array_equal(edges, (uniform.status & Status.EDGE).astype(bool))
    # There each derivative takes an order of its own, which may be another where two are nearly as good.
    off = np.abs(found.derivatives[1, same & edges] - uniform.derivatives[1, same & edges])
    assert np.median(off / uniform.stderr[1, same & edges]) < 0.05


def test_polynomials_are_exact_and_results_are_at_their_own_times() -> None:
    times = np.sort(np.random.default_rng(1).uniform(0, 1, 400))
    y = 1e3 + 2 * times - 3 * times**3
    found = tvident.fit_local_polynomials(y, "0.2 s", t=times, step=3, nan_policy="propagate")
    assert np.array_equal(found.time, times[::3])
    np.testing.assert_allclose(found.derivatives[1], (2 - 9 * times**2)[::3], rtol=0, atol=1e-6)
    holed = y.copy()
    holed[200] = np.nan
    beside = tvident.fit_local_polynomials(holed, 21, t=times)
    assert np.isnan(beside.derivatives[0, 190:211]).all()
    assert np.isfinite(beside.derivatives[0, :190]).all()


@settings(max_examples=examples(6))
@given(seed=st.integers(0, 10_000), scatter=st.floats(0.05, 0.9), gap=st.booleans())
def test_windows_are_chosen_at_irregular_times(seed: int, scatter: float, gap: bool) -> None:
    generator = np.random.default_rng(seed)
    steps = generator.uniform(1 - scatter, 1 + scatter, 1200) / 200
    steps[600] += 2.0 if gap else 0.0
    times = 3.0 + np.cumsum(steps)
    rates = 2 * np.pi * generator.uniform(1, 8, (3, 1))
    phases = generator.uniform(0, 6, (3, 1))
    truth = np.array([np.sum(rates**k * np.sin(rates * times + phases + k * np.pi / 2), axis=0) for k in range(3)])
    y = truth[0] + 0.02 * generator.standard_normal(times.size)
    found = tvident.fit_local_polynomials(y, "auto", t=times)
    inside = np.ones(times.size, bool)
    for end in (0, times.size, *([600] if gap else [])):
        inside[max(0, end - 100) : end + 100] = False
    for derivative in range(3):
        # What a user gets who tries windows and knows the truth: the choice may cost half as much again.
        tried = [
            tvident.fit_local_polynomials(y, length, t=times).derivatives[derivative]
            for length in (15, 25, 41, 65, 101)
        ]
        least = min(np.sqrt(np.mean((one - truth[derivative])[inside] ** 2)) for one in tried)
        assert np.sqrt(np.mean((found.derivatives[derivative] - truth[derivative])[inside] ** 2)) < 1.5 * least
        away = np.abs(found.derivatives[derivative] - truth[derivative])[inside] / found.stderr[derivative][inside]
        assert np.mean(away < 1.96) > 0.8
    assert found.window_length.shape == (3,)  # type: ignore[union-attr]
    assert found.order.shape == found.status.shape == times.shape
    every = tvident.fit_local_polynomials(np.stack([y, y]), "auto", t=times, step=7)
    assert np.array_equal(every.derivatives[:, 1], found.derivatives[:, ::7])
    assert np.array_equal(every.stderr[:, 0], found.stderr[:, ::7])


@pytest.mark.parametrize("order", [None, 4])
def test_standard_errors_are_estimated_when_they_are_asked_for(order: int | None) -> None:
    times, y = record(6, 3000)
    how: dict[str, Any] = {"order": order, "max_order": 10, "criterion": "aicc"}
    plan = _core.WindowFit(times - times[0], 51, derivatives=2, quantisation=0.0, **how)
    without, with_errors = plan.estimate(y), plan.estimate(y, errors=True, workers=1)
    assert without.stderr is None
    assert with_errors.stderr is not None
    for name in ("order", "status"):
        assert np.array_equal(getattr(without.estimates, name), getattr(with_errors.estimates, name))
    off = np.abs(without.estimates.derivatives - with_errors.estimates.derivatives)
    assert (off <= 1e-7 * with_errors.stderr).all()
    found = tvident.fit_local_polynomials(y, 51, t=times, quantisation=0, **how)
    assert np.array_equal(found.derivatives, without.estimates.derivatives)
    assert np.array_equal(found.stderr, with_errors.stderr)


@pytest.mark.parametrize("window_length", [21, "0.12 s", "auto"])
def test_what_is_missing_is_as_if_it_had_not_been_recorded(window_length: int | str) -> None:
    times, y = record(4, 400)
    y[[20, 21, 22, 250, 399]] = np.nan
    there = np.isfinite(y)
    found = tvident.fit_local_polynomials(np.stack([y, 0 * y]), window_length, t=times, nan_policy="omit", step=3)
    without = tvident.fit_local_polynomials(y[there], window_length, t=times[there])
    inside = there[::3]
    places = (np.cumsum(there) - 1)[::3][inside]
    for name in ("derivatives", "stderr"):
        assert np.array_equal(getattr(found, name)[:, 0, inside], getattr(without, name)[:, places], equal_nan=True)
        assert np.isnan(getattr(found, name)[:, 0, ~inside]).all()
    for name in ("order", "status"):
        assert np.array_equal(getattr(found, name)[0, inside], getattr(without, name)[places])
    assert (found.status[0, ~inside] == Status.INVALID | Status.GAP).all()
    assert np.array_equal(found.scores(100)[:, 0], without.scores(97))
    assert np.isnan(found.scores(250)[:, 0]).any()
    # Where too few samples are there for a window nothing is known, and nothing is raised.
    y[10:] = np.nan
    nothing = tvident.fit_local_polynomials(y, window_length, t=times, nan_policy="omit")
    assert np.isnan(nothing.derivatives).all()


def test_hubers_loss_is_that_of_windows_at_true_times() -> None:
    times, y = record(3, 60)
    y[[17, 40, 41]] += 4
    order, length = 2, 15

    def values(sides: Array, derivative: int = 0) -> Array:
        windows = [window_of(times, sample, length) for sample in range(times.size)]
        fits = [fit(times[one], sides[one], times[at], 2, order)[0] for at, one in enumerate(windows)]
        return np.array([each[order, derivative] for each in fits])

    used = np.ones(times.size, bool)
    clipped = pseudo_values(lambda sides: values(sides[:, 0])[:, None], y[:, None], used, length, 5)[:, 0]
    assert np.abs(clipped - y).max() > 3
    found = tvident.fit_local_polynomials(y, length, t=times, order=order, loss="huber")
    for derivative in range(3):
        expected = values(clipped, derivative)
        np.testing.assert_allclose(found.derivatives[derivative], expected, rtol=0, atol=SAME * np.abs(expected).max())


def test_hubers_loss_goes_with_weights_at_true_times() -> None:
    times, y = record(3, 400)
    weights = np.where(np.arange(400) < 200, 1.0, 1e-4)
    y += 1e-2 * np.random.default_rng(0).standard_normal(400) / np.sqrt(weights)
    spiky = y.copy()
    spiky[50:400:70] += 9
    call: dict[str, Any] = {"t": times, "order": 2, "weights": weights}
    without, spoilt = (tvident.fit_local_polynomials(one, 31, **call).derivatives[0] for one in (y, spiky))
    clipped = tvident.fit_local_polynomials(spiky, 31, loss="huber", **call).derivatives[0]
    quiet = slice(40, 180)
    # Noise of .01 where weights are one: spikes of 900 deviations move what is estimated by far less than one.
    assert np.abs(clipped - without)[quiet].max() < 0.02
    assert np.abs(spoilt - without)[quiet].max() > 0.2
    # A residual of nine deviations or more is a spike; of one where the noise is a hundred times larger, it is none.
    assert np.abs(clipped - without)[240:].max() < 1


def test_times_too_irregular_for_a_choice_say_so() -> None:
    times = np.sort(np.random.default_rng(0).uniform(0, 5, 1000))
    with pytest.raises(ValueError, match=r"scatter by no more than 1\.5 of a step; .* give a duration"):
        tvident.fit_local_polynomials(np.sin(times), "auto", t=times)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"window_length": "auto", "selection": "pooled"}, "selection chooses the order in a window that is given"),
        ({"window_length": 21, "selection": "pooled"}, "selection must be 'window' where t is not uniform"),
        (
            {"window_length": "auto", "loss": "huber"},
            "loss must be 'squares' where t is not uniform and windows are chosen",
        ),
        ({"window_length": 21, "max_gap": 3}, "max_gap must go with nan_policy='omit' or weights; got 3"),
        ({"window_length": "auto", "nan_policy": "omit", "max_gap": 3}, "max_gap must be left out where t is not unif"),
        ({"window_length": "auto", "weights": np.ones(100)}, "window_length must be a length where samples have weigh"),
        ({"window_length": 21, "weights": np.ones(99)}, r"one value for every sample, shape \(100,\); got shape"),
        ({"window_length": 21, "nan_policy": "omit", "min_observations": 22}, "min_observations must be at most 21"),
        ({"window_length": "9 s"}, "less than or equal to the length of the record; got 9 s for a record of"),
        ({"window_length": 20}, "window_length must be odd"),
        ({"window_length": 5, "order": 7}, "order must be less than window_length"),
    ],
)
def test_what_needs_uniform_times_says_so(call: dict[str, object], message: str) -> None:
    times, y = record(2, 100)
    with pytest.raises(ValueError, match=message):
        tvident.fit_local_polynomials(y, t=times, **call)  # type: ignore[arg-type]


@pytest.mark.parametrize("steps", ["scattered", "of four digits", "with a gap", "hardly scattered"])
def test_times_that_show_at_once_that_they_are_irregular_are_those_that_are_looked_at_closely(steps: str) -> None:
    generator, samples = np.random.default_rng(41), 3000
    times = 3.0 + np.arange(samples) / 200
    if steps == "with a gap":
        times[1000:] += 0.4
    else:
        times += generator.uniform(-1, 1, samples) * (1e-5 if steps == "hardly scattered" else 1e-3)
    times = np.round(times, 4) if steps == "of four digits" else times
    y = np.sin(20 * times) + 0.02 * generator.standard_normal(samples)
    plain, looked_at = (tvident.fit_local_polynomials(y, 51, t=one, workers=1) for one in (times, list(times)))
    np.testing.assert_array_equal(plain.derivatives, looked_at.derivatives)
    np.testing.assert_array_equal(plain.status, looked_at.status)
    np.testing.assert_array_equal(plain.sigma, looked_at.sigma)
    assert plain.order.max() > 2
