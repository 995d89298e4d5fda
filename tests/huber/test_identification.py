"""Identification with Huber's loss: spikes of the torque move parameters by little, and errors hold."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long
from tvident._identify.task import Task

Array = npt.NDArray[np.float64]

INSIDE = slice(500, -500)
LOSS = 1.3
"""Errors over those without spikes: a hundredth of clipped samples adds some percent, their chance does the rest."""
CONSTANT = 5e-3
"""What inertia may be wrong by in any of these records, relative: without spikes it is up to 2.5e-3, by chance."""


def spoilt(rig: tvident.TorsionalRecording, spikes: int, size: float) -> Array:
    generator = np.random.default_rng(5)
    torque = rig.torque.copy()
    hit = generator.choice(torque.size, spikes, replace=False)
    torque[hit] += size * torque.std() * generator.choice([-1, 1], spikes)
    return np.asarray(torque)


def errors(result: tvident.Identification, rig: tvident.TorsionalRecording) -> tuple[float, float]:
    """Return relative errors of inertia and stiffness, root mean squares."""
    inertia, stiffness = (
        float(np.sqrt(np.mean((getattr(result, name) / getattr(rig, name) - 1)[INSIDE] ** 2)))
        for name in ("inertia", "stiffness")
    )
    return inertia, stiffness


def test_what_may_be_missing_is_looked_for_once_the_torque_is_clipped(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = tvident.simulate_torsional_rig(2.0, seed=3)
    looked: list[bool] = []
    found = Task.found

    def counted(self: Task, *given: Any, diagnose: bool = False, **named: Any) -> Any:
        looked.append(diagnose)
        return found(self, *given, diagnose=diagnose, **named)

    monkeypatch.setattr(Task, "found", counted)
    tvident.identify(rig.angle, spoilt(rig, 10, 5.0), sample_rate=rig.sample_rate, loss="huber")
    assert len(looked) > 2
    assert looked == [False] * (len(looked) - 1) + [True]


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "size"), [*long((1, 5.0)), (2, 100.0)])
def test_spikes_of_the_torque_move_parameters_by_little(seed: int, size: float) -> None:
    rig = tvident.simulate_torsional_rig(8.0, seed=seed)
    torque = spoilt(rig, 40, size)
    _, alone = errors(tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate), rig)
    _, squares = errors(tvident.identify(rig.angle, torque, sample_rate=rig.sample_rate), rig)
    result = tvident.identify(rig.angle, torque, sample_rate=rig.sample_rate, loss="huber")
    inertia, stiffness = errors(result, rig)
    assert stiffness < LOSS * alone < squares
    assert inertia < CONSTANT
    assert result.settings["loss"] == "huber"
    assert any("Huber" in reason for reason in result.reasons)
    again = tvident.identify(rig.angle, torque, sample_rate=rig.sample_rate, settings=result.settings)
    assert again.settings["loss"] == "huber"
    # Rounds end where what is clipped moves by a fiftieth of its scale; beyond the last windows that is carried on.
    np.testing.assert_allclose(again.stiffness[INSIDE], result.stiffness[INSIDE], rtol=5e-3)


def test_the_loss_is_chosen_by_the_tails() -> None:
    rig = tvident.simulate_torsional_rig(6.0, seed=3)
    spikes = spoilt(rig, 40, 5.0)
    both = tvident.identify(
        np.stack([rig.angle, rig.angle]), np.stack([rig.torque, spikes]), sample_rate=rig.sample_rate, loss="auto"
    )
    plain = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate, loss="auto")
    np.testing.assert_array_equal(both[0].stiffness, plain.stiffness)
    assert plain.settings["loss"] == "squares"
    robust = tvident.identify(rig.angle, spikes, sample_rate=rig.sample_rate, loss="huber")
    np.testing.assert_allclose(both[1].stiffness[INSIDE], robust.stiffness[INSIDE], rtol=5e-3)


def test_records_that_determine_nothing_and_other_forms_have_a_loss_too() -> None:
    nothing = tvident.identify(np.zeros(2000), np.zeros(2000), sample_rate=1000, loss="huber")
    assert np.isnan(nothing.stiffness).all()
    rig = tvident.simulate_torsional_rig(6.0, seed=1)
    torque = spoilt(rig, 30, 20.0)
    paper = tvident.identify(rig.angle, torque, sample_rate=rig.sample_rate, method="paper", loss="huber")
    squares = tvident.identify(rig.angle, torque, sample_rate=rig.sample_rate, method="paper")
    assert errors(paper, rig)[1] < errors(squares, rig)[1]
    with pytest.raises(ValueError, match=r"loss must be"):
        tvident.identify(rig.angle, torque, sample_rate=rig.sample_rate, loss="cauchy")  # type: ignore[call-overload]
