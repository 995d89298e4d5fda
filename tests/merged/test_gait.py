"""Impedance over cycles of gait: errors beside those that were published of a simulation like it."""

from __future__ import annotations

import pytest

from merged import gait
from parameters import long


@pytest.mark.slow
def test_cycles_that_are_alike_are_known_better_than_published() -> None:
    record = gait.simulated(1)
    for method, most in ((gait.aligned, gait.PUBLISHED[1]), (lambda one: gait.harmonics(one, 11), gait.PUBLISHED[0])):
        errors = record.error(method(record))
        assert max(errors.values()) < most, errors


@pytest.mark.parametrize("seed", long(*range(10)))
def test_cycles_that_vary_are_known_better_than_published(seed: int) -> None:
    record = gait.simulated(seed, variation=0.025)
    errors = record.error(gait.broad_harmonics(record))
    assert max(errors.values()) < gait.PUBLISHED[1], errors
    assert sum(errors.values()) / 3 < sum(gait.PUBLISHED) / 2


@pytest.mark.parametrize("seed", long(*range(10)))
def test_harmonics_are_as_many_as_the_criterion_says(seed: int) -> None:
    record = gait.simulated(seed)
    errors = record.error(gait.harmonics(record))
    assert max(errors.values()) < 1.5 * gait.PUBLISHED[0], errors
