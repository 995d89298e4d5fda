"""A record of a list that is too short costs no other record."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest

import tvident

RIGS = [tvident.simulate_torsional_rig(duration=1.5, seed=seed) for seed in range(2)]


def lists(short: int) -> dict[str, Any]:
    """Give two records of 1500 samples with one of so many between them."""
    one, other = RIGS
    some = slice(0, short)
    return {
        "angle": [one.angle, other.angle[some], other.angle],
        "torque": [one.torque, other.torque[some], other.torque],
    }


def same(one: npt.NDArray[np.float64], other: npt.NDArray[np.float64]) -> bool:
    return np.array_equal(one, other, equal_nan=True)


@pytest.mark.parametrize("short", [0, 1, 2, 5, 40])
@pytest.mark.parametrize("method", ["auto", "paper"])
def test_a_record_that_is_too_short_has_no_numbers_and_says_so(short: int, method: Literal["auto", "paper"]) -> None:
    """All records were refused: "a record must hold at least 64 samples"."""
    found = tvident.identify(**lists(short), sample_rate=1000, method=method)
    alone = [tvident.identify(rig.angle, rig.torque, sample_rate=1000, method=method) for rig in RIGS]
    assert [one.stiffness.size for one in found] == [1500, short, 1500]
    assert same(found[0].stiffness, alone[0].stiffness)
    assert same(found[2].stiffness, alone[1].stiffness)
    assert np.isnan(found[1].stiffness).all()
    assert (found[1].status & tvident.Status.INVALID == tvident.Status.INVALID).all()
    assert not found[1].trusted.any()
    assert "nothing could be identified of this record: " in found[1].summary()
    assert found[1].advice[0].startswith("nothing could be identified of this record: ")
    assert np.array_equal(found[1].time, found[0].time[:short])


@pytest.mark.parametrize(("share", "method"), [("inertia", "auto"), ("stiffness", "auto"), ("inertia", "paper")])
def test_what_is_shared_is_of_the_others(share: str, method: Literal["auto", "paper"]) -> None:
    # What changes elsewhere, or is windowed by the method, was looked for among the constants of the short record: a raw KeyError.
    found = tvident.identify(**lists(30), sample_rate=1000, share=(share,), method=method)
    one, other = RIGS
    channels = [one.angle, other.angle], [one.torque, other.torque]
    of_two = tvident.identify(*channels, sample_rate=1000, share=share, method=method)
    assert found.constants == of_two.constants
    if share != "inertia" or method == "paper":
        return
    assert "record 1 says nothing of inertia" in found.advice[0]
    assert same(found[2].stiffness, of_two[1].stiffness)


def test_every_argument_of_samples_may_be_given(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    call = lists(20)
    sizes = [np.size(one) for one in call["angle"]]
    times = [5.0 + np.arange(size) / 1000 + rng.uniform(-1e-4, 1e-4, size) for size in sizes]
    found = tvident.identify(
        **call,
        t=times,
        mask=[np.ones(size, bool) for size in sizes],
        weights=[np.ones(size) for size in sizes],
        velocity=[np.gradient(one) * 1000 if np.size(one) > 1 else one for one in call["angle"]],
        step=3,
    )
    assert np.array_equal(found[1].time, times[1][::3])
    assert np.isnan(found[1].damping).all()
    assert found[0].trusted.any()
    found.save(tmp_path / "three.npz")
    assert tvident.load(tmp_path / "three.npz")[1].advice == found[1].advice


def test_what_is_wrong_otherwise_is_refused_as_before() -> None:
    call = lists(500)
    call["torque"][1] = call["torque"][1][:499]
    with pytest.raises(ValueError, match=r"\(record 1 of 3\)"):
        tvident.identify(**call, sample_rate=1000)
    one, other = RIGS
    # Of two samples nothing is known, but they must be as many as those of the other channel, and as their times.
    with pytest.raises(ValueError, match=r"shape.*\(record 1 of 2\)"):
        tvident.identify([one.angle, other.angle[:2]], [one.torque, other.torque], sample_rate=1000)
    times = np.arange(one.angle.size) / 1000
    with pytest.raises(ValueError, match=r"one time for each of the 2 samples.*\(record 1 of 2\)"):
        tvident.identify([one.angle, other.angle[:2]], [one.torque, other.torque[:2]], t=[times, times])
    with pytest.raises(ValueError, match="at least 64 samples"):
        tvident.identify([one.angle[:30], other.angle[:20]], [one.torque[:30], other.torque[:20]], sample_rate=1000)
