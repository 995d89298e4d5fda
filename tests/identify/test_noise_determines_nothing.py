"""Where the torque is noise, or the angle, nothing is determined, and a free decay determines all but a factor."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import fftconvolve

import tvident
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]

RATE = 1000.0
SAMPLES = 12_000
INERTIA, DAMPING, STIFFNESS = 0.0123, 0.008, 13.0
CLOSE = 4.5
"""An estimate may lie so many of its standard errors from the truth: one of 10^5 lies farther by chance."""


def noise(seed: int) -> Array:
    return np.random.default_rng(seed).standard_normal(SAMPLES)


def decay() -> Array:
    """Return the angle of a mass on a spring that was released at 0.3 rad: the solution of the equation without a torque."""
    t = np.arange(SAMPLES) / RATE
    rate = -DAMPING / (2 * INERTIA) + 1j * np.sqrt(STIFFNESS / INERTIA - (DAMPING / (2 * INERTIA)) ** 2)
    return np.asarray(0.3 * np.real(np.exp(rate * t)) + 3e-4 * noise(1))


def drift() -> Array:
    """Return noise whose neighbours are correlated, as a torque sensor's drift is."""
    return np.convolve(noise(4), 0.95 ** np.arange(200))[:SAMPLES]


def moved() -> Array:
    return tvident.simulate_torsional_rig(12.0).angle


RECORDS: dict[str, tuple[Array, Array]] = {
    "free decay": (decay(), 0.01 * noise(2)),
    "free decay, offset of the sensor": (decay(), 0.01 * noise(2) + 0.5),
    "free decay, drift": (decay(), 0.01 * drift()),
    "free decay, no torque at all": (decay(), np.zeros(SAMPLES)),
    "both are noise": (0.1 * noise(1), noise(2)),
    "the angle is noise": (0.01 * noise(1), tvident.simulate_torsional_rig(12.0).torque),
    "the torque is noise": (moved(), 0.2 * noise(2)),
    "the torque is zero": (moved(), np.zeros(SAMPLES)),
    "the torque is constant": (moved(), np.full(SAMPLES, 0.7)),
}
CALLS: dict[str, dict[str, Any]] = {
    "auto": {},
    "constants": {"inertia": "constant", "damping": "constant", "stiffness": "constant"},
    "varying": {"inertia": "varying"},
    "offset windowed": {"terms": [("offset", "windowed")]},
    "one window": {"method": tvident.WeakForm(averaging=False)},
}


@pytest.mark.first(1)
@pytest.mark.parametrize("call", [*(one for one in CALLS if one != "varying"), *long("varying")])
@pytest.mark.parametrize("record", RECORDS)
def test_no_number_comes_from_noise(record: str, call: str) -> None:
    angle, torque = RECORDS[record]
    result = tvident.identify(angle, torque, sample_rate=RATE, **CALLS[call])
    assert (result.status & Status.INVALID != 0).all()
    assert result.record_status & Status.RANK_DEFICIENT
    for name in ("inertia", "damping", "stiffness"):
        assert np.isnan(getattr(result, name)).all(), name
    assert np.isnan([value for value, _ in result.constants.values()]).all()
    assert "explains no more of the torque than chance" in result.summary()
    assert "inertia=1" in result.summary()


@pytest.mark.parametrize("torque_noise", [0.0, 0.01])
@pytest.mark.parametrize(("known", "value"), [("inertia", INERTIA), ("stiffness", STIFFNESS), ("inertia", 1.0)])
def test_a_free_decay_and_one_parameter_give_the_others(known: str, value: float, torque_noise: float) -> None:
    kinds: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant", known: value}
    result = tvident.identify(decay(), torque_noise * noise(2), sample_rate=RATE, **kinds)
    assert result.record_status & (Status.RANK_DEFICIENT | Status.ILL_CONDITIONED) == 0
    scale = value / {"inertia": INERTIA, "stiffness": STIFFNESS}[known]
    truth = {"inertia": scale * INERTIA, "damping": scale * DAMPING, "stiffness": scale * STIFFNESS}
    for name in truth.keys() - {known}:
        estimate, error = result.constants[name]
        assert abs(estimate - truth[name]) < CLOSE * error, name
    frequency = np.sqrt(STIFFNESS / INERTIA) / (2 * np.pi)
    damping_ratio = DAMPING / (2 * np.sqrt(STIFFNESS * INERTIA))
    for found, name, expected in (
        (result.natural_frequency, "natural_frequency", frequency),
        (result.damping_ratio, "damping_ratio", damping_ratio),
    ):
        error = result.stderr[name][SAMPLES // 2]
        assert 0.0 < error < 0.01 * expected, name
        assert abs(found[SAMPLES // 2] - expected) < CLOSE * error, name


def multisine(seed: int) -> tuple[Array, Array, Array]:
    """Return a motion and its first two derivatives."""
    t, phases = np.arange(SAMPLES) / RATE, np.random.default_rng(seed).uniform(0, 6, 30)
    waves = [0.01 * np.exp(1j * (2 * np.pi * f * t + p)) for f, p in zip(np.linspace(0.5, 12, 30), phases, strict=True)]
    rates = [2 * np.pi * f for f in np.linspace(0.5, 12, 30)]
    parts = [
        np.asarray(np.real(sum((1j * r) ** k * wave for r, wave in zip(rates, waves, strict=True)))) for k in range(3)
    ]
    return parts[0], parts[1], parts[2]


@pytest.mark.parametrize(
    "truth", [(INERTIA, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, STIFFNESS), (INERTIA, DAMPING, STIFFNESS)]
)
@pytest.mark.parametrize("torque_noise", [0.1, 3.0])
def test_what_the_torque_shows_is_determined(truth: tuple[float, float, float], torque_noise: float) -> None:
    angle, velocity, acceleration = multisine(0)
    torque = truth[0] * acceleration + truth[1] * velocity + truth[2] * angle
    torque = torque + torque_noise * torque.std() * noise(3)
    result = tvident.identify(angle + 1e-3 * angle.std() * noise(4), torque, sample_rate=RATE, stiffness="constant")
    assert result.record_status & (Status.RANK_DEFICIENT | Status.ILL_CONDITIONED) == 0
    for name, expected in zip(("inertia", "damping", "stiffness"), truth, strict=True):
        estimate, error = result.constants[name]
        assert abs(estimate - expected) < CLOSE * error, name


def test_one_blow_is_enough() -> None:
    """The torque is noise in all but a tenth of a second."""
    angle, torque = decay(), 0.003 * noise(2)
    t = np.arange(SAMPLES) / RATE
    # A push of 10 ms about 2 s: what comes after it is a decay of its own.
    push = np.exp(-(((t - 2.0) / 0.01) ** 2))
    rate = -DAMPING / (2 * INERTIA) + 1j * np.sqrt(STIFFNESS / INERTIA - (DAMPING / (2 * INERTIA)) ** 2)
    response = np.imag(np.exp(rate * t)) / (rate.imag * INERTIA * RATE)
    angle = angle + 5.0 * fftconvolve(push, response)[:SAMPLES]
    result = tvident.identify(angle, torque + 5.0 * push, sample_rate=RATE)
    assert result.record_status & (Status.RANK_DEFICIENT | Status.ILL_CONDITIONED) == 0
    value, error = result.constants["inertia"]
    assert abs(value - INERTIA) < CLOSE * error
    assert abs(value - INERTIA) < 0.01 * INERTIA


@pytest.mark.parametrize("method", ["auto", "paper"])
@pytest.mark.parametrize(
    ("empty", "said"),
    [
        (("angle",), "the angle holds no numbers: all 3000 samples are missing; was another channel meant"),
        (("torque",), "the torque holds no numbers: all 3000 samples are missing; was another channel meant"),
        (("angle", "torque"), "the angle and the torque hold no numbers: all 3000 samples are missing"),
        ((), "no sample has both the angle and the torque"),
    ],
)
def test_a_channel_without_numbers_is_named(method: Any, empty: tuple[str, ...], said: str) -> None:
    rig = tvident.simulate_torsional_rig(3.0)
    channels: dict[str, Any] = {"angle": rig.angle.copy(), "torque": rig.torque.copy()}
    for name in empty:
        channels[name][:] = np.nan
    if not empty:
        channels["angle"][:1600], channels["torque"][1400:] = np.nan, np.nan
    found = tvident.identify(**channels, sample_rate=RATE, method=method)
    assert found.advice[0].startswith(said)
    both: dict[str, Any] = {name: np.stack([getattr(rig, name), values]) for name, values in channels.items()}
    batch = tvident.identify(**both, sample_rate=RATE, method=method)
    assert any(line.startswith(f"record 1: {said}") for line in batch.advice)
    assert said in batch[1].advice[0]
