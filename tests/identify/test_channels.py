"""Velocity and acceleration beside the angle, or in its place."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import Status

Array = npt.NDArray[np.float64]

RATE = 500.0


class Record:
    """A rig, 10 s long, its channels with noise of a part of their root mean square."""

    def __init__(self, seed: int, *, angle: float, pattern: Literal["constant", "slider"] = "constant") -> None:
        self.rig = tvident.simulate_torsional_rig(duration=10, sample_rate=RATE, seed=seed, pattern=pattern)
        self._noise = np.random.default_rng(seed)
        self.angle = self.noisy(self.rig.true_angle, angle)
        self.torque = self.noisy(self.rig.true_torque, 0.003)

    def noisy(self, channel: Array, part: float) -> Array:
        """Return a channel with noise."""
        return np.asarray(channel + part * channel.std() * self._noise.standard_normal(channel.size))

    def velocity(self, part: float, bias: float = 0.1) -> Array:
        """Return what a gyroscope would record."""
        return self.noisy(self.rig.true_velocity, part) + bias

    def acceleration(self, part: float, bias: float = 0.5) -> Array:
        """Return what an accelerometer would record."""
        return self.noisy(self.rig.true_acceleration, part) + bias

    def identify(self, angle: Array | None, **options: Any) -> tvident.Identification:
        """Identify with one stiffness."""
        return tvident.identify(angle, self.torque, sample_rate=RATE, **({"stiffness": "constant"} | options))

    @property
    def truth(self) -> dict[str, float]:
        """Inertia, damping and stiffness."""
        rig = self.rig
        return {"inertia": rig.inertia[0], "damping": rig.damping[0], "stiffness": rig.stiffness[0]}


@pytest.mark.slow
def test_a_gyroscope_beside_a_noisy_angle_makes_errors_smaller_and_they_hold() -> None:
    z: dict[str, list[float]] = {"parameters": [], "biases": []}
    inside, smaller = [], []
    for seed in range(6):
        record = Record(seed, angle=0.1, pattern="slider")
        beside = {"velocity": record.velocity(0.01), "acceleration": record.acceleration(0.1)}
        alone = record.identify(record.angle, stiffness="windowed")
        found = record.identify(record.angle, stiffness="windowed", **beside)
        wrong = found.stiffness - record.rig.stiffness
        inside.append(np.mean(np.abs(wrong) < 1.96 * found.stderr["stiffness"]))
        smaller.append(np.sqrt(np.mean(wrong**2) / np.mean((alone.stiffness - record.rig.stiffness) ** 2)))
        for name in ("inertia", "damping"):
            z["parameters"].append((found.constants[name][0] - record.truth[name]) / found.constants[name][1])
        for name, truth in (("velocity_bias", 0.1), ("acceleration_bias", 0.5)):
            z["biases"].append((found.constants[name][0] - truth) / found.constants[name][1])
    # Twelve numbers of variance one have a root mean square of 1 ± 0.2, and that of three standard deviations more is a chance of 1e-3.
    assert all(np.sqrt(np.mean(np.square(one))) < 1.6 for one in z.values())
    # Stiffness has some thirty independent values a record: their mean coverage scatters by 1.6 %.
    assert 0.89 < np.mean(inside) < 0.99
    # The angle's noise is ten times that of the velocity where the rig moves; stiffness changes within windows, too.
    assert np.median(smaller) < 0.7


@pytest.mark.slow
def test_a_velocity_without_an_angle_tells_the_same() -> None:
    z, biases = [], []
    for seed in range(8):
        record = Record(seed, angle=0.0)
        found = record.identify(None, velocity=record.velocity(0.01))
        z += [(found.constants[name][0] - truth) / found.constants[name][1] for name, truth in record.truth.items()]
        value, error = found.constants["velocity_bias"]
        biases.append((value - 0.1) / error)
        assert Status.SCALES_DISAGREE not in found.record_status
    assert np.sqrt(np.mean(np.square(z))) < 1.6
    assert np.sqrt(np.mean(np.square(biases))) < 2


@pytest.mark.parametrize(("name", "unit"), [("velocity", "rad/s"), ("acceleration", "rad/s^2")])
def test_noise_is_that_of_the_channel_that_was_recorded(name: str, unit: str) -> None:
    """It was said to be the angle's, in rad."""
    record = Record(17031, angle=0.01)
    given = record.velocity(0.01) if name == "velocity" else record.acceleration(0.01)
    reason = record.identify(None, **{name: given}).reasons[0]
    assert f" {unit} in the {name}, " in reason
    linear = record.identify(None, **{name: given}, torque_unit="N").reasons[0]
    assert f" {unit.replace('rad', 'm')} in the {name}, " in linear
    assert " rad in the angle, " in record.identify(record.angle, velocity=record.velocity(0.01)).reasons[0]


def test_an_accelerometer_in_g_and_a_speed_in_turns_a_minute() -> None:
    record = Record(17032, angle=0.01)
    plain = record.identify(None, acceleration=record.acceleration(0.01), torque_unit="N")
    record = Record(17032, angle=0.01)
    found = record.identify(
        None, acceleration=tvident.Channel(record.acceleration(0.01) / 9.80665, "g"), torque_unit="N"
    )
    assert found.constants["inertia"][0] == pytest.approx(plain.constants["inertia"][0], rel=1e-9)
    speed = tvident.Channel(record.velocity(0.01) * 30 / np.pi, "1/min")
    turned = record.identify(None, velocity=speed).constants["inertia"]
    assert abs(turned[0] - record.truth["inertia"]) < 4 * turned[1]


def test_a_motor_without_a_spring_needs_no_angle() -> None:
    rng = np.random.default_rng(0)
    t = np.arange(5000) / RATE
    velocity = 20 + 3 * np.sin(7 * t) + 2 * np.sin(19 * t)
    acceleration = 21 * np.cos(7 * t) + 38 * np.cos(19 * t)
    torque = 0.02 * acceleration + 0.1 * velocity + 0.3 + 0.002 * rng.standard_normal(t.size)
    measured = velocity + 0.01 * rng.standard_normal(t.size)
    found = tvident.identify(None, torque, velocity=measured, sample_rate=RATE, stiffness=0.0)
    assert found.constants["inertia"][0] == pytest.approx(0.02, rel=2e-3)
    assert found.constants["damping"][0] == pytest.approx(0.1, rel=1e-2)
    # What turns on and on has no bias that anybody could tell from its speed.
    assert "velocity_bias" not in found.constants
    strong = tvident.identify(
        None, torque, velocity=measured, sample_rate=RATE, stiffness=0.0, method=tvident.StrongForm(101)
    )
    assert strong.constants["inertia"][0] == pytest.approx(0.02, rel=0.02)


def test_strong_form_takes_derivatives_from_what_measured_them() -> None:
    record = Record(3, angle=0.01)
    form = tvident.StrongForm(window_length=41)
    plain = record.identify(record.angle, method=form)
    found = record.identify(
        record.angle, velocity=record.velocity(0.001), acceleration=record.acceleration(0.001), method=form
    )
    truth = record.truth["inertia"]
    assert abs(found.constants["inertia"][0] - truth) < 0.2 * abs(plain.constants["inertia"][0] - truth)


@pytest.mark.slow
def test_batches_and_gaps() -> None:
    records = [Record(seed, angle=0.05) for seed in (1, 2)]
    velocities = np.stack([record.velocity(0.01) for record in records])
    velocities[1, 2000:2010] = np.nan
    angles, torques = (np.stack([getattr(record, name) for record in records]) for name in ("angle", "torque"))
    found = tvident.identify(angles, torques, velocity=velocities, sample_rate=RATE, stiffness="constant")
    alone = tvident.identify(angles[1], torques[1], velocity=velocities[1], sample_rate=RATE, stiffness="constant")
    assert found.constants["inertia"][0][1] == alone.constants["inertia"][0]
    assert found.constants["velocity_bias"][0].shape == (2,)
    assert alone.constants["velocity_bias"][0] == pytest.approx(0.1, abs=5 * alone.constants["velocity_bias"][1])
    # What was chosen is used again, and simulated against.
    again = tvident.identify(angles, torques, velocity=velocities, sample_rate=RATE, settings=found.settings)
    np.testing.assert_array_equal(again.constants["inertia"][0], found.constants["inertia"][0])
    assert alone.summary()


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (180 / np.pi, "degrees"),
        (-1.0, "its sign is the other one"),
        (1.05, "is 1.05 times the derivative of the angle"),
    ],
)
def test_a_channel_of_another_unit_is_left_out_and_said(factor: float, words: str) -> None:
    record = Record(1, angle=0.01)
    plain = record.identify(record.angle)
    found = record.identify(record.angle, velocity=factor * record.velocity(0.01))
    assert any("the velocity" in line and words in line and "it is left out" in line for line in found.advice)
    assert Status.CHANNEL_SUSPECTED in found.record_status
    assert found.constants["inertia"][0] == pytest.approx(plain.constants["inertia"][0], rel=1e-3)


ANGLE = np.sin(np.arange(1000) / 20)


@pytest.mark.parametrize(
    ("channels", "error", "message"),
    [
        ({"angle": None}, ValueError, "needs a motion; got angle=None; give velocity= or acceleration="),
        ({"velocity": ANGLE[:-1]}, ValueError, "same shape"),
        ({"velocity": ANGLE + 1j}, TypeError, "velocity must be real"),
        ({"acceleration": "abc"}, TypeError, "acceleration must hold numbers"),
        (
            {"velocity": ANGLE, "instrument": ANGLE},
            ValueError,
            "an instrument needs the angle alone; got angle and velocity",
        ),
        ({"angle": None, "velocity": ANGLE, "terms": ["gravity"]}, ValueError, "terms of the angle need the angle"),
        ({"angle": None, "velocity": ANGLE, "period": 6.28}, ValueError, "a period is for an angle"),
    ],
)
def test_channels_that_cannot_be_are_refused(channels: dict[str, Any], error: type[Exception], message: str) -> None:
    call: dict[str, Any] = {"angle": ANGLE, "torque": ANGLE, "sample_rate": 100} | channels
    with pytest.raises(error, match=message):
        tvident.identify(**call)
