"""Weights beside a measured velocity, Huber's loss and an instrument, where half of a record has ten times the noise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tvident
from identify.closed_loop import RATE, TRUTH, closed_loop
from identify.half_noisy import SEEDS, HalfNoisy, assert_weights_help

CONSTANT: dict[str, Any] = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")


def rig_of(seed: int) -> tuple[HalfNoisy, dict[str, float]]:
    """Give a rig with constants, and what they are."""
    rig = HalfNoisy(seed, 6.0, "constant")
    return rig, {name: getattr(rig.known, name)[0] for name in ("inertia", "stiffness")}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["velocity", "acceleration"])
def test_weights_go_with_a_derivative_that_was_measured(name: str) -> None:
    def identified(seed: int, has_weights: bool) -> tuple[tvident.Identification, dict[str, float]]:
        rig, truth = rig_of(seed)
        beside = {name: rig.noisy(getattr(rig.known, f"true_{name}"), 3e-3)}
        given = rig.weights if has_weights else None
        call: dict[str, Any] = {"sample_rate": 1000, "weights": given, **beside, **CONSTANT}
        return tvident.identify(rig.angle, rig.torque, **call), truth

    assert_weights_help(identified)


@pytest.mark.slow
@pytest.mark.parametrize("loss", ["huber", "auto"])
def test_weights_go_with_hubers_loss(loss: Any) -> None:
    def identified(seed: int, has_weights: bool) -> tuple[tvident.Identification, dict[str, float]]:
        rig, truth = rig_of(seed)
        generator = np.random.default_rng(seed + 100)
        spikes = generator.choice(rig.torque.size, 30, replace=False)
        rig.torque[spikes] += 20 * np.std(rig.torque) * generator.choice([-1, 1], spikes.size)
        given = rig.weights if has_weights else None
        found = tvident.identify(rig.angle, rig.torque, sample_rate=1000, weights=given, loss=loss, **CONSTANT)
        assert found.settings["loss"] == "huber"
        return found, truth

    assert_weights_help(identified)


def test_noise_that_weights_explain_is_no_heavy_tail() -> None:
    rig, _ = rig_of(0)
    call: dict[str, Any] = {"sample_rate": 1000, "weights": rig.weights, **CONSTANT}
    found = tvident.identify(rig.angle, rig.torque, loss="auto", **call)
    assert found.settings["loss"] == "squares"
    assert found.constants == tvident.identify(rig.angle, rig.torque, **call).constants


@pytest.mark.slow
@pytest.mark.parametrize("method", ["auto", tvident.StrongForm(window_length=101)], ids=["weak", "strong"])
def test_weights_go_with_an_instrument(method: Any) -> None:
    is_late = np.arange(20_000) >= 10_000
    errors: dict[bool, list[float]] = {False: [], True: []}
    for seed, angle, torque, reference in zip(SEEDS, *closed_loop(SEEDS), strict=True):
        generator = np.random.default_rng(seed)
        spoilt = torque + is_late * 0.5 * np.std(torque) * generator.standard_normal(torque.size)
        for has_weights, each in errors.items():
            weights = np.where(is_late, 1e-3, 1.0) if has_weights else None
            call: dict[str, Any] = {"sample_rate": RATE, "method": method, "instrument": reference}
            found = tvident.identify(angle, spoilt, weights=weights, **call)
            each += [found.constants[name][0] / value - 1 for name, value in TRUTH.items()]
    rms = {has_weights: float(np.sqrt(np.mean(np.square(values)))) for has_weights, values in errors.items()}
    assert rms[True] < rms[False] / 2, rms
