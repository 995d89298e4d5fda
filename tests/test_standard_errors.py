"""Standard errors of what is computed from several parameters, against what they are over many recordings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tvident

RUNS = 150
# A standard deviation of so many draws scatters by 1/√(2 · 150) = 6 %; three of these, and 5 % for what the delta method leaves out.
SCATTER = 0.23


@pytest.mark.parametrize(
    "call",
    [
        {"equations": 1500},
        {"equations": 1500, "inertia": "constant", "damping": "constant"},
        {"inertia": "constant", "damping": "constant", "stiffness": "constant"},
    ],
    ids=["tested", "windowed", "constant"],
)
def test_errors_of_frequency_and_damping_ratio_are_those_of_many_recordings(call: dict[str, Any]) -> None:
    clean = tvident.simulate_torsional_rig(4.0, pattern="constant", torque_snr_db=200, angle_noise=1e-12)
    generator = np.random.default_rng(0)
    level = 0.1 * float(clean.torque.std())
    at = 2000
    found: dict[str, list[tuple[float, float]]] = {"natural_frequency": [], "damping_ratio": []}
    for _ in range(RUNS):
        torque = clean.torque + level * generator.standard_normal(clean.torque.size)
        result = tvident.identify(clean.angle, torque, sample_rate=1000, step=at, window_length=81, exponent=8, **call)
        for name, pairs in found.items():
            pairs.append((float(getattr(result, name)[1]), float(result.stderr[name][1])))
    for name, pairs in found.items():
        values, errors = np.transpose(pairs)
        assert np.median(errors) == pytest.approx(np.std(values), rel=SCATTER), name
    truth = np.sqrt(clean.stiffness[at] / clean.inertia[at]) / (2 * np.pi)
    assert np.mean([value for value, _ in found["natural_frequency"]]) == pytest.approx(truth, rel=1e-3)


def test_errors_do_not_depend_on_the_way_the_equations_took() -> None:
    rig = tvident.simulate_torsional_rig(4.0, pattern="constant")
    kinds: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
    call: dict[str, Any] = {"sample_rate": 1000, "preset": "paper", **kinds}
    # A mask, even one that leaves nothing out, is what rows are made one by one for.
    plain = tvident.identify(rig.angle, rig.torque, **call)
    masked = tvident.identify(rig.angle, rig.torque, mask=np.ones(rig.angle.size, dtype=bool), **call)
    for name in ("inertia", "stiffness", "natural_frequency", "damping_ratio"):
        expected = plain.stderr[name][2000]
        assert masked.stderr[name][2000] == pytest.approx(expected, rel=0.1), name
