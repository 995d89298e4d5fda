from __future__ import annotations

import pickle
import threading
import time
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from reference.local_polynomials import akaike_weights, errors_around, fit_window, fit_windows
from signals import signal
from tvident import Status, _core

Array = npt.NDArray[np.float64]
Selection = Literal["window", "pooled", "average"]

# The library promises derivatives to 1e-9 of scale; the reference itself is good to 1e-12.
SCALE = 1e-9
# Scores are sums of M logarithms of numbers good to about 1e-10: closer than this, rounding decides.
TIE = 1e-6


def assert_agrees(
    fit: tvident.LocalPolynomialFit, y: Array, half: int, delta: float, highest: int, criterion: str
) -> None:
    """Compare every full window with the reference."""
    full = slice(half, y.size - half)
    found, order = fit.derivatives[:, full].T, fit.order[full].astype(int)
    scale = np.abs(found).max(axis=0)
    windows = fit_windows(y, half, delta, highest, fit.derivatives.shape[0] - 1)
    each = np.arange(order.size)
    scores = windows.scores(criterion)
    np.testing.assert_array_less(scores[each, order] - scores.min(axis=1), TIE)
    expected = windows.derivatives[each, :, order]
    np.testing.assert_array_less(np.abs(found - expected), np.broadcast_to(SCALE * scale + 1e-300, found.shape))
    sigma = np.sqrt(windows.rss[each, order] / (2 * half - order))
    np.testing.assert_allclose(fit.sigma[full], sigma, rtol=1e-6, atol=1e-12)
    # The residual of a window is good to 1e-6 of itself: so the criterion, and the weights, are to M of those.
    errors = errors_around(windows, akaike_weights(scores), expected)
    tolerance = 1e-6 * (2 * half + 1) * np.ptp(windows.derivatives, axis=2)
    assert (np.abs(fit.stderr[:, full].T - errors) <= 1e-3 * errors + SCALE * scale + tolerance).all()


@given(
    seed=st.integers(0, 2**32),
    half=st.integers(2, 1000),
    more=st.integers(0, 40),
    max_order=st.integers(0, 15),
    noise=st.sampled_from([1e-6, 1e-3, 0.1, 1.0]),
    criterion=st.sampled_from(["aicc", "aicc-textbook", "aic", "bic"]),
    delta=st.sampled_from([1.0, 1e-3]),
)
def test_every_window_is_the_papers(
    seed: int,
    half: int,
    more: int,
    max_order: int,
    noise: float,
    criterion: Literal["aicc", "aicc-textbook", "aic", "bic"],
    delta: float,
) -> None:
    y = signal(seed, 2 * half + 1 + more, noise)
    fit = tvident.fit_local_polynomials(y, 2 * half + 1, delta=delta, max_order=max_order, criterion=criterion)
    assert_agrees(fit, y, half, delta, max_order, criterion)


@given(seed=st.integers(0, 2**32), half=st.integers(2, 60), order=st.integers(0, 15), deriv=st.integers(0, 5))
def test_a_fixed_order_is_the_least_squares_polynomial_everywhere(seed: int, half: int, order: int, deriv: int) -> None:
    order = min(order, 2 * half)
    y = signal(seed, 3 * half + 1, 0.1)
    fit = tvident.fit_local_polynomials(y, 2 * half + 1, order=order, max_deriv=deriv)
    windows = [fit_window(y[i : i + 2 * half + 1], 1.0, order, deriv).derivatives[:, order] for i in range(half + 1)]
    for i in range(y.size):
        # At the ends the first and the last full window, off their centres.
        first = min(max(i - half, 0), half)
        window = windows[first]
        scale = np.abs(window).max(axis=1)
        assert (np.abs(fit.derivatives[:, i] - window[:, i - first]) <= SCALE * scale + 1e-12).all()
    assert (fit.order == order).all()
    assert (fit.status & Status.EDGE != 0).sum() == 2 * half


@given(
    seed=st.integers(0, 2**32),
    shape=st.lists(st.integers(1, 3), max_size=2),
    axis=st.integers(0, 2),
    dtype=st.sampled_from(["f8", "f4", ">f8", "i2", "u1", "f2", "?"]),
    reverse=st.booleans(),
    skip=st.integers(1, 3),
)
def test_any_array_that_numpy_can_view(
    seed: int, shape: list[int], axis: int, dtype: str, reverse: bool, skip: int
) -> None:
    axis = min(axis, len(shape))
    generator = np.random.default_rng(seed)
    full = [*shape[:axis], 120 * skip, *shape[axis:]]
    y = (generator.standard_normal(full) * 30 + 100).astype(dtype)
    view: npt.NDArray[Any] = y[(slice(None),) * axis + (slice(None, None, -skip if reverse else skip),)]
    view.flags.writeable = False
    fit = tvident.fit_local_polynomials(view, 21, axis=axis)
    assert fit.derivatives.shape == (3, *view.shape)
    assert fit.order.shape == fit.status.shape == fit.sigma.shape == view.shape
    assert fit.stderr.shape == (3, *view.shape)
    moved = np.moveaxis(view, axis, -1).astype(np.float64)
    for index in np.ndindex(moved.shape[:-1]):
        alone = tvident.fit_local_polynomials(moved[index], 21)
        np.testing.assert_array_equal(
            np.moveaxis(fit.derivatives, axis + 1, -1)[(slice(None), *index)], alone.derivatives
        )
        np.testing.assert_array_equal(np.moveaxis(fit.stderr, axis + 1, -1)[(slice(None), *index)], alone.stderr)
        np.testing.assert_array_equal(np.moveaxis(fit.order, axis, -1)[index], alone.order)
        column = fit.scores(60)[(slice(None), *index)]
        np.testing.assert_array_equal(column, alone.scores(60))


@given(
    seed=st.integers(0, 2**32),
    half=st.integers(3, 60),
    factor=st.sampled_from([-3.0, 1e-6, 1e6]),
    shift=st.floats(-1e3, 1e3),
)
def test_scale_shift_and_reversal_are_equivariant(seed: int, half: int, factor: float, shift: float) -> None:
    y = signal(seed, 4 * half, 0.05)
    fit = tvident.fit_local_polynomials(y, 2 * half + 1)
    # A shift rounds the samples anew, which θ̈ of the highest orders amplifies some 1e3 times.
    rounding = 1e3 * np.finfo(np.float64).eps * abs(shift)

    def assert_same(transformed: Array, derivatives: Array, order: npt.NDArray[np.uint8]) -> None:
        other = tvident.fit_local_polynomials(transformed, 2 * half + 1)
        same = other.order == order
        assert same.mean() > 0.98  # a tie may fall either way after rounding; there are hardly any
        scale = np.abs(derivatives).max(axis=1, keepdims=True)
        assert (np.abs(other.derivatives - derivatives)[:, same] <= SCALE * scale + rounding).all()

    assert_same(factor * y, factor * fit.derivatives, fit.order)
    assert_same(y + shift, fit.derivatives + np.array([[shift], [0], [0]]), fit.order)
    assert_same(y[::-1], (fit.derivatives * np.array([[1], [-1], [1]]))[:, ::-1], fit.order[::-1])


@given(seed=st.integers(0, 2**32), half=st.integers(8, 40))
def test_neighbouring_orders_agree_at_the_centre_and_residuals_fall(seed: int, half: int) -> None:
    y = signal(seed, 2 * half + 20, 0.1)
    interior = slice(half, y.size - half)
    fits = [tvident.fit_local_polynomials(y, 2 * half + 1, order=order).derivatives[:, interior] for order in range(10)]
    for m in range(1, 4):
        for derivative, order in ((2, 2 * m), (1, 2 * m - 1)):
            one, other = fits[order][derivative], fits[order + 1][derivative]
            np.testing.assert_allclose(one, other, rtol=0, atol=SCALE * np.abs(other).max())
    rss = [fit_window(y[: 2 * half + 1], 1.0, 9, 0).rss[n] for n in range(10)]
    assert (np.diff(rss) <= 1e-12).all()
    scores = tvident.fit_local_polynomials(y, 2 * half + 1, criterion="aic").scores(0)
    m_log_rss = scores - 2 * np.arange(1, scores.size + 1)
    assert (np.diff(m_log_rss) <= 1e-9).all()


def test_scores_are_equation_8() -> None:
    y = signal(5, 400, 0.01)
    fit = tvident.fit_local_polynomials(y, 101)
    for i in (0, 50, 200, -1):
        centre = min(max(i % 400, 50), 349)
        expected = fit_window(y[centre - 50 : centre + 51], 1.0, 15, 0).scores()
        np.testing.assert_allclose(fit.scores(i), expected, rtol=1e-9)
        assert fit.order[i] == expected.argmin()


@pytest.mark.parametrize("step", [2, 4, 7, 1000])
def test_a_step_gives_every_so_manieth_estimate(step: int) -> None:
    y = signal(3, 777, 0.01)
    full = tvident.fit_local_polynomials(y, 51)
    fit = tvident.fit_local_polynomials(y, 51, step=step)
    np.testing.assert_array_equal(fit.derivatives, full.derivatives[:, ::step])
    np.testing.assert_array_equal(fit.order, full.order[::step])
    np.testing.assert_array_equal(fit.status, full.status[::step])
    np.testing.assert_array_equal(fit.sigma, full.sigma[::step])
    np.testing.assert_array_equal(fit.stderr, full.stderr[:, ::step])


@pytest.mark.parametrize("selection", ["window", "pooled", "average"])
@pytest.mark.parametrize("step", [8, 20, 50, 52, 300])
def test_windows_that_are_projected_one_by_one_agree_to_rounding(step: int, selection: Selection) -> None:
    y = signal(3, 5000, 0.01)
    y[[700, 2500, 4990]] = np.nan
    full = tvident.fit_local_polynomials(y, 51, selection=selection)
    fit = tvident.fit_local_polynomials(y, 51, selection=selection, step=step)
    np.testing.assert_array_equal(fit.order, full.order[::step])
    np.testing.assert_array_equal(fit.status, full.status[::step])
    scale = np.nanmax(np.abs(full.derivatives), axis=1, keepdims=True)
    for found, expected in ((fit.derivatives, full.derivatives), (fit.stderr, full.stderr)):
        np.testing.assert_allclose(found / scale, expected[:, ::step] / scale, rtol=1e-6, atol=SCALE)
    np.testing.assert_allclose(fit.sigma, full.sigma[::step], rtol=1e-6)


@pytest.mark.parametrize("step", [100, 333])
@pytest.mark.parametrize("order", [None, 5])
def test_windows_that_are_projected_one_by_one_are_the_same_by_any_workers(step: int, order: int | None) -> None:
    y = signal(4, 90_000, 0.01)
    one = tvident.fit_local_polynomials(y, 201, order=order, step=step, workers=1)
    many = tvident.fit_local_polynomials(y, 201, order=order, step=step, workers=3)
    np.testing.assert_array_equal(one.derivatives, many.derivatives)
    np.testing.assert_array_equal(one.sigma, many.sigma)
    half = tvident.fit_local_polynomials(y[45_000 // step * step :], 201, order=order, step=step)
    inside = slice(100 // step + 1, -(100 // step + 1))
    np.testing.assert_array_equal(half.derivatives[:, inside], one.derivatives[:, 45_000 // step :][:, inside])


@given(seed=st.integers(0, 2**32), workers=st.integers(2, 9))
def test_the_numbers_do_not_depend_on_the_number_of_workers(seed: int, workers: int) -> None:
    y = signal(seed, 40_000, 0.01)
    one = tvident.fit_local_polynomials(y, 51, workers=1)
    many = tvident.fit_local_polynomials(y, 51, workers=workers)
    np.testing.assert_array_equal(one.derivatives, many.derivatives)
    np.testing.assert_array_equal(one.sigma, many.sigma)


@given(seed=st.integers(0, 2**32), places=st.lists(st.integers(0, 299), min_size=1, max_size=4))
def test_what_is_no_number_stays_in_its_own_windows(seed: int, places: list[int]) -> None:
    clean = signal(seed, 300, 0.01)
    y = clean.copy()
    y[places] = np.nan
    fit, expected = tvident.fit_local_polynomials(y, 21), tvident.fit_local_polynomials(clean, 21)
    centre = np.clip(np.arange(300), 10, 289)
    hit = np.array([np.isnan(y[c - 10 : c + 11]).any() for c in centre])
    np.testing.assert_array_equal(fit.status & Status.INVALID != 0, hit)
    np.testing.assert_array_equal(np.isnan(fit.derivatives), np.broadcast_to(hit, (3, 300)))
    np.testing.assert_array_equal(np.isnan(fit.stderr), np.broadcast_to(hit, (3, 300)))
    np.testing.assert_allclose(fit.derivatives[:, ~hit], expected.derivatives[:, ~hit], rtol=0, atol=1e-9)


def test_an_offset_a_thousand_million_times_the_signal_costs_nothing() -> None:
    # θ = 1e6 + 1e-3 sin(2π 5 t): samples are rounded at 1.2e-10, which order 7 passes on to θ̈ as 1e-7 of its amplitude.
    t = np.arange(20_000) / 1000
    omega = 2 * np.pi * 5
    wave = 1e-3 * np.sin(omega * t)
    fit = tvident.fit_local_polynomials(1e6 + wave, 201, sample_rate=1000, order=7)
    reference = tvident.fit_local_polynomials(wave, 201, sample_rate=1000, order=7)
    error = np.abs(fit.derivatives[2] - reference.derivatives[2])[100:-100]
    assert error.max() < 1e-6 * 1e-3 * omega**2


@pytest.mark.parametrize("window", [17, 51, 201, 2001, 100_001])
def test_order_15_is_exact_on_its_own_polynomials(window: int) -> None:
    n = window + 10
    x = np.linspace(-1, 1, n)
    y = np.polynomial.legendre.legval(x, np.ones(16))
    fit = tvident.fit_local_polynomials(y, window, order=15, delta=x[1] - x[0])
    expected = [np.polynomial.legendre.legval(x, np.polynomial.legendre.legder(np.ones(16), d)) for d in range(3)]
    centre = slice(window // 2, n - window // 2)
    for d in range(3):
        # θ̈ of order 15 amplifies the rounding of samples by (order²/window)² of scale.
        np.testing.assert_allclose(
            fit.derivatives[d, centre], expected[d][centre], atol=1e-8 * np.abs(expected[d]).max()
        )


def test_every_instruction_set_gives_the_same_numbers() -> None:
    y = signal(11, 5000, 0.01)
    fastest = tvident.fit_local_polynomials(y, 101)
    try:
        for name in _core.available_instructions():
            _core.force_instructions(name)
            fit = tvident.fit_local_polynomials(y, 101)
            same = fit.order == fastest.order
            assert same.mean() > 0.999
            np.testing.assert_allclose(fit.derivatives[:, same], fastest.derivatives[:, same], rtol=0, atol=1e-11)
    finally:
        _core.force_instructions(None)


@pytest.mark.slow
def test_other_python_threads_run_meanwhile() -> None:
    y = np.random.default_rng(0).standard_normal(4_000_000)
    ticks, stop = [], threading.Event()

    def tick() -> None:
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    started = time.perf_counter()
    tvident.fit_local_polynomials(y, 201, workers=1)
    ended = time.perf_counter()
    stop.set()
    thread.join()
    during = [moment for moment in ticks if started < moment < ended]
    # Were the lock held, there would be none but the first and the last.
    assert len(during) > 10


def test_progress_is_told_and_can_cancel() -> None:
    y = np.random.default_rng(0).standard_normal(2_000_000)
    seen: list[tuple[int, int]] = []
    tvident.fit_local_polynomials(y, 201, workers=2, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (y.size, y.size)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)

    def refuse(_done: int, _total: int) -> None:
        raise RuntimeError("enough")

    for workers in (1, 2):
        with pytest.raises(RuntimeError, match="enough"):
            tvident.fit_local_polynomials(y, 201, workers=workers, progress=refuse)


def misuse() -> Iterator[tuple[dict[str, Any], type[Exception], str]]:
    y = np.arange(100.0)
    good: dict[str, Any] = {"y": y, "window_length": 11}
    yield good | {"window_length": 10}, ValueError, "must be odd.*got 10; use 9 or 11"
    yield good | {"window_length": 3}, ValueError, "at least 5 samples; got 3"
    yield (
        good | {"window_length": 101},
        ValueError,
        "less than or equal to the length of the record; got 101 samples for a record of 100",
    )
    yield good | {"window_length": 11.5}, TypeError, "whole number; got 11.5"
    yield good | {"window_length": "0.2 parsec"}, ValueError, "duration such as '0.2 s'; got '0.2 parsec'"
    yield good | {"y": []}, ValueError, "must not be empty"
    yield good | {"y": 3.0}, ValueError, "must be an array of samples"
    yield good | {"y": y + 1j}, TypeError, "must be real; got complex"
    yield good | {"y": np.array(["a"] * 100)}, TypeError, "must hold numbers"
    yield good | {"delta": 0.0}, ValueError, "delta must be positive and finite; got 0"
    yield good | {"delta": np.inf}, ValueError, "delta must be positive and finite; got inf"
    yield good | {"sample_rate": -5}, ValueError, "sample_rate must be positive and finite; got -5"
    yield good | {"sample_rate": 5, "delta": 1.0}, TypeError, "only one of delta, sample_rate and t"
    yield good | {"t": y[:-1]}, ValueError, "one time for each of the 100 samples"
    yield good | {"t": np.zeros(100)}, ValueError, "must increase"
    yield good | {"max_order": 16}, ValueError, "max_order must be at most 15; got 16"
    yield good | {"order": 16, "window_length": 51}, ValueError, "order must be at most 15; got 16"
    yield good | {"order": 11}, ValueError, "order must be less than window_length; got order 11"
    yield good | {"order": -1}, ValueError, "order must be at least 0"
    yield good | {"criterion": "aik"}, ValueError, "criterion must be 'aicc'.*got 'aik'"
    yield good | {"max_deriv": -1}, ValueError, "max_deriv must be at least 0"
    yield good | {"axis": 1}, ValueError, "axis must name one of the 1 axes of y; got 1"
    yield good | {"step": 0}, ValueError, "step must be at least 1"
    yield good | {"workers": 0}, ValueError, "workers must be at least 1"
    yield good | {"nan_policy": "drop"}, ValueError, "nan_policy must be"
    yield good | {"progress": 3}, TypeError, "progress must be True, False or a function"
    yield (
        good | {"y": np.where(y == 7, np.nan, y), "nan_policy": "raise"},
        ValueError,
        "y must hold finite numbers.*sample 7 is nan",
    )


@pytest.mark.parametrize(("arguments", "error", "message"), list(misuse()))
def test_misuse_says_the_rule_the_value_and_the_cure(
    arguments: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        tvident.fit_local_polynomials(**arguments)


@pytest.mark.parametrize("kind", ["rate", "delta", "times", "printed", "single", "duration"])
def test_the_sample_period_can_be_given_in_many_ways(kind: str) -> None:
    y = signal(1, 500, 0.01)
    expected = tvident.fit_local_polynomials(y, 51, delta=1 / 300)
    t = 1e4 + np.arange(500) / 300
    window: int | str = 51
    ways: dict[str, dict[str, Any]] = {
        "rate": {"sample_rate": 300},
        "delta": {"delta": 1 / 300},
        "times": {"t": t},
        "printed": {"t": np.round(t, 6)},
        "single": {"t": (t - 1e4).astype(np.float32)},
        "duration": {"sample_rate": 300},
    }
    if kind == "duration":
        window = "170 ms"
    fit = tvident.fit_local_polynomials(y, window, **ways[kind])
    np.testing.assert_allclose(fit.derivatives, expected.derivatives, rtol=1e-4)


def test_workers_can_be_set_in_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TVIDENT_WORKERS", "2")
    tvident.fit_local_polynomials(np.arange(100.0), 11)
    monkeypatch.setenv("TVIDENT_WORKERS", "many")
    with pytest.raises(ValueError, match="TVIDENT_WORKERS must be a whole number above zero; got 'many'"):
        tvident.fit_local_polynomials(np.arange(100.0), 11)


@pytest.mark.parametrize("window", [51, "auto"])
@pytest.mark.parametrize("is_uniform", [True, False])
def test_a_fit_is_pickled_with_its_errors(window: Any, is_uniform: bool) -> None:
    """What chose its orders could not be stored, so no fit came back from another process."""
    y = np.stack([signal(1, 500, 0.01), signal(2, 500, 0.01)])
    t = np.arange(500) / 300
    if not is_uniform:
        t[250:] += 0.5
    fit = tvident.fit_local_polynomials(y, window, t=t)
    stored = pickle.loads(pickle.dumps(fit))  # noqa: S301 - what was stored here
    for name in ("derivatives", "stderr", "sigma", "order", "status", "time", "window_length"):
        np.testing.assert_array_equal(getattr(stored, name), getattr(fit, name), name)
    assert stored.settings == fit.settings
    assert fit.scores(100).shape[1:] == (2,)
    with pytest.raises(ValueError, match="scores must be asked of a fit that was not stored"):
        stored.scores(100)


def test_status_has_the_flags_of_the_core() -> None:
    assert {flag.name: int(flag) for flag in Status} == dict(_core.status_flags())
