"""Options that decide what is merged, each with each: a right number, or an error that names the cure."""

from __future__ import annotations

import inspect
from dataclasses import fields
from itertools import product
from typing import Any

import numpy as np
import pytest

import tvident
from merged.simulated import chain, simulated
from merged.test_masses import OPTIONS, changing, constant, rms, springs
from tvident._identify.together import _ALONE, _CURES, Options

identify: Any = tvident.identify
"""Its type is that of a single record."""

SAMPLES = 1200

STIFFNESS = {1: ("stiffness", 15.0), 2: ("stiffness_0_1", 18.0)}
"""Of one mass, and between two: name and truth."""


def arm() -> tvident.Mechanism:
    """Give the two masses by their energies."""
    return tvident.Mechanism(
        kinetic={"m0": lambda _, v: v[0] ** 2 / 2, "m1": lambda _, v: v[1] ** 2 / 2},
        potential={"k0": lambda q: q[0] ** 2 / 2, "stiffness 0 1": lambda q: (q[1] - q[0]) ** 2 / 2},
        forces={"c0": lambda _, v: (v[0], 0), "c1": lambda _, v: (v[0] - v[1], v[1] - v[0])},
    )


@pytest.fixture(scope="module")
def channels() -> dict[tuple[bool, bool], tuple[Any, Any]]:
    """Give angle and torque by whether there are trials, and masses."""
    trials = simulated(3, SAMPLES, constant(15.0), seed=1)
    chains = [chain([constant(12.0), constant(18.0)], SAMPLES, seed=seed) for seed in range(3)]
    several = np.stack([one.angle for one in chains]), np.stack([one.torque for one in chains])
    return {
        (False, False): (trials.angle[0], trials.torque[0]),
        (True, False): (trials.angle, trials.torque),
        (False, True): (several[0][0], several[1][0]),
        (True, True): several,
    }


def refused(trials: bool, masses: bool, structure: str, options: dict[str, Any]) -> bool:
    """Return what is not supported."""
    if structure and not masses:
        return True
    if (trials or masses) and any(name in options for name in ("share", "align", "lag")):
        return True
    return (structure == "arm" and trials) or ("phase" in options and masses)


@pytest.mark.parametrize(("trials", "masses"), list(product([False, True], repeat=2)))
def test_whatever_is_asked_together_is_right_or_refused(channels: Any, trials: bool, masses: bool) -> None:
    angle, torque = channels[trials, masses]
    rng = np.random.default_rng(0)
    uniform = np.arange(SAMPLES) / 1000
    times: list[dict[str, Any]] = [{"sample_rate": 1000}, {"t": uniform + 5e-5 * rng.uniform(-1, 1, SAMPLES)}]
    phase = np.broadcast_to(np.arange(SAMPLES) / SAMPLES, angle.shape)
    besides: list[dict[str, Any]] = [{}, {"share": "inertia"}, {"align": 0.0}, {"lag": "auto"}]
    besides += [{"phase": phase}] if trials else []
    besides += [{"weights": np.ones(SAMPLES)}] if "weights" in inspect.signature(identify).parameters else []
    structures = {"": None, "chain": tvident.Chain(2, springs(2)), "arm": arm()}
    name, true = STIFFNESS[1 + masses]
    for (structure, given), time, beside in product(structures.items(), times, besides):
        options = {**time, **beside, "structure": given}
        options |= {"ensemble_axis": 0 if trials else None, "dof_axis": int(trials) if masses else None}
        case = (trials, masses, structure, *options)
        # It does not go with times that are not uniform.
        uneven = "t" in time and (trials or masses) and "phase" in beside
        if refused(trials, masses, structure, beside) or uneven:
            with pytest.raises(ValueError, match=r"got .*; .") as error:
                identify(angle, torque, **options)
            assert "supported" in str(error.value) or "=" in str(error.value), case
            continue
        if not trials and not masses:
            # One record: it has tests of its own, and a batch shares nothing.
            continue
        found = identify(angle, torque, **options)
        kind = tvident.MergedIdentification
        assert isinstance(found, kind), case
        key = "stiffness 0 1" if structure == "arm" else name if structure or not masses else "stiffness_1_1"
        assert abs(np.nanmedian(found.elements[key]) / true - 1) < 0.05, case
        assert found.settings["trials"] == (3 if trials else 1), case


def test_no_option_is_passed_over() -> None:
    given = set(inspect.signature(tvident.identify).parameters) - {"angle", "torque"}
    known = {one.name for one in fields(Options)} | set(_ALONE)
    known |= {"sample_rate", "delta", "t", "angle_unit", "torque_unit", "time_unit", "inertia", "damping", "stiffness"}
    assert given <= known
    assert set(_CURES) == set(_ALONE)


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ({"lag": 0.004}, r"lag= is not supported .* got 0.004; shift the torque"),
        ({"period": 2 * np.pi}, r"period= is not supported .* got 6.28.*; unwrap the angle"),
        ({"loss": "huber"}, r"loss= is not supported .* got 'huber'; leave out by mask="),
        ({"velocity": np.ones((2, SAMPLES))}, r"velocity= is not supported .*; leave it out: the angle alone"),
        ({"nan_policy": "propagate"}, r"nan_policy= is not supported .* got 'propagate'; use 'omit'"),
    ],
)
def test_a_refusal_says_what_to_do_without(channels: Any, option: dict[str, Any], words: str) -> None:
    angle, torque = channels[False, True]
    with pytest.raises(ValueError, match=words):
        identify(angle, torque, **OPTIONS, **option)


def test_a_list_of_recordings_of_masses_hears_how_they_go_together() -> None:
    """It heard "give all rows the same length"."""
    generator = np.random.default_rng(0)
    angles, torques = ([generator.normal(size=(2, n)) for n in (3000, 2000)] for _ in range(2))
    with pytest.raises(
        ValueError, match="got 2 of several masses without ensemble_axis=; give ensemble_axis=0 and dof_axis=1"
    ):
        tvident.identify(angles, torques, sample_rate=1000, dof_axis=0)


def test_trials_of_masses_know_more_than_one() -> None:
    several = [chain([changing, constant(18.0)], 1500, seed=seed, base=True) for seed in range(4)]
    angle, torque = (np.stack([getattr(one, name) for one in several]) for name in ("angle", "torque"))
    roads = np.stack([one.base for one in several if one.base is not None])
    axes = {**OPTIONS, "ensemble_axis": 0, "dof_axis": 1}
    kinds: dict[str, Any] = {"stiffness": ["windowed", "constant"], "inertia": "constant", "damping": "constant"}
    found = identify(angle, torque, structure=tvident.Chain(2, springs(2), base=roads), **kinds, **axes)
    alone = identify(angle[0], torque[0], structure=tvident.Chain(2, springs(2), base=roads[0]), **kinds, **OPTIONS)
    assert rms(found.elements["stiffness_base_0"], changing(found.time)) < 0.004
    # The root of four, and what shorter test functions add.
    assert found.stderr["inertia_0"][0] < 0.7 * alone.stderr["inertia_0"][0]
    assert set(found.trial_spread) == set(found.elements)
    assert found.vaf().shape == (4, 2)
    assert (found.vaf() > 99).all()
    # The axes may be the other way round, and lengths may differ.
    swapped = {**OPTIONS, "ensemble_axis": 1, "dof_axis": 0}
    moved = identify(
        np.moveaxis(angle, 0, 1),
        np.moveaxis(torque, 0, 1),
        structure=tvident.Chain(2, springs(2), base=roads),
        **kinds,
        **swapped,
    )
    np.testing.assert_array_equal(moved.stiffness, found.stiffness)
    cut = [one[:, : 1500 - 100 * place] for place, one in enumerate(angle)]
    pushed = [one[:, : 1500 - 100 * place] for place, one in enumerate(torque)]
    bases = [one[: 1500 - 100 * place] for place, one in enumerate(roads)]
    shorter = identify(cut, pushed, structure=tvident.Chain(2, springs(2), base=bases), **kinds, **axes)
    assert rms(shorter.elements["stiffness_base_0"], changing(shorter.time)) < 0.005
    with pytest.raises(ValueError, match="a row for each of 4 trials; got 3"):
        identify(cut, pushed, structure=tvident.Chain(2, springs(2), base=bases[:3]), **kinds, **axes)
