"""What a live clock says of losses, of rates, and of stamps that are wrong: scenario by scenario against the truth."""

from __future__ import annotations

import math
import os
import time

import numpy as np
import numpy.typing as npt
import pytest

from tvident._live import Inlet, LiveClock

COUNT = 12_000
Numbers = npt.NDArray[np.int_]
Stamps = npt.NDArray[np.float64]


def clocked(stamps: Stamps, kept: Numbers) -> tuple[LiveClock, npt.NDArray[np.float64]]:
    """Give a 1 kHz clock that saw samples of these numbers, and the numbers that came out: NaN for lost ones."""
    clock = LiveClock(1e-3)
    both = zip(stamps.tolist(), kept.tolist(), strict=True)
    rows = [row for stamp, number in both for row in clock.rows((stamp, float(number), 0.0))]
    return clock, np.array([row[1] for row in [*rows, *clock.rest()]])


def without(*lost: tuple[int, int]) -> Numbers:
    """Give the numbers of all samples but those."""
    return np.delete(np.arange(COUNT), np.concatenate([np.arange(*one) for one in lost] or [np.arange(0)]))


def sent(kept: Numbers, block: int, late: float, rate: float = 1000.0) -> Stamps:
    """Give stamps as ``push_chunk`` of the Lab Streaming Layer makes them: counted back at 1 kHz from when a buffer was sent."""
    generator = np.random.default_rng(1)
    stamps = np.empty(kept.size)
    for first in range(0, kept.size, block):
        some = slice(first, min(first + block, kept.size))
        place = np.arange(some.stop - some.start)
        stamps[some] = kept[some.stop - 1] / rate + generator.exponential(late) - (place[-1] - place) * 1e-3
    return stamps


def unplaced(block: int, late: float) -> int:
    """Return samples of a loss whose place no stamp tells: in 1 of 100 cases so many buffers in a row are later than a period."""
    return block * max(1, math.ceil(math.log(100) * late / 1e-3))


def misplaced(numbers: npt.NDArray[np.float64]) -> int:
    """Return how many samples are not at their places."""
    there = np.flatnonzero(~np.isnan(numbers))
    return int(np.count_nonzero(there != numbers[there]))


@pytest.mark.parametrize("block", [4, 20, 32, 64])
@pytest.mark.parametrize("late", [1e-4, 1e-3, 3e-3])
def test_a_buffer_that_was_lost_is_counted_to_the_sample(block: int, late: float) -> None:
    """Lateness was followed in its mean, and the least late of 16 compared with it: 63 of 64, and the other one was drift."""
    first = COUNT // 2 // block * block
    for lost in (block, 64):
        kept = without((first, first + lost))
        clock, numbers = clocked(sent(kept, block, late), kept)
        assert (clock.lost, clock.repeated, clock.jumps) == (lost, 0, 0)
        # Where samples of one buffer are from before and after the loss, no stamp says which.
        assert misplaced(numbers) <= unplaced(block, late)
        assert abs(clock.rate.period * 1e3 - 1) < 4 * clock.rate.error * 1e3
    clock, numbers = clocked(sent(without(), block, late), without())
    assert (clock.lost, clock.repeated, misplaced(numbers)) == (0, 0, 0)


@pytest.mark.parametrize(("block", "late"), [(4, 1e-3), (4, 3e-3), (20, 1e-3), (32, 1e-3)])
def test_a_single_lost_sample_is_no_drift(block: int, late: float) -> None:
    """It was less than the lateness of buffers: none was lost, and the clock drifted by 70 ± 3 ppm."""
    kept = without((COUNT // 2, COUNT // 2 + 1))
    clock, numbers = clocked(sent(kept, block, late), kept)
    assert (clock.lost, clock.repeated) == (1, 0)
    assert abs(clock.rate.period * 1e3 - 1) < 4 * clock.rate.error * 1e3
    # The buffer that it was lost in is left out.
    assert misplaced(numbers) <= unplaced(block, late)
    assert clock.unsure == pytest.approx(block, abs=1)
    assert f"{clock.unsure} samples of buffers before which samples were lost are left out" in "\n".join(clock.words())


@pytest.mark.parametrize("rate", [950.0, 990.0, 995.0, 1010.0, 1050.0, 1090.0])
@pytest.mark.parametrize("block", [1, 32])
def test_another_rate_is_no_loss(rate: float, block: int) -> None:
    """Of 20 000 samples of 990 Hz 188 were lost, and the drift was -640 ppm; of 1050 Hz 922 came twice."""
    clock, _ = clocked(sent(without(), block, 2e-4 if block > 1 else 2e-5, rate), without())
    assert clock.lost + clock.repeated <= 2
    assert 1 / clock.rate.period == pytest.approx(rate, rel=2e-5)
    assert clock.warning == clock.differs
    assert "the rate differs by" in clock.differs
    kept = without((7000, 7064))
    clock, _ = clocked(sent(kept, 1, 2e-5, rate), kept)
    assert clock.lost == 64


@pytest.mark.parametrize("rate", [850.0, 880.0, 1150.0, 1300.0])
@pytest.mark.parametrize("block", [1, 32])
def test_a_rate_that_is_a_mistake_is_said_with_the_rate_to_give(rate: float, block: int) -> None:
    """Of a rate that is 12 % too low only losses were told: 2517 that were none."""
    clock, _ = clocked(sent(without(), block, 2e-4 if block > 1 else 2e-5, rate), without())
    found = float(clock.warning.rpartition("--sample-rate ")[2])
    assert found == pytest.approx(rate, rel=2e-3)
    assert ("lost samples: not known" in "\n".join(clock.words())) == (rate < 1000)


@pytest.mark.parametrize("wrong", [-1.0, 1.0, -0.05, -7.0])
@pytest.mark.parametrize("count", [1, 3])
def test_stamps_that_are_wrong_for_a_moment_lose_nothing(wrong: float, count: int) -> None:
    """A stamp of 0 within a record was a clock that was set, and 7000 samples were lost behind it."""
    stamps = np.arange(COUNT) * 1e-3 + np.random.default_rng(2).exponential(5e-5, COUNT)
    stamps[7000 : 7000 + count] += wrong
    clock, numbers = clocked(stamps, np.arange(COUNT))
    assert (clock.lost, clock.repeated) == (0, 0)
    assert np.array_equal(numbers[~np.isnan(numbers)], np.arange(COUNT))
    assert np.isnan(numbers).sum() == clock.jumps <= 2


def test_samples_without_a_stamp_have_that_of_their_place() -> None:
    """Beside stamps of 1e5 s such a sample was given with 3 s."""
    clock = LiveClock(1e-3)
    rows = [row for k in range(4000) for row in clock.rows((math.nan if k == 3000 else 1e5 + k / 1000, 1.0, 2.0))]
    assert np.allclose([row[0] for row in rows], 1e5 + np.arange(len(rows)) / 1000, rtol=0, atol=1e-6)


def test_losses_that_nothing_can_show_are_not_said_to_be_none() -> None:
    """Of lines without times and numbers "lost samples: 0" was said."""
    clock = LiveClock(1e-3)
    for number in range(300):
        clock.rows((math.nan, float(number), 0.0))
    assert "lost samples: not known, since samples have neither stamps nor numbers" in "\n".join(clock.words())


@pytest.mark.slow
def test_a_buffer_that_an_outlet_without_stamps_of_its_own_loses() -> None:
    """With 64 of 1 kHz lost within a buffer of 20, samples from before were at places behind it: *K* of 15 was 16.2, without a word."""
    pylsl = pytest.importorskip("pylsl")
    name = f"tvident-losses-{os.getpid()}"
    outlet = pylsl.StreamOutlet(pylsl.StreamInfo(name, "Rig", 2, 1000.0, pylsl.cf_double64, name))
    inlet = Inlet(name, ["0", "1"])
    while not outlet.have_consumers():
        time.sleep(0.02)
    kept = np.delete(np.arange(3000), np.arange(1510, 1574))
    begin = pylsl.local_clock() + 0.2
    for first in range(0, kept.size, 20):
        some = kept[first : first + 20].astype(float)
        time.sleep(max(0.0, begin + some[-1] / 1000 - pylsl.local_clock()))
        outlet.push_chunk(np.column_stack([some, some]).tolist())
    clock, rows = LiveClock(1e-3), []
    pieces = inlet.pieces(0.05)
    while inlet.read < kept.size:
        rows += [row for stamp, angle, torque in next(pieces) for row in clock.rows((stamp, angle, torque))]
    numbers = np.array([row[1] for row in [*rows, *clock.rest()]])
    # A busy machine holds senders up by periods.
    assert clock.lost - clock.repeated == pytest.approx(64, abs=2)
    there = np.flatnonzero(~np.isnan(numbers))
    assert np.abs(there - numbers[there]).max() <= 2
