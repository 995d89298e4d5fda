"""Samples, weights and options that an attack found: each ended in a warning or an error that was not the package's own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tvident
from hostile.random_calls import check_message

pytestmark = pytest.mark.filterwarnings("error")

RIG = tvident.simulate_torsional_rig(duration=3.0, sample_rate=200.0)
TIMES = RIG.time + np.random.default_rng(0).uniform(-0.0022, 0.0022, RIG.time.size)
HUGE = np.where(np.arange(RIG.time.size) == 300, 1e300, RIG.torque)
INFINITE = np.where(np.arange(RIG.time.size) > 300, np.inf, RIG.angle)


@pytest.mark.parametrize("scale", [1e-300, 1e-30, 1e300])
def test_weights_count_relative_to_each_other(scale: float) -> None:
    weights = np.random.default_rng(1).uniform(0.1, 1.0, RIG.time.size)
    usual = tvident.identify(RIG.angle, RIG.torque, sample_rate=200, weights=weights)
    found = tvident.identify(RIG.angle, RIG.torque, sample_rate=200, weights=weights * scale)
    np.testing.assert_allclose(found.stiffness, usual.stiffness, rtol=1e-9)
    np.testing.assert_allclose(found.stderr["stiffness"], usual.stderr["stiffness"], rtol=1e-7)


@pytest.mark.parametrize("torque", [RIG.torque, HUGE, np.full(RIG.time.size, np.nan), np.full(RIG.time.size, 1e-300)])
@pytest.mark.parametrize("angle", [RIG.angle, INFINITE, np.zeros(RIG.time.size), np.full(RIG.time.size, np.nan)])
def test_times_of_their_own(angle: Any, torque: Any) -> None:
    with np.errstate(all="raise"):
        tvident.identify(angle, torque, t=TIMES).summary()


@pytest.mark.parametrize("torque", [HUGE, 1e200 * RIG.torque])
def test_several_masses(torque: Any) -> None:
    found = tvident.identify(
        np.stack([RIG.angle, INFINITE]), np.stack([RIG.torque, torque]), sample_rate=200, dof_axis=0
    )
    found.summary()
    found.held_back()
    assert found.modes is not None


CALLS: tuple[Any, ...] = (
    lambda: tvident.Chain(2, [0]),  # type: ignore[list-item]
    lambda: tvident.IdentificationStream(sample_rate=100, terms=5.0),  # type: ignore[arg-type]
    lambda: tvident.IdentificationStream(sample_rate=100, quantisation=(1,)),  # type: ignore[arg-type]
    lambda: tvident.identify(RIG.angle, RIG.torque, sample_rate=200, acceleration=RIG.angle, quantisation=-(10**400)),
    lambda: tvident.identify(RIG.angle, RIG.torque, sample_rate=200, acceleration=RIG.angle, quantisation="x"),  # type: ignore[call-overload]
)


@pytest.mark.parametrize("call", CALLS)
def test_options_of_a_wrong_type_say_what_would_be_right(call: Any) -> None:
    with pytest.raises((ValueError, TypeError)) as refused:
        call()
    check_message(refused.value)


def test_the_core_of_huber_goes_over_what_is_infinite() -> None:
    rows = np.random.default_rng(2).standard_normal((300, 2))
    rhs = rows.sum(axis=1)
    rhs[100] = np.inf
    found = tvident.rolling_least_squares(rows, rhs, 40, loss="huber", weights=np.full(300, 1e300))
    assert np.isfinite(found.params).any()


def test_advice_knows_parameters_at_every_sample() -> None:
    """Dry friction is missing, and what explains more beside a stiffness that is an array is compared."""
    torque = RIG.torque + 0.3 * np.sign(np.gradient(RIG.true_angle))
    found = tvident.identify(RIG.angle, torque, sample_rate=200, stiffness=RIG.stiffness)
    assert any("coulomb" in words for words in found.advice)
