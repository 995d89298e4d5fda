"""The verdict on a file follows the rules for a recording in memory, and says what to do."""

from __future__ import annotations

import dataclasses
import json
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import chirp, lsim

import tvident
from in_pieces.small_pieces import cut_small
from tvident._in_pieces.told_by_weak_form import ToldByWeakForm

Recording = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]
SIGN = "is the torque's sign reversed, are the channels swapped?"


def reversed_sign() -> Recording:
    rig = tvident.simulate_torsional_rig(duration=60.0)
    return rig.angle, -rig.torque


def swapped() -> Recording:
    rig = tvident.simulate_torsional_rig(duration=20.0)
    return rig.torque, rig.angle


def told_by(angle: Any, torque: Any, folder: Path, **call: Any) -> tvident.FileIdentification:
    np.save(folder / "run.npy", np.stack([angle, torque], axis=1))
    return tvident.identify_file(
        folder / "run.npy", folder / "out.npy", angle="0", torque="1", **{"sample_rate": 1000.0} | call
    )


@pytest.mark.parametrize("call", [{}, {"method": "paper"}], ids=str)
@pytest.mark.parametrize("is_cut", [False, True])
def test_a_sign_that_no_machine_has_comes_with_its_cure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: dict[str, Any], is_cut: bool
) -> None:
    """In strong form a file had the verdict alone."""
    if is_cut:
        cut_small(monkeypatch, tmp_path)
    found = told_by(*reversed_sign(), tmp_path, **call)
    assert found.verdict == "do not trust: inertia is negative; see what to do"
    assert sum(SIGN in line for line in found.advice) == 1
    assert f"- {next(line for line in found.advice if SIGN in line)}" in found.summary()


def test_what_nothing_explains_is_to_be_looked_at_in_memory(tmp_path: Path) -> None:
    found = told_by(*swapped(), tmp_path, method="paper", stiffness=-5.0)
    assert found.verdict.startswith("do not trust: ")
    assert found.verdict.endswith("see what to do")
    assert "identify a stretch of it in memory" in found.advice[0]


CALLS = pytest.mark.parametrize(
    "call", [{}, {"method": "paper"}, {"method": tvident.StrongForm()}], ids=["weak", "paper", "strong"]
)


@CALLS
@pytest.mark.parametrize("is_cut", [False, True])
def test_swapped_channels_are_named_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: dict[str, Any], is_cut: bool
) -> None:
    """In strong form, and of several pieces, a lag was asked about, or nothing was."""
    if is_cut:
        cut_small(monkeypatch, tmp_path)
        rig = tvident.simulate_torsional_rig(duration=60.0)
        recording = rig.torque, rig.angle
    else:
        recording = swapped()
    if is_cut and not call:
        with pytest.raises(
            ValueError, match=r"none of 3 stretches determines a parameter; .*; are the channels of angle"
        ):
            told_by(*recording, tmp_path)
        return
    found = told_by(*recording, tmp_path, **call)
    assert "known to" not in found.verdict
    assert found.advice[0].startswith("are the channels of angle and torque swapped? With one in the other's place")
    assert sum("swapped?" in line for line in found.advice) == 1


@CALLS
@pytest.mark.parametrize("sign", [1, -1])
def test_channels_in_their_places_are_not_said_to_be_swapped(tmp_path: Path, call: dict[str, Any], sign: int) -> None:
    rig = tvident.simulate_torsional_rig(duration=20.0)
    found = told_by(rig.angle[20:], sign * rig.torque[:-20], tmp_path, **call)  # late, and reversed
    assert not any("With one in the other's place" in line for line in found.advice)


def jittering_sweep(rate: float) -> Recording:
    """Return a sweep at which inertia and stiffness trade places, whose stiffness has both signs."""
    generator = np.random.default_rng(0)
    duration, frequency, inertia = 40.0, 4.0, 0.01
    time = np.arange(int(duration * rate)) / rate
    speed = 2 * np.pi * frequency
    torque = chirp(time, 0.1 * frequency, duration, 5 * frequency, method="logarithmic")
    angle = lsim(([1.0], [inertia, 0.2 * inertia * speed, inertia * speed**2]), torque, time)[1]
    angle = np.interp(time + 0.6 / rate * generator.uniform(-0.5, 0.5, time.size), time, angle)
    angle += 1e-4 * angle.std() * generator.standard_normal(time.size)
    return angle, torque + 1e-3 * generator.standard_normal(time.size)


def of_both_signs(rate: float) -> Recording:
    """Return a broad motion of a stiffness that has both signs."""
    generator = np.random.default_rng(0)
    time = np.arange(10_000) / rate
    speeds = 2 * np.pi * generator.uniform(0.3, 20, (25, 1))
    phases = speeds * time + generator.uniform(0, 2 * np.pi, (25, 1))
    sizes = 1 / (1 + (speeds / 6 / np.pi) ** 2)
    motion = np.sin(phases), speeds * np.cos(phases), -(speeds**2) * np.sin(phases)
    angle, velocity, acceleration = ((sizes * part).sum(0) for part in motion)
    torque = 0.01 * acceleration + 0.05 * velocity + (3 + 8 * np.sin(0.4 * np.pi * time)) * angle
    angle += 1e-4 * angle.std() * generator.standard_normal(time.size)
    return angle, torque + 1e-3 * torque.std() * generator.standard_normal(time.size)


@pytest.mark.parametrize(("record", "is_trusted"), [(jittering_sweep, False), (of_both_signs, True)])
def test_a_stiffness_of_both_signs_is_judged_as_in_memory(
    tmp_path: Path, record: Callable[[float], Recording], is_trusted: bool
) -> None:
    angle, torque = record(500.0)
    in_memory = tvident.identify(angle, torque, sample_rate=500.0).summary().splitlines()[0]
    of_file = told_by(angle, torque, tmp_path, sample_rate=500.0).verdict
    for verdict in (in_memory, of_file):
        assert verdict.startswith("K(t) known to" if is_trusted else "do not trust: stiffness has both signs (")


def test_a_doubtful_unit_is_shown_as_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("angle_rev,torque\n1,2\n2,3\n3,5\n")
    with pytest.raises(ValueError, match="got 'rev': rev for revolutions"):
        tvident.identify_file(path, tmp_path / "out.csv", angle="angle", torque="torque", sample_rate=1000.0)


def test_npy_waits_for_who_reads_the_verdict(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in memory; what is read then needs no file any more, goes through pickle, and is what other files hold at once."""
    rig = tvident.simulate_torsional_rig(duration=60.0)
    asked: list[int] = []
    advice = ToldByWeakForm.advice

    def counted(told: ToldByWeakForm, samples: int) -> list[str]:
        asked.append(samples)
        return advice(told, samples)

    monkeypatch.setattr(ToldByWeakForm, "advice", counted)
    parquet = pytest.importorskip("pyarrow.parquet")
    np.save(tmp_path / "run.npy", np.stack([rig.angle, -rig.torque], axis=1))
    call: dict[str, Any] = {"angle": "0", "torque": "1", "sample_rate": 1000.0, "method": "paper"}
    found = [tvident.identify_file(tmp_path / "run.npy", tmp_path / "out.npy", **call) for _ in range(2)]
    assert not asked
    other = tvident.identify_file(tmp_path / "run.npy", tmp_path / "out.parquet", **call)
    assert len(asked) == 1
    told = json.loads(parquet.read_schema(tmp_path / "out.parquet").metadata[b"tvident"])
    for one in tmp_path.iterdir():
        one.unlink()
    assert found[0].verdict == other.verdict == told["verdict"] == "do not trust: inertia is negative; see what to do"
    assert [*found[0].advice] == [*other.advice] == told["advice"]
    assert pickle.loads(pickle.dumps(found[1])).summary() == found[0].summary()  # noqa: S301 - its own
    moved = dataclasses.replace(pickle.loads(pickle.dumps(found[1])), path=tmp_path)  # noqa: S301 - its own
    assert moved.verdict == found[0].verdict
    assert len(asked) == 3
