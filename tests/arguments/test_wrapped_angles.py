"""A wrapped angle gives what the angle gives that was not wrapped, or says what cannot be known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from reference.unwrap import unwrapped_slowly

# Whole periods that are added and removed again cost some units in the last place of the largest angle, some 10 periods.
ROUNDING = 1e-13


def wrapped(angle: npt.NDArray[np.float64], period: float) -> npt.NDArray[np.float64]:
    return (angle + period / 2) % period - period / 2


def rotation(samples: int = 4000) -> npt.NDArray[np.float64]:
    """Go round at 5 rad/s, with two vibrations, 200 samples a second."""
    t = np.arange(samples) / 200
    return 5 * t + 0.5 * np.sin(7 * t) + 0.2 * np.sin(19 * t)


@given(
    seed=st.integers(0, 2**32),
    period=st.sampled_from([2 * math.pi, 360.0, 1.0]),
    axis=st.sampled_from([0, 1, -1]),
    missing=st.sampled_from([0.0, 0.02]),
)
def test_derivatives_of_a_wrapped_angle_are_those_of_the_angle(
    seed: int, period: float, axis: int, missing: float
) -> None:
    rng = np.random.default_rng(seed)
    # Half a period at most, with what lies between two lost samples.
    steps = 0.05 * period * rng.uniform(-1, 1, (2, 300)).cumsum(axis=1) / 4
    angle = np.clip(steps, -0.12 * period, 0.12 * period).cumsum(axis=1)
    angle[rng.random(angle.shape) < missing] = np.nan
    given_wrapped = np.moveaxis(wrapped(angle, period), 1, axis)
    fit = tvident.fit_local_polynomials(given_wrapped, 21, order=3, axis=axis, period=period)
    expected = np.stack([unwrapped_slowly(one, period) for one in wrapped(angle, period)])
    plain = tvident.fit_local_polynomials(np.moveaxis(expected, 1, axis), 21, order=3, axis=axis)
    tolerance = ROUNDING * (1 + np.nanmax(np.abs(expected)))
    np.testing.assert_allclose(fit.derivatives[1:], plain.derivatives[1:], rtol=0, atol=tolerance)
    if not missing:
        np.testing.assert_allclose(fit.derivatives, plain.derivatives, rtol=0, atol=tolerance)
        assert fit.settings["splits"] == [[], []]
    smooth = tvident.savgol_filter(given_wrapped, 21, 3, deriv=1, axis=axis, period=period)
    np.testing.assert_allclose(smooth, np.moveaxis(plain.derivatives[1], 0, 0), rtol=0, atol=tolerance)


def test_gaps_are_bridged_where_the_motion_says_how_often_it_went_round() -> None:
    period = 2 * math.pi
    angle = rotation()
    angle[1000:1150] = np.nan  # 3.75 rad in the gap, with the mean velocity on either side right within 1 rad
    angle[2000] = np.nan
    fit = tvident.fit_local_polynomials(wrapped(angle, period), 21, order=3, period=period)
    plain = tvident.fit_local_polynomials(angle, 21, order=3)
    np.testing.assert_allclose(fit.derivatives, plain.derivatives, rtol=0, atol=ROUNDING * 100)
    assert fit.settings["splits"] == []


def test_a_gap_that_does_not_say_how_often_is_said() -> None:
    period = 2 * math.pi
    angle = rotation(2000)
    angle[500:1500] = np.nan
    fit = tvident.fit_local_polynomials(wrapped(angle, period), "auto", period=period)
    assert fit.settings["splits"] == [1500]
    # The derivatives do not depend on it.
    plain = tvident.fit_local_polynomials(angle, "auto")
    np.testing.assert_allclose(fit.derivatives[1], plain.derivatives[1], rtol=0, atol=ROUNDING * 100)


def test_a_step_of_half_a_period_counts_as_missing() -> None:
    angle = rotation(500)
    angle[250:] += math.pi
    fit = tvident.fit_local_polynomials(wrapped(angle, 2 * math.pi), 11, order=2, period=2 * math.pi)
    invalid = np.flatnonzero(fit.status & tvident.Status.INVALID)
    assert list(invalid) == list(range(245, 256))


def test_identification_of_a_wrapped_angle_is_that_of_the_angle() -> None:
    rig = tvident.simulate_torsional_rig(duration=4, sample_rate=500, seed=1)
    period = 0.4 * float(np.ptp(rig.angle))
    plain = tvident.identify(rig.angle, rig.torque, sample_rate=500)
    given_wrapped = np.stack([wrapped(rig.angle, period), wrapped(-rig.angle, period)])
    torques = np.stack([rig.torque, -rig.torque])
    found = tvident.identify(given_wrapped, torques, sample_rate=500, period=period)
    np.testing.assert_allclose(found.stiffness[0], plain.stiffness, rtol=1e-9)
    assert not np.asarray(found.record_status)[0] & tvident.Status.CHANNEL_SUSPECTED
    again = tvident.identify(given_wrapped, torques, sample_rate=500, settings=found.settings)
    assert again.settings["period"] == period
    np.testing.assert_array_equal(again.stiffness, found.stiffness)


def test_a_record_that_a_gap_splits_is_identified_in_its_longest_part() -> None:
    t = np.arange(6000) / 500
    angle = 3 * np.sin(9 * t) + 2 * np.sin(23 * t)
    torque = (
        0.01 * (-243 * np.sin(9 * t) - 1058 * np.sin(23 * t))
        + 0.02 * (27 * np.cos(9 * t) + 46 * np.cos(23 * t))
        + 3 * angle
    )
    record = wrapped(angle, 2 * math.pi)
    record[2000:2300] = np.nan
    call: dict[str, Any] = {"sample_rate": 500, "stiffness": "constant", "terms": ()}
    found = tvident.identify(record, torque, period=2 * math.pi, **call)
    assert found.constants["stiffness"][0] == pytest.approx(3, rel=1e-3)
    assert tvident.Status.CHANNEL_SUSPECTED in found.record_status
    assert any("only samples 2300 to 5999 are used" in line for line in found.advice)
    # Without a spring it does not matter how often the angle went round.
    free = tvident.identify(record, torque, period=2 * math.pi, **(call | {"stiffness": 0.0}))
    assert not any("samples 2300" in line for line in free.advice)


@pytest.mark.parametrize(
    ("period", "message"),
    [(0.5, "must lie within one period; y spans 3.2 with period=0.5"), (-1.0, "positive"), (math.nan, "positive")],
)
def test_a_period_that_cannot_be_is_refused(period: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tvident.fit_local_polynomials(np.linspace(-1.6, 1.6, 100), 11, period=period)
