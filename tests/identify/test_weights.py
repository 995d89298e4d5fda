from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from identify.half_noisy import HalfNoisy, assert_weights_help, found_alike

Array = npt.NDArray[np.float64]

RATE = 1000
COVERED = (0.9, 0.98)
"""Share of true values within 1.96 standard errors that is promised, over three records of 24 s; 0.95 is meant."""


def rig(seed: int, duration: float, pattern: Any = "slider") -> tuple[Any, Array, Array, Array]:
    """Give a rig whose second half has ten times the noise, with its weights."""
    made = HalfNoisy(seed, duration, pattern)
    return made.known, made.angle, made.torque, made.weights


@pytest.mark.parametrize("method", ["auto", "paper"])
@pytest.mark.parametrize("nan_policy", ["omit", "raise"])
def test_equal_weights_are_none_and_weight_zero_is_missing(method: Any, nan_policy: Any) -> None:
    _, angle, torque, _ = rig(0, 3.0)
    call: dict[str, Any] = {"sample_rate": RATE, "method": method}
    found_alike(
        tvident.identify(angle, torque, weights=np.full(angle.size, 0.3), nan_policy=nan_policy, **call),
        tvident.identify(angle, torque, **call),
    )
    out = np.zeros(angle.size, bool)
    out[1000:1003] = out[2000] = True
    spoilt = np.where(out, np.nan, angle)
    found = tvident.identify(spoilt, torque, weights=np.where(out, 0.0, 0.3), nan_policy=nan_policy, **call)
    found_alike(found, tvident.identify(spoilt, np.where(out, np.nan, torque), **call))
    assert found.settings["weights"]


def test_a_sample_without_weight_is_left_out_where_missing_ones_propagate() -> None:
    _, angle, torque, _ = rig(0, 3.0)
    out = np.arange(angle.size) == 1000
    call: dict[str, Any] = {"sample_rate": RATE, "method": "paper"}
    without = tvident.identify(angle, torque, weights=np.where(out, 0.0, 1.0), nan_policy="propagate", **call)
    omitted = tvident.identify(np.where(out, np.nan, angle), torque, **call)
    np.testing.assert_allclose(without.stiffness, omitted.stiffness, rtol=1e-9)
    missing = np.where(np.arange(angle.size) == 2000, np.nan, angle)
    both = tvident.identify(missing, torque, weights=np.where(out, 0.0, 1.0), nan_policy="propagate", **call)
    assert np.isfinite(both.stiffness[1150])  # half of the equations of its window are there
    assert np.isnan(both.stiffness[2000])


@pytest.mark.slow
def test_weights_make_errors_smaller_where_half_of_the_record_is_noisier() -> None:
    def identified(seed: int, has_weights: bool) -> tuple[tvident.Identification, dict[str, float]]:
        known, angle, torque, weights = rig(seed, 6.0, pattern="constant")
        constant: Any = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")
        given = weights if has_weights else None
        found = tvident.identify(angle, torque, sample_rate=RATE, weights=given, **constant)
        return found, {name: getattr(known, name)[0] for name in ("inertia", "stiffness")}

    assert_weights_help(identified)


@pytest.mark.slow
def test_errors_hold_where_half_of_the_record_is_noisier() -> None:
    covered = []
    for seed in range(3):
        known, angle, torque, weights = rig(seed, 24.0)
        found = tvident.identify(angle, torque, sample_rate=RATE, weights=weights)
        assert not found.record_status
        covered.append(np.abs(found.stiffness - known.stiffness) < 1.96 * found.stderr["stiffness"])
    assert COVERED[0] < np.mean(covered) < COVERED[1], np.mean(covered)
    # A factor of all weights changes nothing but rounding.
    scaled = tvident.identify(angle, torque, sample_rate=RATE, weights=1e3 * weights)
    np.testing.assert_allclose(scaled.stiffness, found.stiffness, rtol=1e-6)


def test_weights_of_batches_and_lists_are_those_of_their_records() -> None:
    made = [rig(seed, 3.0) for seed in (0, 1)]
    angles, torques = (np.stack([one[place] for one in made]) for place in (1, 2))
    weights = np.stack([made[0][3], made[1][3][::-1]])
    call: dict[str, Any] = {"sample_rate": RATE}
    alone = [tvident.identify(*both, weights=one, **call) for *both, one in zip(angles, torques, weights, strict=True)]
    batch = tvident.identify(angles, torques, weights=weights, **call)
    for place, one in enumerate(alone):
        np.testing.assert_array_equal(batch.stiffness[place], one.stiffness)
        again = tvident.identify(angles[place], torques[place], weights=weights[place], settings=one.settings, **call)
        np.testing.assert_allclose(again.stiffness, one.stiffness, rtol=1e-9)
    same = tvident.identify(angles, torques, weights=weights[0], **call)
    np.testing.assert_array_equal(same.stiffness[0], alone[0].stiffness)
    cut = [slice(None), slice(2000)]
    listed: Any = tvident.identify(
        [one[some] for one, some in zip(angles, cut, strict=True)],
        [one[some] for one, some in zip(torques, cut, strict=True)],
        weights=[one[some] for one, some in zip(weights, cut, strict=True)],
        **call,
    )
    np.testing.assert_array_equal(listed[0].stiffness, alone[0].stiffness)


def test_curves_of_expansions_weigh_samples_by_their_noise() -> None:
    truth = tvident.simulate_torsional_rig(duration=10.0, seed=3, torque_snr_db=200)
    rng, samples = np.random.default_rng(3), truth.angle.size
    weights = np.where(np.arange(samples) < samples // 2, 1.0, 0.01)
    angle, torque = (
        one + part * one.std() * rng.standard_normal(samples) / np.sqrt(weights)
        for one, part in ((truth.angle, 1e-3), (truth.torque, 0.03))
    )
    spring = tvident.Expansion("bspline", of=truth.slider_position)
    options: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": spring, "sample_rate": 1000}
    found = {
        name: tvident.identify(angle, torque, weights=one, **options)
        for name, one in (("alike", None), ("own", weights), ("scaled", 3 * weights), ("ones", np.ones(samples)))
    }
    known = {name: float(np.median(one.stderr["stiffness"])) for name, one in found.items()}
    # Half of the samples have all that counts, and ten times less noise.
    assert known["own"] < 0.4 * known["alike"]
    assert (np.abs(found["own"].stiffness - truth.stiffness) < 4 * found["own"].stderr["stiffness"]).all()
    value, stderr = found["own"].constants["inertia"]
    assert abs(float(value) - float(np.mean(truth.inertia))) < 4 * float(stderr)
    np.testing.assert_allclose(found["scaled"].stiffness, found["own"].stiffness, rtol=1e-5)
    # Weights that are all alike change no bit.
    np.testing.assert_array_equal(found["ones"].stiffness, found["alike"].stiffness)


@pytest.mark.parametrize(
    ("beside", "message"),
    [
        (
            {"weights": np.ones(999)},
            r"weights must have one value for every sample, shape \(1000,\); got shape \(999,\)",
        ),
        ({"weights": -np.ones(1000)}, r"weights must be finite and not negative; weights\[0\] is -1.0; give one over"),
        ({"weights": np.zeros(1000)}, "weights must leave something to use; got zeros alone"),
        ({"angle": None, "velocity": np.ones(1000)}, "weights need an angle: the noise of a velocity stays .* measure"),
    ],
)
def test_what_does_not_go_with_weights_is_said(beside: dict[str, Any], message: str) -> None:
    angle = np.sin(np.arange(1000) / 30)
    call: dict[str, Any] = {"sample_rate": RATE, "angle": angle, "weights": np.linspace(1, 2, 1000), **beside}
    with pytest.raises(ValueError, match=message):
        tvident.identify(torque=angle, **call)
