"""Elements that are sums of functions: of trials of one mass, and of several masses."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import lfilter

import tvident
from merged import gait
from merged.simulated import Masses, Trials, chain, simulated

Array = npt.NDArray[np.float64]

identify: Any = tvident.identify
"""Its type is that of a single record."""

Expansion = tvident.Expansion

CHAIN = tvident.Chain(masses=2, springs=[("base", 0), (0, 1)])

OPTIONS: dict[str, Any] = {"sample_rate": 1000, "dof_axis": 0, "structure": CHAIN}

SAMPLES = 8000


def position(t: Array) -> Array:
    return np.asarray(np.sin(1.9 * t))


def spring(t: Array) -> Array:
    """Give the stiffness of a spring that is a function of a position."""
    return np.asarray(12 + 3 * position(t) + position(t) ** 2)


def masses(seed: int = 1, **options: Any) -> Masses:
    return chain([spring, lambda t: 18 + 0 * t], SAMPLES, seed=seed, **options)


def trials(seed: int = 1, count: int = 4) -> Trials:
    return simulated(count, SAMPLES // 2, spring, seed=seed)


def along(samples: int) -> Array:
    return position(np.arange(samples) / 1000)


def rms(found: Array, true: Array) -> float:
    return float(np.sqrt(np.nanmean((found / true - 1) ** 2)))


@pytest.fixture(scope="module")
def of_chain() -> Any:
    """Give a chain whose spring is a curve of a position."""
    recorded = masses()
    kinds = [Expansion("bspline", of=along(SAMPLES)), "constant"]
    return identify(recorded.angle, recorded.torque, stiffness=kinds, **OPTIONS)


@pytest.mark.first(1)
def test_a_spring_of_a_chain_is_a_curve_of_a_position(of_chain: Any) -> None:
    recorded = masses()
    curve = of_chain.expansions["stiffness_base_0"]
    x = np.linspace(-0.95, 0.95, 21)
    assert np.abs(curve.at(x) / (12 + 3 * x + x**2) - 1).max() < 0.006
    assert np.abs(curve.at(x) - (12 + 3 * x + x**2)).max() < 4 * curve.stderr_at(x).max()
    assert of_chain.kinds["stiffness_base_0"] == "expanded"
    assert of_chain.trusted.all()
    for name, true in zip(("inertia_0", "inertia_1"), recorded.inertia, strict=True):
        value, error = of_chain.constants[name]
        assert abs(value - true) < 4 * error < 0.01 * true
    windows = identify(recorded.angle, recorded.torque, stiffness=["windowed", "constant"], **OPTIONS)
    found = [one.elements["stiffness_base_0"] for one in (of_chain, windows)]
    assert rms(found[0], recorded.stiffness[0]) < 0.7 * rms(found[1], recorded.stiffness[0])
    assert "bspline) of the channel" in of_chain.summary()
    assert any("the expansion and" in one and "windows agree" in one for one in of_chain.reasons)


def test_matrices_and_their_errors_are_made_of_curves(of_chain: Any) -> None:
    stiffness, error = of_chain.elements["stiffness_base_0"], of_chain.stderr["stiffness_base_0"]
    between = of_chain.constants["stiffness_0_1"]
    np.testing.assert_array_equal(of_chain.stiffness[1, 1], between[0])
    np.testing.assert_allclose(of_chain.stiffness[0, 0], stiffness + between[0], rtol=1e-12)
    # They share equations, so errors of a sum are not those of what does not depend on each other.
    assert (of_chain.stderr["stiffness"][0, 0] < 1.01 * (error + between[1])).all()
    assert (of_chain.stderr["stiffness"][0, 0] > 0.3 * error).all()
    assert np.isfinite(of_chain.natural_frequency).all()


def test_a_force_on_one_mass_is_enough() -> None:
    recorded = masses(seed=2, driven=(1,))
    kinds = [Expansion("bspline", of=along(SAMPLES)), "constant"]
    found = identify(recorded.angle, recorded.torque, stiffness=kinds, **OPTIONS)
    assert found.trusted.all()
    assert rms(found.elements["stiffness_base_0"], recorded.stiffness[0]) < 0.015


def test_a_result_is_kept_stored_and_asked_for_once_more(of_chain: Any, tmp_path: Path) -> None:
    recorded = masses()
    of_chain.save(tmp_path / "chain.npz")
    for other in (tvident.load(tmp_path / "chain.npz"), pickle.loads(pickle.dumps(of_chain))):  # noqa: S301 - of our own
        np.testing.assert_array_equal(other.stiffness, of_chain.stiffness)
        np.testing.assert_array_equal(
            other.expansions["stiffness_base_0"].value, of_chain.expansions["stiffness_base_0"].value
        )
        assert other.kinds == of_chain.kinds
    part = of_chain.between(1, 2)
    assert part.expansions.keys() == {"stiffness_base_0"}
    assert part.stiffness.shape == (2, 2, 1001)
    kinds = {"stiffness_base_0": Expansion("bspline", of=along(SAMPLES))}
    again = identify(recorded.angle, recorded.torque, settings=of_chain.settings, stiffness=kinds, **OPTIONS)
    error = of_chain.stderr["stiffness_base_0"]
    # Where elements begin as constants, steps end some rounding apart.
    assert np.abs((again.elements["stiffness_base_0"] - of_chain.elements["stiffness_base_0"]) / error).max() < 1e-3
    with pytest.raises(ValueError, match=r"stiffness_base_0 is an expansion.*pass its Expansion\(…\) again"):
        identify(recorded.angle, recorded.torque, settings=of_chain.settings, **OPTIONS)
    held_back = of_chain.held_back()
    assert (held_back.predicted > 98).all()
    assert (held_back.simulated > 98).all()


def test_trials_share_a_curve() -> None:
    several = trials()
    options = {"sample_rate": 1000, "ensemble_axis": 0}
    for of in (None, along(SAMPLES // 2)):
        found = identify(several.angle, several.torque, stiffness=Expansion("bspline", of=of), **options)
        assert rms(found.stiffness, several.stiffness) < 0.005
        value, error = found.constants["inertia"]
        assert abs(value - several.inertia) < 4 * error
        assert found.trusted.all()
    wanted = identify(several.angle, several.torque, stiffness=Expansion("bspline", of=of), step=50, **options)
    np.testing.assert_array_equal(wanted.stiffness, found.stiffness[::50])
    # A trial of another length is part of it; one that is shorter than the test function says nothing.
    lengths = [4000, 3000, 4000, 3500]
    angles, torques = (
        [*(one[:length] for one, length in zip(each, lengths, strict=True)), each[0][:30]]
        for each in (several.angle, several.torque)
    )
    found = identify(angles, torques, stiffness=Expansion("bspline", of=along(4000)), **options)
    assert rms(found.stiffness, several.stiffness) < 0.006


def test_equal_trials_are_one_with_half_the_variance() -> None:
    one = trials(count=1)
    twice = [np.concatenate([each, each]) for each in (one.angle, one.torque)]
    method = tvident.WeakForm(window_length=81, exponent=7)
    options: dict[str, Any] = {"sample_rate": 1000, "stiffness": Expansion("bspline", size=8), "method": method}
    both = identify(*twice, ensemble_axis=0, **options)
    alone = identify(one.angle[0], one.torque[0], inertia="constant", damping="constant", **options)
    # Noise of the torque is found beside windows in one record, and in the channel in trials: rows have slightly other weights.
    assert np.abs((both.stiffness - alone.stiffness) / alone.stderr["stiffness"]).max() < 0.1
    np.testing.assert_allclose(both.stderr["stiffness"] * 2**0.5, alone.stderr["stiffness"], rtol=0.05)


def test_missing_samples_masks_and_missing_channels_are_left_out() -> None:
    recorded = masses(seed=3)
    angle, torque = recorded.angle.copy(), recorded.torque.copy()
    angle[0, 2000:2300] = np.nan
    torque[1, 5000:5100] = np.nan
    x = along(SAMPLES)
    x[7000:7200] = np.nan
    kinds = [Expansion("bspline", of=x), "constant"]
    found = identify(angle, torque, stiffness=kinds, mask=np.arange(SAMPLES) > 600, **OPTIONS)
    known = np.isfinite(found.elements["stiffness_base_0"])
    np.testing.assert_array_equal(known, np.isfinite(x))
    assert rms(found.elements["stiffness_base_0"], recorded.stiffness[0]) < 0.01
    assert found.status[7100] & tvident.Status.INVALID
    assert not found.status[100] & tvident.Status.INVALID


def test_weights_make_curves_as_good_as_the_quiet_samples_allow() -> None:
    recorded = masses(seed=6)
    rng = np.random.default_rng(6)
    weights = np.where(np.arange(SAMPLES) < SAMPLES // 2, 1.0, 1 / 400)
    # Weights are those of all noise together.
    more = 0.1 * recorded.torque.std() * np.sqrt(1 / weights - 1) * rng.standard_normal(recorded.torque.shape)
    angle = recorded.angle + 1e-3 * recorded.angle.std() * np.sqrt(1 / weights - 1) * rng.standard_normal(more.shape)
    kinds = [Expansion("bspline", of=along(SAMPLES)), "constant"]
    found = [
        identify(angle, recorded.torque + more, stiffness=kinds, **OPTIONS, **given)
        for given in ({}, {"weights": weights})
    ]
    errors = [rms(one.elements["stiffness_base_0"], recorded.stiffness[0]) for one in found]
    assert errors[1] < 0.4 * errors[0]
    assert errors[1] < 4 * np.median(found[1].stderr["stiffness_base_0"] / recorded.stiffness[0]) < 0.02
    assert found[1].trusted.all()
    # A sample without weight is missing, whatever it holds.
    angle[:, 100:200] = 1e3
    weights[100:200] = 0.0
    left_out = identify(angle, recorded.torque + more, stiffness=kinds, weights=weights, **OPTIONS)
    assert rms(left_out.elements["stiffness_base_0"], recorded.stiffness[0]) < 0.02


def test_functions_that_do_not_follow_are_contradicted() -> None:
    jump = chain([lambda t: np.where(t < 4, 12.0, 20.0), lambda t: 18 + 0 * t], SAMPLES, seed=4)
    found = identify(jump.angle, jump.torque, stiffness=[Expansion("bspline", size=6), "constant"], **OPTIONS)
    assert found.record_status & tvident.Status.KIND_CONTRADICTED
    assert any("windows find a jump of stiffness_base_0 (at 4" in one for one in found.advice)


def test_entries_of_matrices_terms_and_several_elements_are_expanded() -> None:
    recorded = masses(seed=5)
    x = Expansion("bspline", size=5, of=along(SAMPLES))
    full = tvident.Matrix("symmetric", "constant", entries={(0, 0): x})
    found = identify(recorded.angle, recorded.torque, sample_rate=1000, dof_axis=0, stiffness=full)
    assert found.kinds["stiffness_0_0"] == "expanded"
    assert rms(found.stiffness[0, 0], recorded.stiffness[0] + 18) < 0.02
    nested = [[x, "constant"], ["constant", "constant"]]
    found = identify(recorded.angle, recorded.torque, sample_rate=1000, dof_axis=0, stiffness=nested)
    assert [name for name, kind in found.kinds.items() if kind == "expanded"] == ["stiffness_0_0"]
    options = {**OPTIONS, "terms": [("offset", Expansion("bspline", size=4))]}
    found = identify(
        recorded.angle,
        recorded.torque,
        stiffness=x,
        damping={"damping_0_1": Expansion("bspline", size=4)},
        inertia=[Expansion("legendre", size=2, inertia_times="momentum"), "constant"],
        **options,
    )
    kinds = {name for name, kind in found.kinds.items() if kind == "expanded"}
    assert kinds == {"stiffness_base_0", "stiffness_0_1", "damping_0_1", "inertia_0", "offset_0", "offset_1"}
    assert set(found.expansions) == kinds
    assert rms(found.elements["inertia_0"], np.full(SAMPLES, recorded.inertia[0])) < 0.02


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stiffness": [Expansion("bspline"), "windowed"]}, "all others are constant.*stiffness_0_1='windowed'.*say"),
        ({"stiffness": Expansion("bspline", of=np.arange(5.0))}, "a value for every sample.*shape .5,. for 8000"),
        ({"damping": Expansion("haar", size=4)}, "damping_base_0 needs functions with continuous derivatives.*haar"),
        (
            {"stiffness": Expansion("bspline", of=np.ones(SAMPLES))},
            "must change; stiffness_base_0 got one that stays at 1",
        ),
    ],
)
def test_what_cannot_be_is_refused(options: Any, message: str) -> None:
    recorded = masses()
    with pytest.raises(ValueError, match=message):
        identify(recorded.angle, recorded.torque, **OPTIONS, **options)


def test_cycles_of_gait_share_harmonics_of_their_phase() -> None:
    walk = gait.simulated(0, rate=250.0)
    angles, torques, phases = gait.cycles(walk)
    harmonics = Expansion("fourier", size=15, limits=(0, 1))
    options = {"sample_rate": walk.sample_rate, "ensemble_axis": 0, "terms": [], "phase": phases}
    found = identify(angles, torques, stiffness=harmonics, damping=harmonics, **options)
    first = walk.phase < 1
    for name in ("damping", "stiffness"):
        true = np.interp(found.phase, walk.phase[first], walk.truth[name][first])
        assert np.sqrt(np.mean((getattr(found, name) - true) ** 2)) < 0.03 * true.mean()
        assert np.mean(np.abs(getattr(found, name) - true) < 1.96 * found.stderr[name]) > 0.8
    value, error = found.constants["inertia"]
    assert abs(value - walk.truth["inertia"][0]) < 4 * error
    curve = found.expansions["stiffness"]
    assert curve.unit_of == ""
    np.testing.assert_allclose(curve.at(found.phase), found.stiffness, rtol=1e-9)
    # As harmonics of the phase in one record, which cuts nothing.
    whole = gait.harmonics(walk, 15)
    between = np.interp(walk.phase % 1, found.phase, found.stiffness)
    assert np.median(np.abs(between / whole["stiffness"] - 1)) < 0.005
    # Functions that do not go on into the next cycle know less of its ends.
    splines = identify(angles, torques, stiffness=Expansion("bspline", size=20), damping=harmonics, **options)
    assert np.median(np.abs(splines.stiffness / found.stiffness - 1)) < 0.02


def test_a_mechanism_is_refused() -> None:
    recorded = masses()
    kinds: Any = {"first": Expansion("bspline", size=4)}
    bodies = tvident.Mechanism(
        kinetic={"first": lambda _, v: v[0] ** 2 / 2, "second": lambda _, v: v[1] ** 2 / 2}, kinds=kinds
    )
    with pytest.raises(ValueError, match="an Expansion of first needs channels as they were recorded; got a Mechanism"):
        identify(recorded.angle, recorded.torque, sample_rate=1000, dof_axis=0, structure=bodies)


@pytest.mark.parametrize("step", [1, 5])
def test_where_windows_determine_nothing_there_is_no_curve(step: int) -> None:
    recorded, several = masses(), trials()
    still = identify(
        np.zeros_like(recorded.angle), recorded.torque, stiffness=Expansion("bspline"), step=step, **OPTIONS
    )
    assert set(still.kinds.values()) == {"unknown"}
    assert still.status.shape == still.time.shape == (SAMPLES // step,)
    options = {"sample_rate": 1000, "ensemble_axis": 0, "stiffness": Expansion("bspline"), "step": step}
    assert not identify(np.zeros_like(several.angle), several.torque, **options).trusted.any()
    lacking = recorded.angle.copy()
    lacking[1] = np.nan
    kinds = [Expansion("bspline", of=along(SAMPLES)), "constant"]
    found = identify(lacking, recorded.torque, stiffness=kinds, step=step, **OPTIONS)
    assert found.record_status & tvident.Status.RANK_DEFICIENT


def test_windows_that_are_carried_on_into_a_mask_contradict_nothing() -> None:
    several = trials(seed=2704)
    options = {"sample_rate": 1000, "ensemble_axis": 0, "mask": np.arange(SAMPLES // 2) > 1300}
    found = identify(several.angle, several.torque, stiffness=Expansion("bspline", of=along(SAMPLES // 2)), **options)
    assert not found.record_status & tvident.Status.KIND_CONTRADICTED
    assert found.trusted.all()
    # Windows themselves are not trusted far from what they were told by, and have no error where they have no value.
    windowed = identify(several.angle, several.torque, **options)
    assert windowed.trusted[:1200].mean() < 0.1
    known = windowed.trusted
    assert (np.abs(windowed.stiffness - several.stiffness) < 6 * windowed.stderr["stiffness"])[known].all()
    np.testing.assert_array_equal(np.isnan(windowed.stiffness), np.isnan(windowed.stderr["stiffness"]))


def test_a_constant_that_changes_beside_a_curve_is_contradicted() -> None:
    recorded = chain([spring, lambda t: np.where(t < 4, 18.0, 21.0)], SAMPLES, seed=7)
    kinds = [Expansion("bspline", of=along(SAMPLES)), "constant"]
    found = identify(recorded.angle, recorded.torque, stiffness=kinds, **OPTIONS)
    assert found.record_status & tvident.Status.KIND_CONTRADICTED
    assert any("stiffness_0_1 differs between parts" in one for one in found.advice)


def test_a_curve_that_blurs_a_jump_is_contradicted() -> None:
    jump = chain([lambda t: np.where(t < 3.1, 12.0, 18.0), lambda t: 18 + 0 * t], 6000, seed=2201)
    found = identify(jump.angle, jump.torque, stiffness=[Expansion("bspline"), "constant"], **OPTIONS)
    assert found.record_status & tvident.Status.KIND_CONTRADICTED
    assert any("windows find" in one and "do not follow" in one for one in found.advice)


def test_noise_that_is_correlated_asks_for_no_more_functions() -> None:
    sizes, covered = [], []
    for seed in range(6):
        several = simulated(3, 1500, spring, seed=2600 + seed)
        white = np.random.default_rng(seed).standard_normal(several.torque.shape)
        coloured = lfilter([1], [1, -0.9], white)
        kinds = {"stiffness": Expansion("bspline", of=along(1500)), "damping": "constant", "inertia": "constant"}
        found = identify(
            several.angle,
            several.torque + 0.05 * several.torque.std() * coloured,
            sample_rate=1000,
            ensemble_axis=0,
            **kinds,
        )
        sizes.append(found.expansions["stiffness"].size)
        covered.append(np.mean(np.abs(found.stiffness - several.stiffness) < 1.96 * found.stderr["stiffness"]))
    # As if equations were independent half of them take more than 35, and .65 is covered.
    assert np.median(sizes) <= 6
    assert np.mean(covered) > 0.8


def test_noise_alone_is_no_curve() -> None:
    angle, torque = np.random.default_rng(0).standard_normal((2, 2, 4000))
    found = identify(angle, torque, stiffness=Expansion("bspline"), **OPTIONS)
    assert not found.trusted.any()
