"""Rounds of Huber's loss: where they end, and that they end with what more of them would give."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from tvident._identify import robust

Array = npt.NDArray[np.float64]

SAMPLES = 400


@dataclass(frozen=True)
class Recorded:
    """What rounds read of the records of a call."""

    torques: Array
    time: Array = field(default_factory=lambda: np.arange(SAMPLES) / 100)
    weights: None = None
    clipped: tuple[float, ...] = ()

    @property
    def batch(self) -> tuple[int, ...]:
        """All axes but that of the samples."""
        return self.torques.shape[:-1]

    @property
    def records(self) -> int:
        """How many there are."""
        return int(np.prod(self.batch, dtype=int))


@dataclass(frozen=True)
class Found:
    """What was identified of records: no more than the torque that it predicts."""

    predicted: Array
    settings: Any = None

    def __getitem__(self, place: tuple[int, ...]) -> Found:
        return Found(self.predicted[place], self.settings)


class Alternating:
    """Predicts the motion and a part of what clipped residuals leave, in windows of two lengths that take turns."""

    def __init__(self, motion: Array, turns: Array) -> None:
        self.motion, self.turns, self.rounds = motion, turns, 0

    def __call__(self, data: Any) -> Found:
        """Identify records once more."""
        self.rounds += 1
        sign = 1 if self.rounds % 2 else -1
        left = data.torques - self.motion
        kept = np.clip(left, -1, 1).mean(axis=-1, keepdims=True)
        return Found(self.motion + 0.5 * kept + sign * self.turns, {"window_length": 9})


def clipped(monkeypatch: pytest.MonkeyPatch, torques: Array, turns: Array, settled: float) -> tuple[Any, int]:
    monkeypatch.setattr(robust, "predicted_at_samples", lambda found: found.predicted)
    monkeypatch.setattr(robust, "_SETTLED", settled)
    motion = np.broadcast_to(np.sin(np.arange(SAMPLES) / 20), torques.shape)
    identified: Any = Alternating(motion, turns)
    data: Any = Recorded(torques + motion)
    return robust.with_clipped_torque(data, "huber", identified), identified.rounds


def spoilt(records: int) -> Array:
    draw = np.random.default_rng(records)
    torques = draw.normal(0, 0.1, (records, SAMPLES))
    torques[:, ::37] += 3 * draw.choice([-1, 1], torques[:, ::37].shape)
    return torques


@pytest.mark.parametrize("rounds", [9, 10])
def test_two_choices_that_take_turns_end_rounds_with_what_the_last_would_give(
    monkeypatch: pytest.MonkeyPatch, rounds: int
) -> None:
    monkeypatch.setattr(robust, "_ROUNDS", rounds)
    turns = np.full((1, 1), 0.05)
    found, made = clipped(monkeypatch, spoilt(1), turns, 0.02)
    assert 3 <= made < 7
    # With no step small enough all rounds are made.
    expected, made = clipped(monkeypatch, spoilt(1), turns, -1.0)
    assert made == rounds
    off = np.abs(found.torques - expected.torques)
    assert off.max() < 0.02 * 0.1
    assert found.clipped == pytest.approx(expected.clipped, abs=1e-12)


def test_a_record_that_settles_does_so_whatever_others_do(monkeypatch: pytest.MonkeyPatch) -> None:
    turns = np.array([[0.0], [0.05], [0.0]])
    found, made = clipped(monkeypatch, spoilt(3), turns, 0.02)
    assert made < 7
    for record in range(3):
        alone, _ = clipped(monkeypatch, spoilt(3)[record : record + 1], turns[record : record + 1], 0.02)
        np.testing.assert_array_equal(found.torques[record], alone.torques[0])
        assert found.clipped[record] == alone.clipped[0]
