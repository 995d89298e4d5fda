"""Structures with a name: what engineers draw, entries that are tied, and what neither can know."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest

import tvident
from merged.simulated import chain, coupled
from merged.test_masses import CONSTANTS, OPTIONS, constant, matrices, springs

Array = npt.NDArray[np.float64]

identify: Any = tvident.identify
"""Its type is that of a single record."""


def still(matrix: list[list[float]]) -> Any:
    """Give a matrix at all times."""
    return lambda t: np.asarray(matrix)[:, :, np.newaxis] + 0 * t


def road(seed: int, samples: int, highest: float = 15.0) -> tuple[Array, Array]:
    """Give position and velocity of a base, at half samples of a millisecond."""
    rng = np.random.default_rng(seed)
    times = np.arange(2 * samples + 1) * 5e-4
    pulsations = 2 * np.pi * np.linspace(0.5, highest, 31)[:, np.newaxis]
    angles = pulsations * times + rng.uniform(0, 2 * np.pi, (31, 1))
    return 2e-3 * np.sin(angles).sum(axis=0), 2e-3 * (pulsations * np.cos(angles)).sum(axis=0)


def measured(position: Array, seed: int) -> Array:
    """Give the samples of a base, with a thousandth of noise."""
    samples = position[:-1:2]
    return np.asarray(samples + 1e-3 * samples.std() * np.random.default_rng(seed).standard_normal(samples.size))


def compare(found: tvident.MergedIdentification, truth: dict[str, float], within: float) -> None:
    """Assert that elements are right: within a part of themselves (springs and masses), and four of their standard errors."""
    assert set(found.elements) - set(found.terms) == set(truth)
    for name, true in truth.items():
        value, error = np.nanmedian(found.elements[name]), np.nanmedian(found.stderr[name])
        assert found.identifiable[name], name
        assert abs(value - true) < 4 * error, name
        if not name.startswith("damping"):
            assert abs(value / true - 1) < within, name


def test_a_drivetrain_with_an_elastic_joint() -> None:
    # Motor and load turn freely; both torques are measured.
    damping = np.array([[0.05, -0.01], [-0.01, 0.05]])
    drivetrain = coupled(still([[18.0, -18.0], [-18.0, 18.0]]), np.diag([0.01, 0.03]), damping, 4000, seed=2)
    structure = tvident.Chain(2, [(0, 1)], dampers=[("base", 0), (0, 1), ("base", 1)])
    found = identify(drivetrain.angle[0], drivetrain.torque[0], structure=structure, **OPTIONS)
    truth = {"inertia_0": 0.01, "inertia_1": 0.03, "stiffness_0_1": 18.0}
    compare(found, {**truth, "damping_base_0": 0.04, "damping_0_1": 0.01, "damping_base_1": 0.04}, 0.01)


def test_a_quarter_car_on_a_road() -> None:
    # kg, N s/m, N/m. No force is measured, and the body was weighed.
    tyre, spring, damper = 1.8e5, 2e4, 1.5e3
    position, velocity = road(3, 4000)
    car = coupled(
        still([[tyre + spring, -spring], [-spring, spring]]),
        np.diag([40.0, 300.0]),
        damper * np.array([[1.0, -1.0], [-1.0, 1.0]]),
        4000,
        seed=4,
        driven=(),
        base=(position, velocity),
    )
    structure = tvident.Chain(2, [("base", 0), (0, 1)], dampers=[(0, 1)], base=measured(position, 5))
    found = identify(car.angle[0], car.torque[0], structure=structure, inertia={1: 300.0}, **OPTIONS)
    assert found.kinds["inertia_1"] == "known"
    del found.elements["inertia_1"]
    compare(found, {"inertia_0": 40.0, "damping_0_1": damper, "stiffness_base_0": tyre, "stiffness_0_1": spring}, 0.01)


def test_a_series_elastic_actuator() -> None:
    # A motor with a measured torque moves a link by a spring, against the spring of what it touches.
    damping = np.array([[0.04, -0.01], [-0.01, 0.03]])
    actuator = coupled(still([[18.0, -18.0], [-18.0, 30.0]]), np.diag([0.01, 0.03]), damping, 4000, seed=1, driven=(0,))
    structure = tvident.Chain(2, [(0, 1), ("base", 1)], dampers=[("base", 0), (0, 1), ("base", 1)])
    found = identify(actuator.angle[0], actuator.torque[0], structure=structure, **OPTIONS)
    truth = {"inertia_0": 0.01, "inertia_1": 0.03, "stiffness_0_1": 18.0, "stiffness_base_1": 12.0}
    compare(found, {**truth, "damping_base_0": 0.03, "damping_0_1": 0.01, "damping_base_1": 0.02}, 0.01)


def test_what_a_force_on_one_mass_leaves_open_is_flagged() -> None:
    # Two masses on one moving base that do not touch: the second equation holds for any multiple of its elements.
    position, velocity = road(6, 4000)
    apart = coupled(
        still([[12.0, 0.0], [0.0, 18.0]]),
        np.diag([0.02, 0.03]),
        np.diag([0.03, 0.02]),
        4000,
        seed=6,
        driven=(0,),
        base=(position, velocity),
    )
    structure = tvident.Chain(2, [("base", 0), ("base", 1)], base=measured(position, 7))
    found = identify(apart.angle[0], apart.torque[0], structure=structure, **OPTIONS)
    of_second = ("inertia_1", "damping_base_1", "stiffness_base_1", "offset_1")
    for name in found.elements:
        assert bool(found.identifiable[name]) == (name not in of_second), name
    for name in of_second:
        assert "no force acts on mass 1: its equation is known up to scale only" in found.identifiable[name].reason
        assert np.isnan(found.elements[name]).all()
        assert found.kinds[name] == "unknown"
        assert name not in found.constants
    assert "inertia_1 and 3 more cannot be known" in found.summary().splitlines()[0]
    assert abs(found.value("stiffness_base_0").value / 12 - 1) < 0.015
    weighed = identify(apart.angle[0], apart.torque[0], structure=structure, inertia={1: 0.03}, **OPTIONS)
    assert all(weighed.identifiable.values())
    assert abs(weighed.value("stiffness_base_1").value / 18 - 1) < 0.015


def test_few_unknowns_survive_noise_where_full_matrices_do_not() -> None:
    # A tenth of the angles is noise. Seeds 1 to 8, the same test functions: chains 0.3 to 1.6 %, full matrices 1 to 16 %.
    squares: dict[str, list[float]] = {"chain": [], "full": []}
    form = tvident.WeakForm(window_length=201, exponent=8)
    for seed in range(1, 4):
        row = chain([constant(12.0), constant(18.0), constant(18.0)], 3000, seed=seed, angle_noise=0.1)
        true = matrices(row)[1][:, :, 0]
        for name, structure in (("chain", tvident.Chain(3, springs(3))), ("full", None)):
            found = identify(row.angle, row.torque, structure=structure, method=form, **CONSTANTS, **OPTIONS)
            squares[name].append(float(np.mean((found.stiffness[:, :, 0] - true) ** 2) / np.mean(true**2)))
    assert max(squares["chain"]) < 0.02**2
    assert np.mean(squares["full"]) > 0.05**2


EQUAL = 0.025, 16.0
"""Inertia of each of three masses, and stiffness of the springs between them."""


def test_tied_entries_are_one_unknown() -> None:
    inertia, spring = EQUAL
    stiffness = [[2 * spring, -spring, 0.0], [-spring, 2 * spring, -spring], [0.0, -spring, spring]]
    damping = 0.03 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    row = coupled(still(stiffness), np.diag([inertia] * 3), damping, 4000, seed=8)
    tied = [[(0, 0), (1, 1)], [(0, 1), (1, 0), (1, 2), (2, 1)]]
    apart: dict[tuple[int, int], float] = {(0, 2): 0.0, (2, 0): 0.0}
    given = {
        "inertia": tvident.Matrix("diagonal", "constant", tied=[[(0, 0), (1, 1), (2, 2)]]),
        "damping": tvident.Matrix("full", "constant", entries=apart, tied=tied),
        "stiffness": tvident.Matrix("full", "constant", entries=apart, tied=tied),
    }
    found = identify(row.angle[0], row.torque[0], **given, **OPTIONS)
    free = {name: tvident.Matrix("diagonal" if name == "inertia" else "full", "constant") for name in given}
    alone = identify(row.angle[0], row.torque[0], **free, **OPTIONS)
    unknowns = [name for name in found.constants if found.kinds[name] == "constant" and "offset" not in name]
    assert unknowns == [
        "inertia_0_0",
        *(f"{of}_{entry}" for of in ("damping", "stiffness") for entry in ("0_0", "0_1", "2_2")),
    ]
    expected = np.asarray(stiffness)
    np.testing.assert_array_equal(found.stiffness[:, :, 0] == found.stiffness[0, 1, 0], expected == -spring)
    np.testing.assert_array_equal(found.stiffness[:, :, 0] == found.stiffness[0, 0, 0], expected == 2 * spring)
    assert (found.stiffness[[0, 2], [2, 0]] == 0).all()
    for name, true in zip(
        ("inertia_0_0", "stiffness_0_0", "stiffness_0_1", "stiffness_2_2"), (inertia, 32, -16, 16), strict=True
    ):
        value, error = found.constants[name]
        assert abs(value - true) < 4 * error, name
        assert abs(value / true - 1) < 0.01, name
        # What several entries say is known better than what each of them says.
        assert error < alone.constants[name][1], name


@pytest.mark.parametrize("tied", [[[(0, 1), (0, 0)]], [[(1, 0), (0, 0)]], [[(0, 0), (1, 0)]]])
def test_ties_of_a_symmetric_matrix_hold_for_both_of_its_halves(tied: Any) -> None:
    angle, torque = np.random.default_rng(0).standard_normal((2, 2, 900))
    stiffness = tvident.Matrix("symmetric", "constant", tied=tied)
    found = identify(angle, torque, inertia="constant", damping="constant", stiffness=stiffness, **OPTIONS)
    np.testing.assert_array_equal(found.stiffness[0, 1], found.stiffness[1, 0])
    np.testing.assert_array_equal(found.stiffness[0, 1], found.stiffness[0, 0])


def test_an_entry_is_tied_once() -> None:
    with pytest.raises(ValueError, match="tied once"):
        tvident.Matrix(tied=[[(0, 0), (1, 1)], [(1, 1), (0, 1)]])
    with pytest.raises(ValueError, match="tied once"):
        tvident.Matrix("symmetric", tied=[[(0, 0), (0, 1)], [(1, 0), (1, 1)]])


@pytest.mark.parametrize("entry", [(0, 1), (1, 0)])
@pytest.mark.parametrize("value", ["windowed", -18.0])
def test_an_entry_of_a_symmetric_matrix_is_its_mirror_image(entry: tuple[int, int], value: Any) -> None:
    found = tvident.Matrix("symmetric", "constant", entries={entry: value}).elements("stiffness", 2)
    assert [one.name for one in found] == ["stiffness_0_0", "stiffness_0_1", "stiffness_1_1"]
    assert found[1].value == value
    assert found[1].entries == ((0, 2, 1, 1.0), (1, 2, 0, 1.0))
    both = tvident.Matrix("symmetric", "constant", entries={(0, 1): value, (1, 0): value}).elements("stiffness", 2)
    assert both == found
    with pytest.raises(ValueError, match=r"must be what its mirror image is; got .*; give one of them"):
        tvident.Matrix("symmetric", entries={entry: "constant", entry[::-1]: value})
    # Of a full matrix they are two.
    assert len(tvident.Matrix("full", entries={entry: value}).elements("stiffness", 2)) == 4


def test_a_base_that_says_its_unit_is_converted() -> None:
    """It was taken in the unit of the angle: a base in m beside positions in mm was a thousandth of itself."""
    masses = chain([lambda t: 12 + 0 * t], 3000, seed=8, driven=(0,), base=True)
    base = np.asarray(masses.base)
    given: dict[str, Any] = {"sample_rate": 1000, "dof_axis": 0, "angle_unit": "mm", "torque_unit": "N"}

    def found(moving: Any) -> Any:
        structure = tvident.Chain(1, [("base", 0)], base=moving)
        return identify(1e3 * masses.angle, masses.torque, structure=structure, **given).constants["stiffness_base_0"]

    plain = found(1e3 * base)
    assert plain[0] == pytest.approx(12, rel=0.01)
    assert found(tvident.Channel(base, "m")) == pytest.approx(plain, rel=1e-9)
    assert found(tvident.Channel(1e3 * base, "mm")) == pytest.approx(plain, rel=1e-9)
    with pytest.raises(ValueError, match="the base must be in a unit that can be converted to m; got 'V'"):
        found(tvident.Channel(base, "V"))
    labelled = pd.Series(base)
    labelled.attrs["units"] = "m"
    with pytest.raises(ValueError, match="where only an attribute says 'm'"):
        found(labelled)
    with pytest.raises(ValueError, match="where only its name says 'm'"):
        found(pd.Series(base, name="base [m]"))
    for name in ("base [mm]", "base [V]", "base"):
        assert found(pd.Series(1e3 * base, name=name)) == pytest.approx(plain, rel=1e-9)


def test_a_base_of_pint_is_converted_without_a_warning() -> None:
    """NumPy took its numbers, and pint warned that their unit was lost."""
    pint = pytest.importorskip("pint")
    unit = pint.UnitRegistry()
    masses = chain([lambda t: 12 + 0 * t], 3000, seed=8, driven=(0,), base=True)
    given: dict[str, Any] = {"sample_rate": 1000, "dof_axis": 0, "angle_unit": "mm", "torque_unit": "N"}
    base, found = np.asarray(masses.base), []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for moving in (1e3 * base, base * unit.m, 1e3 * base * unit.mm):
            structure = tvident.Chain(1, [("base", 0)], base=moving)
            result = identify(1e3 * masses.angle, masses.torque, structure=structure, **given)
            found.append(result.constants["stiffness_base_0"])
    assert found[1] == pytest.approx(found[0], rel=1e-9)
    assert found[2] == pytest.approx(found[0], rel=1e-9)


def test_none_says_nothing_of_one_of_several() -> None:
    record = chain([lambda t: 12 + 0 * t, lambda t: 18 + 0 * t], 3000, seed=53100)
    both = tvident.Chain(masses=2, springs=[("base", 0), (0, 1)], dampers=[("base", 0), (0, 1)])
    options: dict[str, Any] = {"sample_rate": 1000, "dof_axis": 0, "structure": both}
    some = tvident.identify(record.angle, record.torque, **options, inertia=[0.02, None])
    same = tvident.identify(record.angle, record.torque, **options, inertia={0: 0.02})
    assert some.constants == same.constants


def test_what_must_be_finite_is_told_of_a_policy_that_there_is() -> None:
    record = chain([lambda t: 12 + 0 * t], 1000, seed=53101)
    angle = record.angle.copy()
    angle[0, 5] = np.nan
    with pytest.raises(ValueError, match="use nan_policy='omit'"):
        tvident.identify(angle, record.torque, sample_rate=1000, dof_axis=0, nan_policy="raise")
