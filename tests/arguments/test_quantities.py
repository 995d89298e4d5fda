"""Quantities and durations where numbers are taken: rates, periods, lags, lengths of windows."""

from __future__ import annotations

import datetime as dt
from typing import Any

import numpy as np
import pandas as pd
import pint
import pytest

import tvident

UNIT: Any = pint.application_registry
RIG = tvident.simulate_torsional_rig(duration=2.0)
COUNT = RIG.time.size


def inertia(**given: Any) -> float:
    """Identify the rig."""
    return float(tvident.identify(RIG.angle, RIG.torque, **given).constants["inertia"][0])


PLAIN = inertia(sample_rate=1000)


@pytest.mark.parametrize(
    "given",
    [
        {"sample_rate": 1 * UNIT.kHz},
        {"sample_rate": 1 / UNIT.ms},
        {"sample_rate": (1 * UNIT.kHz, 1000 * UNIT.Hz)},
        {"sample_rate": tvident.Channel(np.array(1.0), "kHz")},
        {"sample_rate": np.array([[1000.0]])},
        {"sample_rate": np.array(1000)},
        {"delta": 1 * UNIT.ms},
        {"delta": np.timedelta64(1, "ms")},
        {"delta": dt.timedelta(milliseconds=1)},
        {"delta": pd.Timedelta("1ms")},
        {"delta": 1, "time_unit": "ms"},
        {"sample_rate": 1000, "lag": 0 * UNIT.ms},
    ],
)
def test_a_rate_or_a_period_may_know_its_unit(given: dict[str, Any]) -> None:
    """A quantity of pint was no number."""
    np.testing.assert_allclose(inertia(**given), PLAIN, rtol=1e-12)


@pytest.mark.parametrize("given", [{"t": (RIG.time * 1e3, RIG.time * 1e3)}, {"delta": (1, 1)}])
def test_two_clocks_may_count_milliseconds(given: dict[str, Any]) -> None:
    """It was refused as if a rate had been given."""
    in_seconds = inertia(sample_rate=(1000, 1000))
    np.testing.assert_allclose(inertia(time_unit="ms", **given), in_seconds, rtol=1e-9)


def test_lengths_of_windows_may_know_their_unit() -> None:
    lengths: tuple[Any, ...] = (21 * UNIT.ms, dt.timedelta(milliseconds=21), np.timedelta64(21, "ms"))
    for length in lengths:
        fit = tvident.fit_local_polynomials(RIG.angle, length, sample_rate=1 * UNIT.kHz)
        same = tvident.fit_local_polynomials(RIG.angle, 21, sample_rate=1000)
        np.testing.assert_array_equal(fit.derivatives, same.derivatives)
    form = tvident.WeakForm(window_length=31 * UNIT.ms, regression_window=0.2 * UNIT.s)
    assert form.window_length == "0.031 s"
    regressors = np.column_stack([RIG.angle, np.ones(COUNT)])
    tenth: Any = pd.Timedelta("0.1s")
    found = tvident.rolling_least_squares(regressors, RIG.torque, tenth, t=RIG.time)
    counted = tvident.rolling_least_squares(regressors, RIG.torque, 100, t=RIG.time)
    np.testing.assert_array_equal(found.params, counted.params)


def test_parts_and_simulations_take_quantities() -> None:
    result = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000)
    part = result.between(500 * UNIT.ms, 1 * UNIT.s)
    np.testing.assert_array_equal(part.time, result.between(0.5, 1.0).time)
    recording = tvident.FileRecording({"t [s]": RIG.time, "angle [rad]": RIG.angle})
    second: Any = dt.timedelta(seconds=1)
    assert recording.select(500 * UNIT.ms, second)["angle"].size == 500
    assert tvident.simulate_torsional_rig(duration=1 * UNIT.s, sample_rate=0.5 * UNIT.kHz).time.size == 500


@pytest.mark.parametrize("known", [0.02 * UNIT.kg * UNIT.m**2, 2e5 * UNIT.g * UNIT.cm**2])
def test_a_known_parameter_of_pint_is_converted(known: Any) -> None:
    """Pint writes ``kg * m ** 2``, which no header does."""
    result = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, inertia=known)
    np.testing.assert_allclose(result.inertia, 0.02, rtol=1e-12)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"sample_rate": 1 * UNIT.ms}, "sample_rate must be in a unit that can be converted to Hz; got 'ms'"),
        ({"sample_rate": 1000 * UNIT.deg / UNIT.s}, "converted to Hz"),
        ({"delta": 1 * UNIT.kHz}, "delta must be in a unit that can be converted to s"),
        ({"sample_rate": 1000, "lag": 1 * UNIT.rad}, "lag must be in a unit that can be converted to s"),
        ({"sample_rate": 1000, "method": ("weak", 31 * UNIT.deg)}, "window_length must be in a unit"),
        ({"sample_rate": -1 * UNIT.kHz}, "sample_rate must be positive"),
    ],
)
def test_another_quantity_is_refused(given: dict[str, Any], words: str) -> None:
    if "method" in given:
        with pytest.raises(ValueError, match=words):
            tvident.WeakForm(window_length=given["method"][1])
        return
    with pytest.raises(ValueError, match=words):
        inertia(**given)


@pytest.mark.parametrize(
    ("duration", "words"),
    [
        (np.timedelta64(10), "10 without a unit"),
        (np.timedelta64(1, "M"), "1 months"),
        (np.timedelta64(1, "Y"), "1 years"),
        (np.timedelta64("NaT"), "NaT"),
        (np.timedelta64("NaT", "ms"), "NaT"),
    ],
)
def test_a_duration_of_numpy_has_a_length(duration: Any, words: str) -> None:
    """Without a unit it was seconds, of months the words were those of NumPy."""
    with pytest.raises(ValueError, match=f"delta must be a duration in weeks, .*; got {words}; give seconds, or "):
        inertia(delta=duration)
    with pytest.raises(ValueError, match=f"lag must be a duration .*; got {words}; give seconds, or "):
        inertia(sample_rate=1000, lag=duration)


def test_a_period_that_knows_its_unit_needs_no_other() -> None:
    with pytest.raises(TypeError, match=r"delta says its unit itself; .*leave time_unit out"):
        inertia(delta=1 * UNIT.ms, time_unit="ms")


class Words:
    """A quantity that is no number."""

    units, magnitude = "kHz", "fast"


def test_words_with_a_unit_are_no_number() -> None:
    with pytest.raises(TypeError, match="sample_rate must be a number"):
        inertia(sample_rate=Words())
