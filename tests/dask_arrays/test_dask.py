from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from typing import Any

import dask
import dask.array as da
import numpy as np
import pytest
from distributed import Client, LocalCluster
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
import tvident.dask
from parameters import examples, long
from tvident import Status

SAMPLES = 60_000
ROUNDING = 1e-12
"""Promised of shared parameters, times the condition number of the equations."""
MOST_DIFFERENCE = 3.0
"""Of a standard error: three of the difference of two estimates, one with twice the variance of the other."""


@pytest.fixture(scope="module")
def rig() -> tvident.Recording:
    return tvident.simulate_torsional_rig(duration=SAMPLES / 1000, sample_rate=1000, seed=2, pattern="slider")


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        yield client


def chunked(values: Any, chunks: Any) -> Any:
    return da.from_array(np.asarray(values), chunks=chunks)


def assert_same_bits(found: tvident.dask.DaskIdentification, whole: tvident.Identification) -> None:
    expected = whole.columns()
    (columns,) = da.compute(dict(found.columns))
    for name, values in columns.items():
        assert values.tobytes() == np.ascontiguousarray(expected[name]).tobytes(), name
    assert found.settings == whole.settings
    assert np.array_equal(found.time.compute(), whole.time)


cuts = st.lists(st.integers(1, 20_000), min_size=1, max_size=12)


@settings(max_examples=examples(8))
@given(cuts=cuts, step=st.sampled_from([1, 3, 250]), half=st.integers(3, 150), rows=st.integers(5, 400))
def test_chunks_of_any_size_have_the_bits_of_one_call(cuts: list[int], step: int, half: int, rows: int) -> None:
    generator = np.random.default_rng(sum(cuts))
    samples = sum(cuts) + 1000
    angle, torque = np.cumsum(generator.standard_normal((2, samples)), axis=-1)
    form = tvident.StrongForm(window_length=2 * half + 1, regression_window=rows)
    options: dict[str, Any] = {
        **dict.fromkeys(("inertia", "damping", "stiffness"), "windowed"),
        "method": form,
        "terms": (),
        "sample_rate": 1000,
        "step": step,
    }
    chunks = ((*cuts, 1000),)
    found = tvident.dask.identify(chunked(angle, chunks), chunked(torque, (samples,)), **options)
    with dask.config.set(scheduler="synchronous"):
        assert_same_bits(found, tvident.identify(angle, torque, **options))


@settings(max_examples=examples(8))
@given(
    cuts=cuts,
    step=st.sampled_from([1, 4, 90]),
    half=st.integers(2, 120),
    selection=st.sampled_from(["window", "pooled", "average"]),
    rounded=st.booleans(),
)
def test_derivatives_have_them_too(cuts: list[int], step: int, half: int, selection: Any, rounded: bool) -> None:
    generator = np.random.default_rng(sum(cuts))
    samples = sum(cuts) + 2 * half + 1
    y = np.sin(np.arange(samples) / 30) + 1e-3 * generator.standard_normal(samples)
    y[generator.integers(0, samples, 2)] = np.nan
    y = np.round(y, 2) if rounded else y
    whole = tvident.fit_local_polynomials(y, 2 * half + 1, sample_rate=100, selection=selection, step=step)
    found = tvident.dask.fit_local_polynomials(
        chunked(y, ((*cuts, 2 * half + 1),)), 2 * half + 1, sample_rate=100, selection=selection, step=step
    )
    names = ("derivatives", "stderr", "order", "sigma", "status")
    for name, values in zip(
        names, dask.compute(*(getattr(found, one) for one in names), scheduler="synchronous"), strict=True
    ):
        assert values.tobytes() == np.ascontiguousarray(getattr(whole, name)).tobytes(), name


@settings(max_examples=examples(8))
@given(
    cuts=cuts,
    step=st.sampled_from([1, 7]),
    half=st.integers(5, 60),
    weighted=st.booleans(),
    policy=st.sampled_from(["omit", "propagate"]),
    max_gap=st.sampled_from([None, 3, 900]),
)
def test_derivatives_beside_gaps_and_with_weights_have_them(
    cuts: list[int], step: int, half: int, weighted: bool, policy: Any, max_gap: int | None
) -> None:
    cuts = [cut // 10 + 1 for cut in cuts]
    generator = np.random.default_rng(sum(cuts))
    samples = sum(cuts) + 2 * half + 1
    y = np.sin(np.arange(samples) / 30) + 1e-3 * generator.standard_normal(samples)
    y[generator.integers(0, samples, samples // 300)] = np.nan
    for length in (half, 800):
        first = generator.integers(0, samples)
        y[first : first + length] = np.nan
    weights = np.where(generator.random(samples) < 0.01, 0.0, 10 ** generator.uniform(-1, 1, samples))
    more: dict[str, Any] = {"sample_rate": 100, "step": step, "nan_policy": policy}
    if weighted or policy == "omit":
        more["max_gap"] = max_gap
    length = 2 * half + 1
    whole = tvident.fit_local_polynomials(y, length, weights=weights if weighted else None, **more)
    chunks = ((*cuts, length),)
    found = tvident.dask.fit_local_polynomials(
        chunked(y, chunks), length, weights=chunked(weights, (samples,)) if weighted else None, **more
    )
    names = ("derivatives", "stderr", "order", "sigma", "status")
    for name, values in zip(
        names, dask.compute(*(getattr(found, one) for one in names), scheduler="synchronous"), strict=True
    ):
        assert values.tobytes() == np.ascontiguousarray(getattr(whole, name)).tobytes(), name


def test_a_batch_has_weights_for_each_record_or_for_all() -> None:
    generator = np.random.default_rng(3)
    y, weights = generator.standard_normal((2, 900)), generator.uniform(0.1, 2, (2, 900))
    for one in (weights, weights[0]):
        found = tvident.dask.fit_local_polynomials(chunked(y, (1, 400)), 31, weights=chunked(one, -1))
        whole = tvident.fit_local_polynomials(y, 31, weights=one)
        assert np.array_equal(found.derivatives.compute(scheduler="synchronous"), whole.derivatives)
    with pytest.raises(ValueError, match="weights must have one value for every sample"):
        tvident.dask.fit_local_polynomials(chunked(y, (1, 400)), 31, weights=chunked(weights[:, 1:], -1))
    with pytest.raises(ValueError, match="max_gap must go with nan_policy='omit' or weights"):
        tvident.dask.fit_local_polynomials(chunked(y, (1, 400)), 31, max_gap=3)
    y[1, 700] = np.nan
    raising = tvident.dask.fit_local_polynomials(chunked(y, (1, 400)), 31, nan_policy="raise")
    with pytest.raises(ValueError, match="samples 400 to 800 must be finite; some are not"):
        raising.order.compute(scheduler="synchronous")


def test_two_processes_have_the_bits_of_one_call(rig: tvident.Recording, client: Client) -> None:
    assert len(client.scheduler_info()["workers"]) == 2
    angle, torque = (chunked(one, 9_000) for one in (rig.angle, rig.torque))
    found = tvident.dask.identify(angle, torque, sample_rate=1000, method="paper")
    assert_same_bits(found, tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper"))


@pytest.mark.slow
@pytest.mark.parametrize("terms", [*long(((),)), ("offset", "coulomb")])
def test_shared_parameters_are_those_of_one_call(
    rig: tvident.Recording, client: Client, terms: tuple[str, ...]
) -> None:
    del client  # the work goes there
    angle, torque = (chunked(one, 7_001) for one in (rig.angle, rig.torque))
    options: dict[str, Any] = {
        **dict.fromkeys(("inertia", "damping", "stiffness"), "constant"),
        "method": tvident.StrongForm(window_length=101),
        "terms": terms,
        "sample_rate": 1000,
    }
    found = tvident.dask.identify(angle, torque, **options)
    whole = tvident.identify(rig.angle, rig.torque, **options)
    for name, (value, error) in whole.constants.items():
        near = ROUNDING * float(whole.condition[0])
        assert found.constants[name] == (pytest.approx(value, rel=near), pytest.approx(error, rel=near)), name
    assert np.array_equal(found.status.compute(), whole.status)
    assert np.array_equal(found.order.compute(), whole.order)
    assert found.record_status == whole.record_status


@pytest.mark.slow
def test_the_weak_form_finds_what_one_call_finds(rig: tvident.Recording, client: Client) -> None:
    del client
    whole = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    angle, torque = (chunked(one, 20_000) for one in (rig.angle, rig.torque))
    found = tvident.dask.identify(angle, torque, sample_rate=1000, settings=whole.settings)
    assert found.settings == whole.settings
    for name, (value, error) in whole.constants.items():
        # Neighbours of blocks count twice, and noise is known of each block by itself: two good estimates of one value.
        assert abs(found.constants[name][0] - value) < MOST_DIFFERENCE * error, name
    difference = (found.stiffness.compute() - whole.stiffness) / whole.stderr["stiffness"]
    assert np.sqrt(np.nanmean(difference**2)) < MOST_DIFFERENCE / 3
    assert found.record_status == whole.record_status


@pytest.mark.slow
def test_weights_count_in_every_block(rig: tvident.Recording) -> None:
    samples = 20_000
    weights = np.where(np.arange(samples) < 8000, 1.0, 0.01)
    noise = np.std(rig.torque) * 0.1 * np.random.default_rng(3).standard_normal(samples)
    angle, torque = np.asarray(rig.angle[:samples]), np.where(weights < 1, noise, 0.0) + rig.torque[:samples]
    more: dict[str, Any] = {"sample_rate": 1000, "method": "paper", "step": 50}
    whole = tvident.identify(angle, torque, weights=weights, **more)
    both = (chunked(np.stack([one, one]), (1, 9000)) for one in (angle, torque))
    found = tvident.dask.identify(*both, weights=chunked(weights, 3000), **more)
    assert found.settings["weights"]
    # Both make the same rows: rounding, times the condition of a window.
    away = (found.stiffness.compute() - whole.stiffness) / whole.stderr["stiffness"]
    assert np.nanmax(np.abs(away)) < 1e-6


def test_a_batch_is_many_records(rig: tvident.Recording) -> None:
    angle = np.stack([rig.angle[:9_000], 2 * rig.angle[:9_000]])
    torque = np.stack([rig.torque[:9_000], rig.torque[:9_000]])
    found = tvident.dask.identify(
        chunked(angle, (1, 5_000)), chunked(torque, (2, 5_000)), sample_rate=1000, method="paper"
    )
    for record in range(2):
        whole = tvident.identify(angle[record], torque[record], sample_rate=1000, method="paper")
        assert np.array_equal(found.stiffness[record].compute(), whole.stiffness, equal_nan=True)


@pytest.mark.slow
def test_windows_beside_missing_samples_have_the_bits_of_one_call(rig: tvident.Recording) -> None:
    angle, torque = np.array(rig.angle), np.array(rig.torque)
    torque[30_000:30_040] = angle[7::997] = np.nan
    found = tvident.dask.identify(chunked(angle, 6_000), chunked(torque, 6_000), sample_rate=1000, method="paper")
    whole = tvident.identify(angle, torque, sample_rate=1000, method="paper")
    assert np.array_equal(found.status.compute(), whole.status)
    assert np.array_equal(found.stiffness.compute(), whole.stiffness, equal_nan=True)
    assert np.array_equal(found.stderr["stiffness"].compute(), whole.stderr["stiffness"], equal_nan=True)
    assert (found.status[30_000:30_040].compute() & Status.GAP != 0).all()


@pytest.mark.slow
def test_a_killed_worker_costs_time_and_no_results(rig: tvident.Recording, client: Client) -> None:
    angle, torque = (chunked(one, 6_000) for one in (rig.angle, rig.torque))
    found = tvident.dask.identify(angle, torque, sample_rate=1000, method="paper").stiffness
    pids = client.run(os.getpid)
    future = client.compute(found)
    os.kill(next(iter(pids.values())), signal.SIGKILL)
    stiffness = future.result(timeout=60)
    whole = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper")
    assert np.array_equal(stiffness, whole.stiffness, equal_nan=True)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"angle": np.ones(9000)}, TypeError, "must be a dask array"),
        ({"angle": da.ones(9000, dtype=complex)}, TypeError, "real numbers"),
        ({"torque": da.ones(8000)}, ValueError, "one shape"),
        ({"sample_rate": None}, TypeError, "sample period"),
        ({"inertia": np.ones(9000)}, TypeError, "give a number"),
        ({"weights": da.ones(800)}, ValueError, "one value for every sample"),
    ],
)
def test_a_wrong_call_says_what_would_be_right(change: dict[str, Any], error: type[Exception], words: str) -> None:
    options: dict[str, Any] = {"angle": da.ones(9000), "torque": da.ones(9000), "sample_rate": 1000, "method": "paper"}
    with pytest.raises(error, match=words):
        tvident.dask.identify(**(options | change))


def test_a_result_that_is_not_computed_yet_is_shown_in_one_line(rig: tvident.Recording) -> None:
    """It was what dask says of its arrays, and all units, over many lines."""
    angle, torque = (chunked([one[:8000]] * 3, (1, 4000)) for one in (rig.angle, rig.torque))
    found = tvident.dask.identify(angle, torque, sample_rate=1000, method="paper")
    assert repr(found) == "<DaskIdentification of 3 records of 8000 samples, in dask arrays that are not computed yet>"
    found = tvident.dask.identify(angle[0], torque[0], sample_rate=1000, method="paper")
    assert "of 1 record of 8000 samples" in repr(found)


def test_what_joins_of_parts_spoil_in_strong_form_is_said() -> None:
    """The inertia was .0054 for .0123, 260 errors off, without a word."""
    rig = tvident.simulate_torsional_rig(30.0, pattern="constant")
    steady: dict[str, Any] = {"sample_rate": 1000, "method": tvident.StrongForm()}
    steady |= dict.fromkeys(("inertia", "damping", "stiffness"), "constant")
    both = [np.stack([one[:24_000], np.tile(one[:8000], 3)]) for one in (rig.angle, rig.torque)]
    angle, torque = (chunked(one, (1, 9000)) for one in both)
    found = tvident.dask.identify(angle, torque, **steady)
    assert found.advice[0].startswith("record 1: the weak form finds other numbers at ")
    assert not any(line.startswith("record 0") for line in found.advice)
    assert abs(found.constants["inertia"][0][0] / 0.0123 - 1) < 0.005
    assert tvident.dask.identify(angle[0], torque[0], **steady).advice == ()
