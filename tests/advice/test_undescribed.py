"""What seems to act and is none of the known terms is said: no status without a sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tvident
from tvident import Status
from tvident._advice.undescribed import UNDESCRIBED, driving, in_vain

RATE = 500.0
INERTIA, DAMPING, STIFFNESS = 0.05, 0.4, 15.0


class Suspect:
    """What the core may suspect."""

    def __init__(self, name: str, value: float) -> None:
        self.name, self.value, self.stderr, self.conspicuous = name, value, 0.01, True


def test_friction_that_drives_is_none_of_the_known_terms() -> None:
    """A drive that grows faster than the velocity is no friction: the status says that a term is missing, and so do words."""
    rng, t = np.random.default_rng(3), np.arange(10_000) / RATE
    waves = [(2 * np.pi * f, p) for f, p in zip((0.7, 1.3, 2.3, 3.7, 5.1, 7.9), (0, 4, 1, 3, 2, 5), strict=True)]
    angle = np.sum([0.06 / (1 + w / 20) * np.sin(w * t + p) for w, p in waves], axis=0)
    velocity = np.sum([0.06 / (1 + w / 20) * w * np.cos(w * t + p) for w, p in waves], axis=0)
    acceleration = np.sum([-0.06 / (1 + w / 20) * w**2 * np.sin(w * t + p) for w, p in waves], axis=0)
    torque = INERTIA * acceleration + DAMPING * velocity + STIFFNESS * angle
    torque = torque - 0.05 * np.sign(velocity) - 0.05 * velocity * np.abs(velocity)
    noisy = [one + 1e-3 * one.std() * rng.standard_normal(t.size) for one in (angle, torque)]
    result = tvident.identify(*noisy, sample_rate=RATE)
    assert result.record_status & Status.TERM_SUSPECTED
    assert [line for line in result.advice if UNDESCRIBED in line and "no friction" in line]


@pytest.mark.parametrize(
    ("suspects", "is_said"),
    [
        ([], False),
        ([Suspect("quadratic_drag", -1.0)], True),
        ([Suspect("quadratic_drag", -1.0), Suspect("lag", 1.0)], True),
        ([Suspect("quadratic_drag", -1.0), Suspect("coulomb", 1.0)], False),
        ([Suspect("quadratic_drag", 1.0)], False),
        ([Suspect("lag", -1.0)], False),
    ],
)
def test_only_what_has_no_other_name(suspects: list[Any], is_said: bool) -> None:
    """Beside a term that can be what it is called, one with the wrong sign has the same cause."""
    words = driving(suspects, {"quadratic_drag": "N m s^2/rad^2"})
    assert bool(words) == is_said
    assert all("the velocity times its magnitude, by -1 ± 0.01 N m s^2/rad^2" in line for line in words)


def test_what_was_tried_in_vain_is_still_there() -> None:
    """Where all that is suspected explains nothing, that is said in place of its names."""
    suspects: list[Any] = [Suspect("cubic", 1.0), Suspect("lag", 1.0)]
    (words,) = in_vain(suspects, ["lag", "cubic"])
    assert words.startswith(UNDESCRIBED)
    assert "the cube of the angle and a lag of the torque" in words
    assert not in_vain(suspects, ["cubic"])
    assert not in_vain([], [])
