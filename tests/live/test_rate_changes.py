"""A rate that changes while a session runs is told from samples that were lost, and what stamps cannot tell is said."""

from __future__ import annotations

import numpy as np
import pytest

from live.test_losses import COUNT, Numbers, Stamps, clocked, sent, without
from tvident._live import LiveClock
from tvident._live.changes import Stretches
from tvident._live.rate import Rate

CHANGES = 6000
"""The sample at which the rate changes."""

TWO_LOOKS = 2 * (512 + 1)
"""Samples that are looked at, and those of the look before."""


def changed(rate: float, block: int, kept: Numbers, late: float = 2e-4) -> Stamps:
    """Give stamps of 1 kHz up to a sample, and of another rate from there on."""
    generator = np.random.default_rng(4)
    taken: Stamps = np.where(kept < CHANGES, kept * 1e-3, CHANGES * 1e-3 + (kept - CHANGES) / rate)
    if block == 1:
        return taken + generator.exponential(late / 10, kept.size)
    last: Numbers = np.minimum((np.arange(kept.size) // block + 1) * block, kept.size) - 1
    return taken[last] + generator.exponential(late, kept.size)[last] - (last - np.arange(kept.size)) * 1e-3


def test_the_rate_after_a_change_has_a_base_of_its_own() -> None:
    """What the session's own rate sees later would be in the base twice, and its error too small by half."""
    stretches = Stretches()
    stamps = changed(990.0, 1, without())
    found = next(found for number, stamp in enumerate(stamps) if (found := stretches.see(number, stamp)) is not None)
    count = stretches.base.count
    found[1].see(0.0, 0.0)
    assert stretches.base.count == count > 0


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
    assert not clock.thinned
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


@pytest.mark.parametrize(
    ("turns", "which"), [(2, "every second sample is"), (3, "2 of 3 samples are"), (4, "3 of 4 samples are")]
)
def test_a_part_of_the_rate_may_be_losses_and_is_said_once(turns: int, which: str) -> None:
    """Looks were not ended: lists grew, a sample took 2 ms and more with each, and nothing was said."""
    kept = np.concatenate([np.arange(CHANGES), np.arange(CHANGES, 2 * COUNT, turns)])
    clock, _ = clocked(kept * 1e-3 + np.random.default_rng(6).exponential(2e-5, kept.size), kept)
    words = "\n".join(clock.words())
    assert words.count(f"the rate seems to be {1000 / turns:.4g} Hz, or {which} lost") == 1
    assert clock.warning == clock.thinned
    assert float(clock.warning.split()[1]) == pytest.approx(CHANGES * 1e-3, abs=0.1)
    # Sixteen samples wait at the change and at the end.
    assert clock.lost == pytest.approx((2 * COUNT - CHANGES) * (turns - 1) / turns, abs=16 * (turns - 1))
    assert not clock.changes
    assert max(kept_of(clock)) <= TWO_LOOKS


def kept_of(clock: LiveClock) -> tuple[int, int]:
    """Return how many samples, and how many losses or repetitions, a clock keeps to look at."""
    looks = clock._looks  # noqa: SLF001 - nothing else shows what is kept
    samples, taken_for = len(looks._latest) + len(looks._before), len(looks._taken_for)  # noqa: SLF001
    return samples, taken_for


@pytest.mark.parametrize("rate", [880.0, 1200.0])
def test_nothing_is_kept_for_looks_that_have_ended(rate: float) -> None:
    """Once a nominal rate shows as a mistake none is sought, but what was taken for lost was kept for ever."""
    kept = np.arange(5 * COUNT)
    clock, _ = clocked(changed(rate, 1, kept), kept)
    assert clock.lost + clock.repeated > TWO_LOOKS
    assert max(kept_of(clock)) <= TWO_LOOKS


def test_what_was_not_counted_is_not_taken_back() -> None:
    """A first buffer that came late makes all others early: nothing is counted as repeated, so nothing of it can be taken back."""
    stamps = sent(without(), 20, 2e-5)
    stamps[:20] += 5e-3
    clock = LiveClock(1e-3)
    for place, stamp in enumerate(stamps[:700].tolist()):
        clock.rows((stamp, float(place), 0.0))
    assert (clock.lost, clock.repeated) == (0, 0)
    assert kept_of(clock)[1] == 0


@pytest.mark.parametrize("counts", [(0, 5), (5, 0), (1, 1), (3, 40), (700, 2)])
def test_rates_put_together_are_those_of_all_samples(counts: tuple[int, int]) -> None:
    generator = np.random.default_rng(sum(counts))
    stamps = 1e6 + 1e-3 * np.arange(sum(counts)) + generator.normal(0, 1e-4, sum(counts))
    rates = [Rate() for _ in range(3)]
    for number, stamp in enumerate(stamps.tolist()):
        for rate in (rates[0], rates[1 if number < counts[0] else 2]):
            rate.see(number, stamp)
    whole, joined = rates[0], rates[1].joined(rates[2])
    assert (joined.count, joined.first, joined.last) == (whole.count, whole.first, whole.last)
    # Stamps are rounded to 1e-10 s.
    assert joined.period == pytest.approx(whole.period, rel=1e-6, nan_ok=True)
    if joined.count > 2:
        assert joined.scatter == pytest.approx(whole.scatter, rel=1e-5, abs=1e-9)


def test_no_sample_takes_longer_than_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 10 kHz samples of two seconds were summed twice with the last of them: 26 ms."""
    seen: list[int] = []
    see = Rate.see

    def counted(rate: Rate, number: float, time: float) -> None:
        seen[-1] += 1
        see(rate, number, time)

    monkeypatch.setattr(Rate, "see", counted)
    stretches = Stretches()
    for number in range(70_000):
        seen.append(0)
        stretches.see(number, number * 1e-4)
    assert max(seen) == 1
    assert stretches.base.count > 0


def thin(kept: Numbers, rate: float = 1000.0, block: int = 1) -> list[str]:
    """Return what is said of samples of a rate that have these numbers, at 1 kHz nominal: after each, and at the end."""
    generator = np.random.default_rng(8)
    last: Numbers = np.minimum((np.arange(kept.size) // block + 1) * block, kept.size) - 1
    late = generator.exponential(2e-5 * block, kept.size)[last]
    taken: Stamps = kept[last] / rate + late - (last - np.arange(kept.size)) * 1e-3
    clock, said = LiveClock(1e-3), list[str]()
    for stamp in taken.tolist():
        clock.rows((stamp, generator.normal(), 1.0))
        said.append(clock.thinned)
    clock.rest()
    return [*said, clock.thinned]


@pytest.mark.parametrize("turns", [2, 3, 4])
@pytest.mark.parametrize("block", [1, 20])
def test_a_part_of_the_rate_from_the_first_sample_on_is_said(turns: int, block: int) -> None:
    """It was so many lost samples, and the nominal rate to a millionth."""
    said = thin(np.arange(4000), 1000 / turns, block)
    words = f"{turns - 1} of {turns} samples are lost, from the first on, or the rate is "
    assert said[-1].startswith(words)
    # Four standard errors of a line through 64 samples, or 16 buffers, that are 2 % of a period late, or 2 % of a buffer; four digits.
    assert float(said[-1].split("--sample-rate ")[1]) == pytest.approx(1000 / turns, rel=2.2e-3 if block > 1 else 5e-4)
    assert any(said[:1500])
    assert thin(np.arange(0, 4000 * turns, turns))[-1].startswith(words)


@pytest.mark.parametrize(
    "kept",
    [
        np.flatnonzero(np.random.default_rng(2).random(12_000) < 0.5),
        np.flatnonzero(np.arange(12_000) % 3),
        np.concatenate([np.arange(0, 200, 2), np.arange(200, 8000)]),
        np.arange(8000),
    ],
    ids=["half by chance", "two of three", "few by turns", "all"],
)
def test_other_losses_are_not_said_to_be_by_turns(kept: Numbers) -> None:
    assert not any(thin(kept))


@pytest.mark.parametrize("after", [1, 3])
def test_what_is_said_of_the_first_samples_is_not_said_of_all(after: int) -> None:
    """A session may begin with every second sample, and go on with all, or with every third."""
    said = thin(np.concatenate([np.arange(0, 4000, 2), np.arange(4000, 16_000, after)]))
    assert any(said[:2000])
    assert "1 of 2" not in said[-1]
