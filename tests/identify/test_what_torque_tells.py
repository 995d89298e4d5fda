"""A torque's sensor that is not linear, and a coupling that bends: parameters are wrong, and the torque itself tells it."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]
Excitation = Literal["multisine", "random", "chirp"]
Pattern = Literal["slider", "constant"]
EXCITATIONS: tuple[Excitation, ...] = ("multisine", "random", "chirp")
BITS = (10, 12, 14, 16)

RATE = 1000.0
LEFT = 0.002
"""Of the inertia, whose standard error is a tenth of it: what may be wrong where the torque was corrected."""
ABOUT = 0.1
"""Of a resonance five times as high as the motion: what its fourth derivative and others leave of it."""

NOT_LINEAR, BENDS = (
    "the sensor of the torque seems not to be linear",
    "than that of one rigid mass, as where a coupling bends",
)


def rig(seed: int, excitation: Excitation, pattern: Pattern) -> tvident.Recording:
    return tvident.simulate_torsional_rig(
        seed=seed, excitation=excitation, pattern=pattern, torque_snr_db=40.0, angle_noise=1e-3
    )


def identified(
    recording: tvident.Recording, torque: Array, pattern: Pattern, angle: Array | None = None
) -> tvident.Identification:
    kind = "constant" if pattern == "constant" else "windowed"
    return tvident.identify(recording.angle if angle is None else angle, torque, sample_rate=RATE, stiffness=kind)


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [0, *long(1, 2, 3)])
@pytest.mark.parametrize("excitation", ["multisine", "random"])
@pytest.mark.parametrize(
    ("pattern", "power", "part"),
    [("slider", 3, 0.02), ("slider", 3, -0.02), ("slider", 2, 0.02), ("constant", 2, 0.02)],
)
def test_a_sensor_that_is_not_linear_is_told_with_what_corrects_it(
    seed: int, pattern: Pattern, excitation: Excitation, power: int, part: float
) -> None:
    recording = rig(seed, excitation, pattern)
    factor = part / np.max(np.abs(recording.torque)) ** (power - 1)
    shown = recording.torque + factor * recording.torque**power
    result = identified(recording, shown, pattern)
    assert result.record_status & Status.CHANNEL_SUSPECTED
    (words,) = (line for line in result.advice if line.startswith(NOT_LINEAR))
    assert f"torque^{power} times" in words
    found = float(words.partition(" give torque - ")[2].partition(" ")[0])
    corrected = identified(recording, shown - found * shown**power, pattern)
    assert not corrected.record_status & Status.CHANNEL_SUSPECTED
    truth = float(np.mean(recording.inertia))
    assert abs(corrected.value("inertia").value / truth - 1) < LEFT


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [10, *long(*range(11, 20))])
@pytest.mark.parametrize("pattern", ["slider", "constant"])
@pytest.mark.parametrize("excitation", ["multisine", "random", "chirp"])
@pytest.mark.parametrize("noise", [0.01, 0.3])
def test_nothing_is_told_of_a_sensor_that_is_linear(
    seed: int, pattern: Pattern, excitation: Excitation, noise: float
) -> None:
    recording = tvident.simulate_torsional_rig(
        seed=seed, excitation=excitation, pattern=pattern, torque_snr_db=-20 * np.log10(noise), angle_noise=1e-3
    )
    result = identified(recording, recording.torque, pattern)
    assert not result.record_status & (Status.CHANNEL_SUSPECTED | Status.TERM_SUSPECTED)
    assert not any(NOT_LINEAR in line or BENDS in line for line in result.advice)


@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [30, *long(*range(31, 36))])
@pytest.mark.parametrize("offset", [5.0, *long(3.0, 20.0, 100.0)])
def test_a_load_makes_no_sensor_that_is_not_linear(seed: int, offset: float) -> None:
    """Squares of a torque with a large mean are the torque itself, mostly: half of these sensors seemed not to be linear."""
    recording = rig(seed, "multisine", "slider")
    loaded = recording.torque + offset * np.std(recording.torque)
    result = identified(recording, loaded, "slider")
    assert not any(NOT_LINEAR in line for line in result.advice)


@pytest.mark.parametrize(("seeds", "least"), [(range(30, 32), 1), *long((range(30, 42), 8))])
def test_a_sensor_that_is_not_linear_is_told_beside_a_load(seeds: range, least: int) -> None:
    """None was: nearly all of the square is the torque itself. With this load in two of three."""
    told = 0
    for seed in seeds:
        recording = rig(seed, "multisine", "slider")
        loaded = recording.torque + 3 * np.std(recording.torque)
        shown = loaded + 0.02 / np.std(recording.torque) * loaded**2
        lines = identified(recording, shown, "slider").advice
        told += any(f"{NOT_LINEAR}: it adds torque^2 times" in line for line in lines)
    assert told >= least


INERTIA, DAMPING, STIFFNESS = 0.0123, 0.05, 13.0


def coupled(seed: int, resonance: float, *, behind: bool) -> tuple[Array, Array, float]:
    """Return the angle before or behind a coupling that bends, the torque before it, and where both masses resonate, Hz."""
    generator = np.random.default_rng(seed)
    time = np.arange(20_000) / RATE
    load = 0.4 * INERTIA
    motor = INERTIA - load
    coupling = motor * load / INERTIA * (2 * np.pi * resonance) ** 2
    frequencies = np.linspace(0.5, 12.0, 47)
    s = 2j * np.pi * frequencies
    of_load = load * s**2 + DAMPING * s + STIFFNESS
    # The load's angle over the motor's, and the torque over that.
    passed = coupling / (coupling + of_load)
    angle = (passed if behind else 1) / (motor * s**2 + of_load * passed)
    waves = 0.05 * np.exp(1j * generator.uniform(0, 2 * np.pi, 47) + s * time[:, np.newaxis])
    channels = [(waves @ angle).real, np.sum(waves, axis=1).real]
    angles, torques = (
        channel + noise * np.std(channel) * generator.standard_normal(time.size)
        for channel, noise in zip(channels, (1e-3, 1e-2), strict=True)
    )
    return angles, torques, resonance


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [0, *long(1, 2, 3)])
@pytest.mark.parametrize("stiffness", ["constant", "windowed"])
@pytest.mark.parametrize("behind", [True, False])
def test_a_coupling_that_bends_is_told(seed: int, stiffness: Literal["windowed", "constant"], behind: bool) -> None:
    angle, torque, resonance = coupled(seed, 60.0, behind=behind)
    result = tvident.identify(angle, torque, sample_rate=RATE, stiffness=stiffness)
    assert result.record_status & Status.TERM_SUSPECTED
    (words,) = (line for line in result.advice if BENDS in line)
    assert ("larger" if behind else "smaller") in words
    if behind:
        told = float(words.partition("resonates near ")[2].partition(" ")[0])
        assert abs(told / resonance - 1) < ABOUT


def test_a_torque_that_comes_late_is_no_coupling_that_bends() -> None:
    """Its lag's square is a part of the second derivative, too."""
    recording = rig(5, "multisine", "constant")
    result = tvident.identify(recording.angle[3:], recording.torque[:-3], sample_rate=RATE, stiffness="constant")
    assert result.record_status & Status.LAG_SUSPECTED
    assert not any(BENDS in line for line in result.advice)


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("seed", "excitation", "bits"),
    [
        (0, "random", 16),
        (1, "multisine", 14),
        (0, "chirp", 12),
        *long(*((s, e, b) for s in (2, 3) for e in EXCITATIONS for b in BITS)),
    ],
)
def test_a_rounded_angle_beside_a_torque_without_noise_is_no_coupling(
    seed: int, excitation: Excitation, bits: int
) -> None:
    """Narrow test functions were told of a coupling at 36 to 195 Hz: what a stiffness leaves that bends within its windows."""
    recording = tvident.simulate_torsional_rig(
        seed=seed, excitation=excitation, pattern="slider", torque_snr_db=200.0, angle_noise=0.0
    )
    step = 2 * np.max(np.abs(recording.angle)) / 2**bits
    result = identified(recording, np.asarray(recording.torque), "slider", np.round(recording.angle / step) * step)
    assert not any(NOT_LINEAR in line or BENDS in line for line in result.advice)
