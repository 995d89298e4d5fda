"""Stamps that come in packets are told from samples that do."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import Status
from tvident._clocks.grid import grid_of
from tvident._clocks.packets import evened_packets

Array = npt.NDArray[np.float64]

COUNT, RATE = 10_000, 1000.0
INERTIA, DAMPING, STIFFNESS = 0.01, 0.05, 15.0


def stamped(size: int, apart: float) -> Array:
    """Return stamps of packets, each with a stamp that is right and others so many seconds apart."""
    number = np.arange(COUNT)
    return number // size * size / RATE + number % size * apart


def moved(time: Array, noise: float, seed: int = 0) -> tuple[Array, Array]:
    """Return angle and torque of a motion of several frequencies, with noise as large as a part of them."""
    generator = np.random.default_rng(seed)
    speeds = 2 * np.pi * np.array([0.7, 1.3, 3.1, 5.7, 9.0])
    angle, torque = np.zeros(time.size), np.zeros(time.size)
    for number, speed in enumerate(speeds):
        size, phase = 0.1 / (number + 1), speed * time + number
        angle += size * np.sin(phase)
        torque += size * ((STIFFNESS - INERTIA * speed**2) * np.sin(phase) + DAMPING * speed * np.cos(phase))
    both = (one + noise * one.std() * generator.standard_normal(time.size) for one in (angle, torque))
    return next(both), next(both)


def packets(*sizes: int) -> list[tuple[int, float]]:
    """Give packets of so many samples, and seconds between two; rare pauses that take nine tenths of the time are refused."""
    every = [(size, apart) for size in sizes for apart in (1e-5, 2e-4, 5e-4)]
    return [one for one in every if one != (200, 1e-5)]


@pytest.mark.parametrize(("size", "apart"), packets(4, 10, 50, 200))
def test_stamps_of_a_buffer_are_of_even_samples(size: int, apart: float) -> None:
    angle, torque = moved(np.arange(COUNT) / RATE, 1e-3)
    found = tvident.identify(angle, torque, t=stamped(size, apart))
    assert found.settings["times"] == "even"
    assert found.record_status & Status.CHANNEL_SUSPECTED
    assert any("as behind a buffer" in one and "sample_rate=" in one for one in found.advice)
    for name, true in (("inertia", INERTIA), ("damping", DAMPING), ("stiffness", STIFFNESS)):
        away = np.abs(getattr(found, name) - true) / found.stderr[name]
        assert np.median(away[found.trusted]) < 4
    assert np.mean(found.trusted) > 0.9


@pytest.mark.parametrize(("size", "apart"), packets(4, 16, 50, 200))
@pytest.mark.parametrize("noise", [1e-4, 1e-2, 0.3])
def test_samples_that_come_in_packets_stay_at_their_times(size: int, apart: float, noise: float) -> None:
    stamps = stamped(size, apart)
    angle, torque = moved(stamps, noise)
    assert evened_packets(grid_of(stamps), {"angle": angle, "torque": torque}) is None


def test_noise_alone_says_nothing_of_stamps() -> None:
    generator = np.random.default_rng(1)
    channels = {name: generator.standard_normal(COUNT) for name in ("angle", "torque")}
    assert evened_packets(grid_of(stamped(16, 2e-4)), channels) is None


def test_channels_that_contradict_each_other_are_not_taken_to_be_even() -> None:
    stamps = stamped(16, 2e-4)
    channels = {"angle": moved(np.arange(COUNT) / RATE, 1e-3)[0], "torque": moved(stamps, 1e-3)[1]}
    assert evened_packets(grid_of(stamps), channels) is None


def test_pauses_that_are_longer_than_others_are_gaps() -> None:
    stamps = stamped(16, 2e-4)
    stamps[COUNT // 2 :] += 0.5
    evened = evened_packets(grid_of(stamps), {"angle": moved(np.arange(COUNT) / RATE, 1e-3)[0]})
    assert evened is not None
    assert evened[0].numbers[-1] > COUNT + 100


@pytest.mark.parametrize("size", [4, 16, 50])
@pytest.mark.parametrize("apart", [1e-5, 2e-4])
def test_a_channel_behind_a_buffer_is_even_beside_another_clock(size: int, apart: float) -> None:
    ours, theirs = stamped(size, apart), np.arange(COUNT) / RATE
    angle, torque = moved(theirs, 1e-3)
    found = tvident.identify(angle, torque, t=(ours, theirs), align="offset")
    assert found.record_status & Status.CHANNEL_SUSPECTED
    assert any("stamps of the angle come in packets" in one for one in found.advice)
    for name, true in (("inertia", INERTIA), ("damping", DAMPING), ("stiffness", STIFFNESS)):
        away = np.abs(getattr(found, name) - true) / found.stderr[name]
        assert np.median(away[found.trusted]) < 4
    assert np.mean(found.trusted) > 0.9
    # Stamps are those of the first sample of each packet, which nobody knows: the middle is taken.
    assert abs(found.constants["clock_offset"][0]) < size / RATE / 2 + 1e-3


def test_without_an_alignment_a_buffer_beside_another_clock_says_what_to_do() -> None:
    ours, theirs = stamped(16, 1e-5), np.arange(COUNT) / RATE
    angle, torque = moved(theirs, 1e-3)
    found = tvident.identify(torque=torque, angle=angle, t=(ours, theirs))
    assert any("stamps of the angle come in packets" in one and "align='offset'" in one for one in found.advice)
    assert found.record_status & Status.CHANNEL_SUSPECTED


def test_packets_of_samples_stay_at_their_times_beside_another_clock() -> None:
    ours, theirs = stamped(16, 5e-4), np.arange(COUNT) / RATE
    angle, torque = moved(ours, 1e-3)[0], moved(theirs, 1e-3)[1]
    found = tvident.identify(angle, torque, t=(ours, theirs))
    assert not any("come in packets" in one for one in found.advice)


@pytest.mark.parametrize(("rests", "rate"), [(0.5, 200.0), (1.0, 500.0), (2.0, 100.0)])
def test_a_periodic_motion_that_is_recorded_in_bursts_stays_at_its_times(rests: float, rate: float) -> None:
    """Where rests are whole periods it goes on from one burst to the next as if there were none: inertia was four times the true one."""
    size = int(rests * rate)
    number = np.arange(40 * size)
    time = (number // size * 2 * size + number % size) / rate
    omega, noise = 2 * np.pi / rests, np.random.default_rng(0)
    angle = np.sin(omega * time) + 0.5 * np.sin(2 * omega * time + 1) + 0.3 * np.cos(3 * omega * time)
    velocity = np.cos(omega * time) + np.cos(2 * omega * time + 1) - 0.9 * np.sin(3 * omega * time)
    torque = 30 * angle + 0.4 * omega * velocity
    channels = {
        "angle": angle + 1e-3 * noise.standard_normal(time.size),
        "torque": torque + 0.05 * noise.standard_normal(time.size),
    }
    assert evened_packets(grid_of(time), channels) is None
