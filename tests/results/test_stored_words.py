"""Words of results that were stored: files and pickles say what was said beside the recording."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from tvident._results import kept

RIGS = [tvident.simulate_torsional_rig(duration=4.0, seed=seed) for seed in range(3)]
ANGLES, TORQUES = (np.stack([getattr(rig, name) for rig in RIGS]) for name in ("angle", "torque"))
MARKED = np.where(np.arange(TORQUES.shape[1]) < 300, -9999.0, TORQUES[0])
NOISE = np.random.default_rng(0).normal(size=(2, 3000))


def friction() -> np.ndarray:
    """Return a torque with friction, which the equation lacks."""
    return np.asarray(TORQUES[1] + 0.3 * np.sign(np.gradient(ANGLES[1])))


@pytest.mark.parametrize(
    ("angle", "torque", "options"),
    [
        (ANGLES[0], TORQUES[0], {}),
        (ANGLES[0], TORQUES[0], {"method": "paper"}),
        (ANGLES[0], -TORQUES[0], {}),
        (ANGLES[0], MARKED, {}),
        (ANGLES[1], friction(), {}),
        (ANGLES[1], friction(), {"terms": ["offset", "coulomb"]}),
        (NOISE[0], NOISE[1], {}),
        (np.full(3000, np.nan), NOISE[1], {}),
        (ANGLES, TORQUES, {}),
        (ANGLES, TORQUES, {"ensemble_axis": 0}),
        (list(ANGLES), [TORQUES[0], friction(), TORQUES[2]], {}),
        (ANGLES[0], TORQUES[0], {"stiffness": tvident.Expansion("chebyshev")}),
    ],
)
def test_a_stored_result_says_what_it_said(tmp_path: Path, angle: Any, torque: Any, options: dict[str, Any]) -> None:
    """What the model explains of the torque was left out: a loaded result that explains nothing was not said to be distrusted."""
    result: Any = tvident.identify(angle, torque, sample_rate=1000, **options)
    result.save(tmp_path / "result.npz")
    loaded = tvident.load(tmp_path / "result.npz")
    assert loaded.summary() == result.summary()
    loaded.save(tmp_path / "again.npz")
    assert tvident.load(tmp_path / "again.npz").summary() == result.summary()
    if not isinstance(angle, list):
        assert pickle.loads(pickle.dumps(result)).summary() == result.summary()  # noqa: S301 - our own
        assert loaded.between(1.0, 2.0).summary() == result.between(1.0, 2.0).summary()


def test_a_batch_is_pickled_without_identifying_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is held back takes as long as to identify, and the rest was made anew by each pickle."""
    result = tvident.identify(ANGLES, np.stack([TORQUES[0], NOISE.reshape(-1)[:4000], TORQUES[2]]), sample_rate=1000)
    with monkeypatch.context() as patch:
        patch.setattr(type(result), "_hold_back", lambda _: pytest.fail("a batch is identified again"))
        again = pickle.loads(pickle.dumps(result))  # noqa: S301 - our own
        patch.setattr(kept, "explained_of", lambda _: pytest.fail("it was made before"))
        assert pickle.loads(pickle.dumps(result)).advice == result.advice  # noqa: S301 - likewise
    assert "do not trust 1 of them" in result.summary().splitlines()[0]
    assert again.summary().splitlines()[0] == result.summary().splitlines()[0]
    assert again.summary().splitlines()[2:] == result.summary().splitlines()[2:]
    assert pickle.loads(pickle.dumps(result)).summary() == result.summary()  # noqa: S301 - likewise


def test_a_copy_needs_nothing_to_be_made(monkeypatch: pytest.MonkeyPatch) -> None:
    result = tvident.identify(ANGLES[0], TORQUES[0], sample_rate=1000)
    with monkeypatch.context() as patch:
        patch.setattr(type(result), "__getstate__", lambda _: pytest.fail("a state is made"))
        copied = copy.copy(result)
    assert copied.inertia is result.inertia
    assert copied.vaf() == result.vaf()
    assert copied.summary() == result.summary()


def test_a_record_of_a_stored_batch_keeps_its_verdict(tmp_path: Path) -> None:
    result = tvident.identify(ANGLES, np.stack([TORQUES[0], MARKED, TORQUES[2]]), sample_rate=1000)
    result.save(tmp_path / "result.npz")
    loaded = tvident.load(tmp_path / "result.npz")
    for place in range(3):
        assert loaded[place].summary().splitlines()[0] == result[place].summary().splitlines()[0]
