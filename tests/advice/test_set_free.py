"""Where a stiffness that was given as constant changes, that comes before terms that take a part of what it does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

import tvident

RATE, DURATION, WITHIN = 500, 20, 4
INERTIA, DAMPING = 0.0123, 0.0081
Array = npt.NDArray[np.float64]


def moved(stiffness: Callable[[Array], Array], preload: float = 0.0) -> tuple[Array, Array]:
    """Return angle and torque of a rig that thirty sines drive, with a noise of a thousandth."""
    generator = np.random.default_rng(1)
    time = np.arange(RATE * DURATION * WITHIN) / (RATE * WITHIN)
    frequencies, phases = generator.uniform(0.3, 15, (30, 1)), generator.uniform(0, 2 * np.pi, (30, 1))
    torque = 0.2 * np.sin(2 * np.pi * frequencies * time + phases).sum(axis=0)
    angle, velocity, place, each = np.zeros(time.size), 0.0, 0.0, stiffness(time)
    for sample in range(time.size - 1):
        pull = each[sample] * place + preload * np.tanh(place / 5e-4)
        velocity += (torque[sample] - DAMPING * velocity - pull) / (INERTIA * RATE * WITHIN)
        place += velocity / (RATE * WITHIN)
        angle[sample + 1] = place
    noise = 1e-3 * generator.standard_normal((2, RATE * DURATION))
    both = angle[::WITHIN], torque[::WITHIN]
    return both[0] + both[0].std() * noise[0], both[1] + both[1].std() * noise[1]


@pytest.mark.parametrize(
    ("stiffness", "begins"),
    [
        (
            lambda time: np.where(time < 10, 10.0, 16.0),
            "stiffness was given as constant, but what changes explains more than any term",
        ),
        # No term is suspected beside one that grows.
        (lambda time: 10 + 0.4 * time, "stiffness was given as constant, but parts of the record differ"),
    ],
    ids=["step", "ramp"],
)
def test_a_stiffness_that_changes_is_no_preload(stiffness: Callable[[Array], Array], begins: str) -> None:
    """Advised was terms=['offset', 'preload'], whose inertia was 32 and 3 % off."""
    angle, torque = moved(stiffness)
    result = tvident.identify(angle, torque, sample_rate=RATE, stiffness="constant")
    assert result.summary().startswith("do not trust")
    advised = [line for line in result.advice if "stiffness='windowed'" in line]
    assert advised[0].startswith(begins)
    assert not any(" terms=" in line for line in result.advice)
    assert not any("preload" in line for line in result.advice)
    followed = tvident.identify(angle, torque, sample_rate=RATE, stiffness="windowed")
    # Within the 2e-4 by which steps of 0.5 ms are off.
    assert followed.value("inertia").value == pytest.approx(INERTIA, rel=5e-4)
    assert "do not trust" not in followed.summary()


def test_a_preload_is_named_where_there_is_one() -> None:
    angle, torque = moved(lambda time: np.full(time.size, 13.0), preload=0.05)
    advice = tvident.identify(angle, torque, sample_rate=RATE, stiffness="constant").advice
    assert advice[0].startswith("the spring seems to be preloaded by 0.0")
    assert "try terms=['offset', 'preload']" in advice[0]
