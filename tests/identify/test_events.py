"""What happens in a record at some times only: samples that a recorder lost without leaving a gap."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import Status

Array = npt.NDArray[np.float64]

RATE = 1000.0
INSIDE = slice(500, -500)
LOST, LOSSES = 3, 40
ERROR = 0.6e-2
"""Of inertia and stiffness beside losses: six times what it is without, a sixth of what it is where losses are not seen."""


def lost_places(samples: int, seed: int) -> npt.NDArray[np.bool_]:
    there = np.ones(samples, bool)
    for first in np.random.default_rng(seed).integers(100, samples - 100, LOSSES):
        there[first : first + LOST] = False
    return there


@pytest.mark.parametrize("gap", ["none", "torque"])
def test_equations_over_lost_samples_are_left_out_and_said(gap: str) -> None:
    rig = tvident.simulate_torsional_rig(20.0, seed=1, pattern="constant", angle_noise=1e-3)
    there = lost_places(rig.angle.size, 1)
    torque = rig.torque[there]
    if gap == "torque":
        torque[np.flatnonzero(np.diff(np.flatnonzero(there)) > 1)] = np.nan
    result = tvident.identify(rig.angle[there], torque, sample_rate=RATE)
    error = (result.stiffness / rig.stiffness[there] - 1)[INSIDE]
    assert float(np.sqrt(np.mean(error**2))) < ERROR
    assert abs(result.inertia[0] / rig.inertia[0] - 1) < ERROR
    assert not result.record_status & (Status.NOISE_MODEL | Status.CHANNEL_SUSPECTED)
    (said,) = [reason for reason in result.reasons if "samples are lost" in reason]
    assert 0.8 * LOSSES < int(said.split(" places")[0].split()[-1]) <= LOSSES
    # Equations over a loss are missing, and those between are not.
    assert 0.02 < np.mean(result.status & Status.GAP != 0) < 0.5


def test_records_of_which_nothing_is_lost_are_not_said_to_lose_samples() -> None:
    for pattern in ("slider", "square"):
        rig = tvident.simulate_torsional_rig(10.0, seed=4, pattern=pattern, angle_noise=1e-3)
        for angle in (rig.angle, np.round(rig.angle / 1e-4) * 1e-4):
            result = tvident.identify(angle, rig.torque, sample_rate=RATE)
            assert not any("lost" in reason for reason in result.reasons)
