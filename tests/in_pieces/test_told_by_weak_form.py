"""Long records in strong form: where the weak form finds something else of stretches the verdict says so, and elsewhere nothing."""

from __future__ import annotations

import json
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long
from tvident._in_pieces import told_by_weak_form

Array = npt.NDArray[np.float64]

CONSTANT: Any = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")


@pytest.fixture(autouse=True)
def _short_stretches(small_pieces: None, monkeypatch: pytest.MonkeyPatch) -> None:  # noqa: ARG001 - for what it does
    monkeypatch.setattr(told_by_weak_form, "_STRETCH", 10_000)


@pytest.fixture(scope="module")
def rig() -> tvident.Recording:
    return tvident.simulate_torsional_rig(45.0, pattern="constant")


def identified(angle: Array, torque: Array, **kinds: Any) -> tvident.FileIdentification:
    np.save("in.npy", np.stack([angle, torque], axis=1))
    method: Any = kinds.pop("method", tvident.StrongForm())
    found: tvident.FileIdentification = tvident.identify_file(
        "in.npy", "out.h5", angle="0", torque="1", sample_rate=1000, method=method, **kinds
    )
    return found


def joined(angle: Array, torque: Array) -> tuple[Array, Array]:
    return np.tile(angle[:9000], 5), np.tile(torque[:9000], 5)


def spikes(angle: Array, torque: Array) -> tuple[Array, Array]:
    spoilt = angle.copy()
    spoilt[[4000, 9000, 16000, 31000]] += 1.0
    return spoilt, torque


@pytest.mark.parametrize("kinds", [CONSTANT, *long({})], ids=str)
@pytest.mark.parametrize(
    ("spoil", "seen"), [(joined, "the angle jumps between two samples"), (spikes, "stand far out of the neighbours")]
)
def test_what_is_spoilt_is_not_to_be_trusted(rig: tvident.Recording, spoil: Any, seen: str, kinds: Any) -> None:
    """Of 60 s joined five times the inertia was .0054 for .0123, by 260 errors, with neither a word nor a verdict."""
    found = identified(*spoil(rig.angle, rig.torque), **kinds)
    assert abs(found.constants["inertia"][0] / 0.0123 - 1) > 0.02
    first = found.summary().splitlines()[0]
    assert first == found.verdict
    assert first.startswith("do not trust: the weak form finds another stiffness and another inertia")
    assert found.advice[0].startswith("the weak form finds other numbers at ")
    assert "inertia becomes 0.0123" in found.advice[0] or "inertia becomes 0.0122" in found.advice[0]
    assert any(seen in line and " s)" in line for line in found.advice[1:])


@pytest.mark.parametrize("call_", [{}, CONSTANT, {"method": "paper"}, {"method": "auto"}, {"inertia": 0.0123}], ids=str)
def test_nothing_is_said_of_a_record_without_a_fault(rig: tvident.Recording, call_: dict[str, Any]) -> None:
    found = identified(rig.angle, rig.torque, **call_)
    assert found.verdict.startswith("K")
    assert "known to ±" in found.verdict
    assert "do not trust" not in found.verdict
    assert not any("weak form" in line for line in found.advice)


@pytest.mark.parametrize("call_", [CONSTANT, {"method": "paper"}, {"method": "auto"}], ids=str)
def test_a_sign_that_no_machine_has_is_the_verdict(rig: tvident.Recording, call_: dict[str, Any]) -> None:
    found = identified(rig.angle, -rig.torque, **call_)
    assert found.verdict.startswith("do not trust: inertia is negative")
    with h5py.File("out.h5") as file:
        told = json.loads(file.attrs["tvident"])
    assert told["verdict"] == found.verdict


def test_every_seventh_row_is_judged_alike(rig: tvident.Recording) -> None:
    found = identified(*joined(rig.angle, rig.torque), step=7, **CONSTANT)
    assert found.verdict.startswith("do not trust: the weak form finds another stiffness")


def test_columns_of_a_matrix_have_their_names_and_units(rig: tvident.Recording) -> None:
    """A list of units was one unit of all, `['s' 'deg' 'N mm']`, and names were numbers."""
    columns = np.stack([np.asarray(rig.time), np.degrees(rig.angle), 1000 * rig.torque], axis=1)
    with h5py.File("in.h5", "w") as file:
        data = file.create_dataset("run/data", data=columns[:20_000])
        data.attrs["columns"], data.attrs["units"] = ["time", "angle", "torque"], ["s", "deg", "N mm"]
    found = tvident.identify_file("in.h5", "out.h5", angle="angle", torque="torque")
    assert found.constants["inertia"][0] == pytest.approx(0.0123, rel=0.02)
    assert not found.assumed
