"""Numbers that may mark missing values: what a mask leaves out of any record, and what is asked of records of a batch."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest

import tvident

RIG = tvident.simulate_torsional_rig(duration=3.0, seed=1)
ANGLE, TORQUE = np.asarray(RIG.angle), np.asarray(RIG.torque)
PLACES = slice(1000, 1300)
MARKED = TORQUE.copy()
MARKED[PLACES] = -9999
MISSING = np.where(MARKED == -9999, np.nan, MARKED)
MASK = MARKED != -9999
CALL: Any = tvident.identify


def same(one: Any, other: Any) -> bool:
    """Return whether results have the same bits."""
    return all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in ("stiffness", "status")
    )


@pytest.mark.parametrize("policy", ["omit", "propagate"])
@pytest.mark.parametrize("method", ["auto", "paper"])
def test_marks_that_a_mask_leaves_out_are_missing(
    policy: Literal["omit", "propagate"], method: Literal["auto", "paper"]
) -> None:
    """With "propagate", "the model explains 0.0053 % of the torque"."""
    found, expected = (
        CALL(ANGLE, one, sample_rate=1000, mask=MASK, nan_policy=policy, method=method) for one in (MARKED, MISSING)
    )
    assert same(found, expected)
    assert "do not trust" not in found.summary()
    assert any("which mask= leaves out: they are taken as missing" in line for line in found.reasons)


def test_marks_of_records_of_a_batch_are_missing_where_masked() -> None:
    """Marks of a batch stayed in: "the model explains 43 % of the torque"."""
    angles, masks = np.stack([ANGLE, ANGLE]), np.stack([np.ones_like(MASK), MASK])
    found = CALL(angles, np.stack([TORQUE, MARKED]), sample_rate=1000, mask=masks)
    assert same(found, CALL(angles, np.stack([TORQUE, MISSING]), sample_rate=1000, mask=masks))
    assert "no reason to distrust any" in found.summary()


def test_records_of_a_batch_are_asked_as_one_is() -> None:
    """The question was of the batch alone, and what was tried of the record would explain what was never measured."""
    found = CALL(np.stack([ANGLE, ANGLE]), np.stack([TORQUE, MARKED]), sample_rate=1000)
    words = "numbers that may mark missing values count as measured"
    assert f"do not trust 1 of them, such as record 1: {words}" in found.summary()
    assert found[1].summary().splitlines()[0] == f"do not trust: {words}; see what to do"
    assert "does it mark values that are missing?" in found[1].advice[0]
    assert "do not trust" not in found[0].summary()


@pytest.mark.parametrize("has_masses", [False, True])
def test_marks_of_trials_and_masses_are_missing_where_masked(*, has_masses: bool) -> None:
    """Marks of trials stayed in: "the model explains nothing of the torque"."""
    rigs = [tvident.simulate_torsional_rig(duration=1.0, seed=seed) for seed in range(4)]
    angles, torques = np.stack([rig.angle for rig in rigs]), np.stack([rig.torque for rig in rigs])
    marked, mask = torques.copy(), np.ones(torques.shape, bool)
    marked[2, 300:400], mask[2, 300:400] = 32767, False
    options: dict[str, Any] = {"sample_rate": 1000}
    if has_masses:
        angles, torques, marked, mask = angles[1:3], torques[1:3], marked[1:3], mask[2]
        options |= {"dof_axis": 0, "structure": tvident.Chain(masses=2, springs=[("base", 0), ("base", 1)])}
    else:
        options["ensemble_axis"] = 0
    missing = np.where(marked == 32767, np.nan, marked)
    found, expected = (CALL(angles, one, mask=mask, **options) for one in (marked, missing))
    assert all(found.constants[name] == value for name, value in expected.constants.items())
    assert any("which mask= leaves out: they are taken as missing" in line for line in found.reasons)
    assert not any("missing?" in line for line in found.advice)


def test_an_instrument_that_is_turned_on_and_off_is_not_asked() -> None:
    rng = np.random.default_rng(0)
    reference = np.where(np.arange(TORQUE.size) // 150 % 2, 9999.0, 0.0) + rng.normal(0, 1, TORQUE.size) * (
        np.arange(TORQUE.size) // 150 % 2 == 0
    )
    found = CALL(ANGLE, TORQUE, sample_rate=1000, instrument=reference)
    assert not any("the instrument is 9999" in line for line in found.advice)
    marked = np.where(np.arange(TORQUE.size) < 600, -9999.0, reference)
    asked = CALL(ANGLE, TORQUE, sample_rate=1000, instrument=marked)
    assert any("the instrument is -9999" in line for line in asked.advice)
