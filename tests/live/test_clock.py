"""The clock of a live recording: what was lost, came twice, or comes at another rate."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest

from tvident._live import LiveClock


def clocked(stamps: Sequence[float], period: float = 1e-3) -> tuple[LiveClock, list[float]]:
    """Give a clock that saw these stamps, and which samples came out: NaN for lost ones."""
    clock = LiveClock(period)
    rows = [row for number, stamp in enumerate(stamps) for row in clock.rows((stamp, float(number), 0.0))]
    return clock, [row[1] for row in [*rows, *clock.rest()]]


def test_losses_are_found_where_they_are_and_jitter_is_none() -> None:
    generator = np.random.default_rng(1)
    stamps = np.arange(20_000) * 1e-3 * (1 + 80e-6) + 7.0
    jittered = stamps + 0.2e-3 * generator.uniform(-1, 1, stamps.size)
    held = jittered.copy()
    held[5000:5006] = held[5006]  # a driver that gives six at once
    clock, numbers = clocked(held.tolist())
    assert (clock.lost, len(numbers)) == (0, 20_000)
    assert clock.rate.period == pytest.approx(1e-3 * (1 + 80e-6), abs=5 * clock.rate.error)
    assert clock.rate.error < 1e-8
    gone = np.delete(jittered, [*range(3000, 3004), 12_000])
    clock, numbers = clocked(gone.tolist())
    assert clock.lost == 5
    lost = np.flatnonzero(np.isnan(numbers))
    assert np.array_equal(lost, [3000, 3001, 3002, 3003, 12_000])
    assert clock.rate.period == pytest.approx(1e-3 * (1 + 80e-6), abs=5 * clock.rate.error)
    assert re.search(r"drift -(79|80)\.", "\n".join(clock.words()))


def test_samples_that_came_twice_and_clocks_that_were_set_keep_windows_apart() -> None:
    stamps = np.arange(6000) * 1e-3 + 7.0
    twice = np.insert(stamps, 3000, stamps[2990:3000])
    set_back, set_forward = (stamps + np.where(np.arange(6000) < 3000, 0.0, by) for by in (-50.0, 5000.0))
    faster = np.r_[stamps[:3000], stamps[3000] + np.arange(3000) * 5e-4]
    for given, repeated, jumps, said in (
        (twice, 10, 0, "10 samples more came"),
        (set_back, 0, 1, "jumped 1 times"),
        (set_forward, 0, 1, "jumped 1 times"),
    ):
        clock, numbers = clocked(given.tolist())
        assert (clock.lost, clock.repeated, clock.jumps) == (0, repeated, jumps)
        assert np.array_equal(np.flatnonzero(np.isnan(numbers)), [3000])
        assert said in "\n".join(clock.words())
        assert clock.rate.period == pytest.approx(1e-3, rel=1e-9)
    clock, numbers = clocked(faster.tolist())
    assert clock.repeated == pytest.approx(1500, abs=2)
    # No window of more than three samples holds none that is missing.
    assert np.diff(np.flatnonzero(np.isnan(numbers))).max() <= 3
    # Samples of one buffer have one stamp, and come out as they came.
    for place in (0, 31):
        clock, numbers = clocked(np.repeat(stamps[place::32], 32)[:5900].tolist())
        assert (clock.lost, clock.repeated, len(numbers)) == (0, 0, 5900)
    clock, _ = clocked([*stamps[:3000], stamps[3001], stamps[3000], *stamps[3002:]])
    assert "1 stamps are before the one that came last" in "\n".join(clock.words())
    clock, _ = clocked((1000 * stamps[:100]).tolist())
    assert "say their unit" in "\n".join(clock.words())


def test_samples_without_a_stamp_keep_their_places() -> None:
    stamps = np.delete(np.arange(6000) * 1e-3 + 7.0, slice(3020, 3030))
    stamps[3001:3040] = np.nan
    stamps[3045] = np.nan
    _, numbers = clocked(stamps.tolist())
    there = np.array(numbers)[~np.isnan(numbers)]
    assert np.array_equal(there, np.arange(5990))


def test_counters_that_begin_anew_repeat_or_overtake() -> None:
    numbers, stamps = np.arange(2000), np.arange(2000) * 1e-3

    def counted(order: npt.NDArray[np.int_], counter: npt.NDArray[np.int_]) -> tuple[LiveClock, list[float]]:
        clock = LiveClock(1e-3)
        rows = [
            row
            for number, count in zip(order.tolist(), counter.tolist(), strict=True)
            for row in clock.rows((float(stamps[number]), float(number), 0.0), float(count))
        ]
        return clock, [row[1] for row in rows]

    # Eight bits: 253 to 257 are lost where the counter begins anew.
    some = np.delete(numbers, slice(253, 258))
    clock, found = counted(some, some % 256)
    assert (clock.lost, clock.jumps, len(found)) == (5, 0, 2000)
    assert np.array_equal(np.flatnonzero(np.isnan(found)), np.arange(253, 258))
    # One came twice, and one too late for its place.
    order = np.r_[numbers[:900], 899, numbers[900:1000], 1001, 1000, numbers[1002:]]
    clock, found = counted(order, order)
    assert (clock.lost, clock.repeated, clock.jumps, len(found)) == (1, 2, 0, 2000)
    assert np.array_equal(np.flatnonzero(np.isnan(found)), [1000])
    assert np.array_equal(np.delete(found, 1000), np.delete(numbers, 1000))


def test_a_rate_that_is_not_the_nominal_one_is_said() -> None:
    clock, _ = clocked((np.arange(5000) / 990).tolist())
    assert "give --sample-rate 990" in "\n".join(clock.words())


def test_few_losses_by_a_counter_alone_are_no_wrong_rate() -> None:
    clock = LiveClock(0.001)
    for number in (count for count in range(1000) if count % 100):
        clock.rows((math.nan, 1.0, 2.0), number)
    assert clock.lost == 9
    assert not any("more samples are missing" in said for said in clock.words())


def test_stamps_of_another_rate_are_said_at_once() -> None:
    clock, _ = clocked((np.arange(400) / 1000).tolist(), period=1 / 500)
    words = "stamps show 1000 Hz, not 500: parameters are wrong; give --sample-rate 1000"
    assert words in clock.comes_faster
    assert words in clock.words()[0]
    twice, _ = clocked(np.repeat(np.arange(2000) / 1000, np.where(np.arange(2000) % 10, 1, 2)).tolist())
    assert not twice.comes_faster


@pytest.mark.parametrize("every", [1, 5])
def test_lines_that_come_twice_are_no_higher_rate(every: int) -> None:
    """Where every line came twice, `--sample-rate 2001.022` was to be given."""
    numbers = np.arange(4000)
    order = np.repeat(numbers, np.where(numbers % every, 1, 2)).tolist()
    clock, counted = LiveClock(1e-3), LiveClock(1e-3)
    for number in order:
        row = (number * 1e-3, math.sin(number), math.nan)
        clock.rows(row)
        counted.rows(row, float(number))
        assert not clock.comes_faster
        assert not counted.comes_faster
    assert clock.twice == pytest.approx(4000 / every, abs=1)
    assert clock.repeated == 0
    assert counted.repeated == 4000 / every
    assert "samples came twice, with the same stamp and the same values: left out" in "\n".join(clock.words())


def test_buffers_whose_samples_are_equal_are_counted_whole() -> None:
    clock = LiveClock(1 / 500)
    for number in range(2000):
        # At rest but for one sample of a buffer of eight.
        clock.rows((number // 8 * 8e-3, float(number % 8 == 7), 0.0))
    assert "give --sample-rate 100" in clock.comes_faster


def test_what_came_twice_before_the_clock_was_set_says_nothing_of_the_rate() -> None:
    """Two buffers of one stamp each look like a higher rate."""
    clock = LiveClock(1e-3)
    for number in range(4000):
        clock.rows((number // 2 * 1e-3, float(number), 0.0))
    assert clock.comes_faster
    for number in range(300):
        clock.rows((-100 + number // 150 * 0.15, float(number), 0.0))
        assert not clock.comes_faster
    assert clock.repeated > 1000


def test_buffers_at_rest_hold_samples_that_are_alike() -> None:
    clock = LiveClock(1e-3)
    came = [row for number in range(64) for row in clock.rows((number // 8 * 8e-3, 0.0, 0.0))]
    assert len([*came, *clock.rest()]) + clock.twice == 64
    assert (clock.lost, clock.repeated, clock.twice) == (0, 0, 7)
    # A clock that stands holds nothing back for ever.
    clock = LiveClock(1e-3)
    assert sum(len(clock.rows((1.0, 0.0, 0.0))) for _ in range(1000)) > 980


@pytest.mark.parametrize("rate", [1100.0, 1250.0, 1499.0])
@pytest.mark.parametrize("is_at_rest_first", [False, True])
def test_samples_at_rest_whose_stamps_have_few_digits_are_kept(rate: float, *, is_at_rest_first: bool) -> None:
    """Two samples within a millisecond have one stamp, and the next one comes 1.1 to 1.5 periods later."""
    count = 4000
    stamps = np.round(np.arange(count) / rate, 3)
    moves = np.arange(count) >= count // 2 if is_at_rest_first else np.arange(count) < count // 2
    values = np.where(moves, np.sin(np.arange(count)), 0.0)
    clock = LiveClock(1 / rate)
    rows = [row for stamp, value in zip(stamps, values, strict=True) for row in clock.rows((stamp, value, 0.0))]
    assert np.array_equal([row[1] for row in [*rows, *clock.rest()]], values)
    assert (clock.twice, clock.lost, clock.repeated) == (0, 0, 0)


@pytest.mark.parametrize("is_alike", [False, True])
@pytest.mark.parametrize(
    ("rate", "block", "late"), [(1000.0, 20, 1e-3), (1000.0, 50, 5e-3), (200.0, 32, 2e-3), (5000.0, 100, 1e-3)]
)
def test_buffers_that_a_driver_sends_late_lose_nothing(rate: float, block: int, late: float, *, is_alike: bool) -> None:
    """Chunks of 20 at 1 kHz that came 1 ms late or less lost 22 of 1000 samples, and stiffness was 14.87 where it is 15."""
    generator = np.random.default_rng(3)
    count = int(8 * rate)
    first = np.arange(count) // block * block
    sent = (first + block) / rate + generator.exponential(late, count)[first]
    back = -1e-6 if is_alike else 1 / rate
    stamps = sent - (first + block - 1 - np.arange(count)) * back
    clock, numbers = clocked(stamps.tolist(), 1 / rate)
    assert clock.lost + clock.repeated <= 3
    assert (clock.jumps, clock.twice) == (0, 0)
    there = np.array(numbers)[~np.isnan(numbers)]
    assert np.array_equal(there, np.arange(count))
    assert clock.rate.period == pytest.approx(1 / rate, rel=2e-3)
    # What is lost between buffers is found, to the part of a period that all of them are late.
    some = np.r_[: count // 2, count // 2 + 400 : count]
    clock, numbers = clocked(stamps[some].tolist(), 1 / rate)
    assert clock.lost - clock.repeated == pytest.approx(400, abs=2 + 3 * late * rate)
    assert np.abs(np.flatnonzero(np.isnan(numbers)) - count // 2).min() <= 2 * block


def test_a_first_buffer_that_was_late_is_no_repetition() -> None:
    stamps = np.arange(4000) * 1e-3
    stamps[:20] += 5e-3 - 1e-6
    clock, numbers = clocked(stamps.tolist())
    assert (clock.lost, clock.repeated, len(numbers)) == (0, 0, 4000)
