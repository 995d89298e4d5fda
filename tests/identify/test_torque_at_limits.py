"""A torque that stays at a limit: the drive's, which acts on the machine, or the recorder's, behind which it goes on."""

from functools import cache

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import lsim

from tvident import Identification, Status, identify

RATE, FINER = 1000, 10
INERTIA, DAMPING, STIFFNESS = 0.02, 0.15, 30.0

OFF = 0.02
"""What parameters may be wrong by: about ten standard errors where a quarter of the torque is missing."""


@cache
def drive(seed: int, limit: float, seconds: float = 10.0) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return angle and torque of a machine whose drive has a limit, in standard deviations of what it is told."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * RATE * FINER)) / (RATE * FINER)
    told = sum(np.cos(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi)) for f in np.arange(0.5, 16, 0.7))
    acts = np.clip(told, -limit * np.std(told), limit * np.std(told))
    system = ([1.0], [INERTIA, DAMPING, STIFFNESS])
    angle = lsim(system, acts, t)[1][::FINER]
    angle += 1e-4 * np.std(angle) * rng.standard_normal(angle.size)
    return angle, acts[::FINER]


def recorded(torque: npt.NDArray[np.float64], seed: int, limit: float) -> npt.NDArray[np.float64]:
    """Return a torque with the noise of its sensor, at most as large as a recorder's range."""
    noisy = torque + 0.005 * np.std(torque) * np.random.default_rng(seed).standard_normal(torque.size)
    return np.clip(noisy, -limit * np.std(torque), limit * np.std(torque))


def is_near(found: Identification) -> bool:
    """Whether parameters are what they are."""
    estimates = (found.inertia, found.damping, found.stiffness)
    ratios = [np.nanmedian(one) / true for one, true in zip(estimates, (INERTIA, DAMPING, STIFFNESS), strict=True)]
    return all(abs(ratio - 1) < OFF for ratio in ratios)


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("seed", range(4))
def test_samples_at_the_limit_of_a_recorder_count_as_missing(seed: int) -> None:
    """Inertia was 15 to 60 % wrong, and advice gave friction and a hardening spring that were not there."""
    angle, torque = drive(seed, np.inf)
    clipped = recorded(torque, seed, 1.2)
    found = identify(angle, clipped, sample_rate=RATE)
    assert is_near(found)
    assert found.record_status & Status.CHANNEL_SUSPECTED
    assert found.advice[0].startswith("the torque is clipped: ")
    assert "they count as missing; record with a larger range" in found.advice[0]
    # Given as missing they are the same.
    missing = np.where(np.abs(clipped) < np.abs(clipped).max(), clipped, np.nan)
    np.testing.assert_array_equal(identify(angle, missing, sample_rate=RATE).inertia, found.inertia)


def test_steps_at_both_limits_of_a_recorder_are_no_readings_that_failed() -> None:
    """Samples at one limit counted as readings that failed, and what is constant changed with the others: 0.5 to 3 % off, 4 to 6 errors."""
    rng = np.random.default_rng(6)
    n, hold = 20 * RATE, 45
    level = np.repeat(rng.standard_normal(n // hold + 1), hold)[:n]
    fine = np.repeat(level, FINER)
    system = ([1.0], [INERTIA, DAMPING, STIFFNESS])
    angle = lsim(system, fine, np.arange(fine.size) / (RATE * FINER), interp=False)[1][::FINER]
    angle += 2e-3 * np.std(angle) * rng.standard_normal(n)
    # What acts from one sample to the next is recorded in its middle.
    between = (level + np.concatenate([level[:1], level[:-1]])) / 2
    clipped = np.clip(between + 0.05 * rng.standard_normal(n), -1.9, 1.9)
    found = identify(angle, clipped, sample_rate=RATE)
    assert found.settings["kinds"]["inertia"] == found.settings["kinds"]["damping"] == "constant"
    for name, true in (("inertia", INERTIA), ("damping", DAMPING)):
        value, error = found.constants[name]
        assert abs(value - true) < 4 * error, name
    assert not any("failed" in words or "one and the same value" in words for words in found.reasons)


@pytest.mark.parametrize("limit", [1.2, np.inf])
def test_a_part_of_a_long_record_is_asked_first_whose_limits_they_are(limit: float) -> None:
    """Whatever the part says, numbers are those of the whole record with or without these samples."""
    angle, torque = (np.tile(channel, 7) for channel in drive(0, limit))
    clipped = recorded(torque, 0, 1.2) if np.isinf(limit) else torque
    found = identify(angle, clipped, sample_rate=RATE)
    is_left_out = bool(found.record_status & Status.CHANNEL_SUSPECTED)
    assert is_left_out == np.isinf(limit)
    assert is_near(found)
    if is_left_out:
        missing = np.where(np.abs(clipped) < np.abs(clipped).max(), clipped, np.nan)
        np.testing.assert_array_equal(identify(angle, missing, sample_rate=RATE).inertia, found.inertia)


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("seed", range(4))
def test_samples_at_the_limit_of_a_drive_count(seed: int) -> None:
    angle, torque = drive(seed, 1.2)
    # What a drive says of itself has no noise.
    found = identify(angle, torque, sample_rate=RATE)
    assert is_near(found)
    assert not found.record_status & Status.CHANNEL_SUSPECTED
    assert not any("clipped" in words for words in found.advice)
    assert not np.any(found.status & Status.GAP)
