"""A rate that changes while a session runs is told from samples that were lost, and what stamps cannot tell is said."""

from __future__ import annotations

import numpy as np
import pytest

from live.test_losses import COUNT, Numbers, Stamps, clocked, sent, without

CHANGES = 6000
"""The sample at which the rate changes."""


def changed(rate: float, block: int, kept: Numbers, late: float = 2e-4) -> Stamps:
    """Give stamps of 1 kHz up to a sample, and of another rate from there on."""
    generator = np.random.default_rng(4)
    taken: Stamps = np.where(kept < CHANGES, kept * 1e-3, CHANGES * 1e-3 + (kept - CHANGES) / rate)
    if block == 1:
        return taken + generator.exponential(late / 10, kept.size)
    last: Numbers = np.minimum((np.arange(kept.size) // block + 1) * block, kept.size) - 1
    return taken[last] + generator.exponential(late, kept.size)[last] - (last - np.arange(kept.size)) * 1e-3


@pytest.mark.parametrize("rate", [950.0, 990.0, 1010.0, 1050.0])
@pytest.mark.parametrize("block", [1, 20])
def test_a_rate_that_changes_loses_nothing(rate: float, block: int) -> None:
    """Of 12 000 samples that came at 950 Hz from 8 s on 410 were lost, and the rate in all was said to be 989 Hz."""
    clock, _ = clocked(changed(rate, block, without()), without())
    assert clock.lost + clock.repeated <= 3
    (change,) = clock.changes
    # The clock follows 1 % for some 16 buffers.
    assert change.stamp == pytest.approx(CHANGES * 1e-3, abs=0.016 * block + 0.1)
    assert [1 / change.before, 1 / change.after] == pytest.approx([1000, rate], rel=1e-3)
    assert 1 / clock.rate.period == pytest.approx(rate, rel=2e-5)
    assert f"the rate changed at {change.stamp:.1f} s from " in clock.changed
    assert clock.warning == clock.changed
    assert clock.changed in clock.words()
    # What was taken for lost until it showed is none.
    assert (clock.mistaken > 0) == (f"{clock.mistaken} samples were taken for lost" in clock.changed)


@pytest.mark.parametrize("rate", [880.0, 1200.0])
def test_a_rate_that_becomes_another_one_is_said_with_the_change(rate: float) -> None:
    clock, _ = clocked(changed(rate, 1, without()), without())
    assert float(clock.warning.rpartition("--sample-rate ")[2]) == pytest.approx(rate, rel=2e-3)
    assert clock.changed in clock.words()


@pytest.mark.parametrize("rate", [950.0, 1000.0, 1050.0])
def test_losses_after_a_change_are_counted(rate: float) -> None:
    kept = without((9000, 9064), (10_000, 10_001))
    clock, _ = clocked(changed(rate, 1, kept), kept)
    assert (clock.lost, clock.repeated) == (65, 0)
    assert len(clock.changes) == (rate != 1000)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("block", "late"), [(1, 2e-5), (1, 2e-4), (20, 2e-4), (20, 3e-3), (64, 3e-3)])
@pytest.mark.parametrize("share", [0.003, 0.03])
def test_samples_that_are_lost_at_random_are_no_change(block: int, late: float, share: float, seed: int) -> None:
    generator = np.random.default_rng(seed)
    kept = np.flatnonzero((generator.random(COUNT) > share) | (np.arange(COUNT) < CHANGES))
    clock, _ = clocked(sent(kept, block, late), kept)
    assert not clock.changes
    assert clock.mistaken == 0


@pytest.mark.parametrize("share", [0.003, 0.01])
def test_what_late_buffers_hide_is_said(share: float) -> None:
    """Of 1 % of samples, lost one by one from chunks of 64 that come 3 ms late, half were counted, and no word said more."""
    kept = np.flatnonzero(np.random.default_rng(5).random(3 * COUNT) > share)
    clock, _ = clocked(sent(kept, 64, 3e-3), kept)
    missing = 3 * COUNT - kept.size
    assert clock.lost < 0.8 * missing
    # Buffers come 3 ms late, which is as much as so many samples take.
    assert clock.lost + clock.hidden == pytest.approx(missing, abs=12)
    assert f"if its rate is the nominal one, {clock.hidden} more are lost" in "\n".join(clock.words())
    assert not clock.warning or f"unless {clock.hidden} samples more are lost than are counted" in clock.warning
    clock, _ = clocked(sent(without(), 64, 3e-3), without())
    assert (clock.lost, clock.hidden) == (0, 0)
