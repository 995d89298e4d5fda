"""Simulation of what was identified: the response, its beginning, gaps, and how much of a recorded angle it accounts for."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from reference.response import response
from tvident import _core

Array = npt.NDArray[np.float64]

INTEGRATED = 1e-7
"""Both integrators control their error to 1e-9 or less in a step, and errors of some hundred steps add up."""


@pytest.fixture(scope="module")
def rig() -> tvident.Recording:
    return tvident.simulate_torsional_rig(duration=6.0, seed=4)


@pytest.fixture(scope="module")
def result(rig: tvident.Recording) -> tvident.Identification:
    return tvident.identify(rig.angle, rig.torque, sample_rate=1000)


def sine(_t: Array, angle: Array, _velocity: Array) -> Array:
    return np.sin(angle)


def square(_t: Array, _angle: Array, velocity: Array) -> Array:
    return velocity * np.abs(velocity)


def jump(_t: Array, angle: Array, _velocity: Array) -> Array:
    return np.sign(angle)


def pendulum(seed: int = 0, *, noise: float = 1e-4) -> tuple[Array, Array]:
    """Give angle and torque of a driven pendulum at 200 Hz: 0.1 θ̈ + 0.05 θ̇ + 2 sin θ."""
    generator = np.random.default_rng(seed)
    t = np.arange(2000) / 200
    torque = sum(
        generator.uniform(0.2, 0.5) * np.sin(2 * np.pi * f * t + generator.uniform(0, 6)) for f in (0.3, 0.5, 1.1)
    )
    still: Array = np.zeros(t.size)
    column = [np.full(t.size, value) for value in (0.1, 0.05, 0.0)]
    angle = response(column, still, np.full(t.size, 2.0), np.asarray(torque), 1 / 200, (0.2, 0.0))
    return angle + noise * generator.standard_normal(t.size), np.asarray(torque)


@pytest.mark.parametrize("terms", [(0.0, 0.0), (40.0, 0.0), (0.0, 3.0), (-2.0, 1.0), (0.0, -8.0)], ids=str)
def test_the_response_is_that_of_the_equation(terms: tuple[float, float]) -> None:
    generator = np.random.default_rng(7)
    n, delta = 150, 0.01
    inertia, damping, stiffness = (mean * (1 + 0.3 * np.sin(np.linspace(0, 5 + mean, n))) for mean in (0.02, 0.05, 6.0))
    cubic, gravity = (np.linspace(0.5, 1, n) * value for value in terms)
    torque = np.cumsum(generator.standard_normal(n)) * 0.1
    expected = response([inertia, damping, stiffness], cubic, gravity, torque, delta, (0.1, -2.0))
    found = _core.respond(
        [inertia, damping, stiffness],
        [("cubic", cubic), ("gravity", gravity)],
        torque,
        delta=delta,
        lag=[0.0],
        bridged=0,
        initial=[[0.1, -2.0]],
    )
    np.testing.assert_allclose(found.angle[0], expected, atol=INTEGRATED * np.abs(expected).max(), rtol=0)


@pytest.mark.slow
def test_an_identified_rig_explains_its_angle_and_a_recording_it_has_not_seen(
    rig: tvident.Recording, result: tvident.Identification
) -> None:
    assert result.vaf() > 99.9
    assert result.vaf(rig.angle, rig.torque) == result.vaf()
    simulated = result.simulate(rig.torque)
    assert simulated.shape == rig.angle.shape
    assert 100 * (1 - np.var(rig.angle - simulated) / np.var(rig.angle)) == pytest.approx(result.vaf(), abs=1e-9)
    np.testing.assert_array_equal(result.simulate(rig.torque, angle=rig.angle), simulated)
    angle, torque = pendulum(1)
    model = tvident.identify(
        angle, torque, sample_rate=200, stiffness=0, terms=["gravity"], inertia="constant", damping="constant"
    )
    assert model.vaf() > 99.99
    assert model.vaf(*pendulum(2)) > 99.9
    assert model.vaf(*(channel[:500] for channel in pendulum(3))) > 99.9


def test_the_initial_state_is_given_or_that_of_the_record(rig: tvident.Recording) -> None:
    result = tvident.identify(
        rig.angle, rig.torque, sample_rate=1000, inertia="constant", damping="constant", stiffness="constant"
    )
    whole = result.simulate(rig.torque)
    speed = (whole[1] - whole[0]) * 1000
    near = result.simulate(rig.torque, (whole[0], speed))
    assert np.abs(near - whole).max() < 0.05 * np.abs(whole).max()
    # Another torque begins where the record began.
    nothing = result.simulate(np.zeros(300))
    assert nothing[0] == pytest.approx(whole[0], rel=1e-9)
    assert np.ptp(nothing[-50:]) < 2 * np.ptp(whole)


def test_terms_of_ones_own_are_simulated_like_built_in_ones() -> None:
    angle, torque = pendulum(5)
    call: dict[str, Any] = {"sample_rate": 200, "stiffness": 0, "inertia": "constant", "damping": "constant"}
    built_in = tvident.identify(angle, torque, terms=["gravity"], **call)
    own = tvident.identify(angle, torque, terms=[tvident.Term("weight", sine)], **call)
    drag = tvident.Term("drag", square)
    both = tvident.identify(angle, torque, terms=["gravity", drag], **call)
    assert own.vaf() == pytest.approx(built_in.vaf(), abs=0.01)
    assert both.vaf() == pytest.approx(built_in.vaf(), abs=0.01)
    assert own.held_back().simulated == pytest.approx(built_in.held_back().simulated, abs=0.1)
    step = tvident.Term("step", jump)
    stored = pickle.loads(pickle.dumps(own))  # noqa: S301 - its own
    with pytest.raises(ValueError, match=r"'weight' was not stored.*identify again"):
        stored.vaf(angle, torque)
    assert isinstance(tvident.identify(angle, torque, terms=["gravity", step], **call).held_back().why_not, str)


def test_short_gaps_are_bridged_and_long_ones_are_nan(rig: tvident.Recording) -> None:
    n = rig.angle.size
    stiffness = np.array(rig.stiffness)
    result = tvident.identify(
        rig.angle, rig.torque, sample_rate=1000, stiffness=stiffness, inertia=rig.inertia, damping="constant"
    )
    whole = result.simulate(rig.torque, angle=rig.angle)
    length = result.settings["window_length"]
    result.stiffness = stiffness.copy()
    result.stiffness[2000 : 2000 + length // 4] = np.nan
    result.stiffness[4000 : 4000 + length + 1] = np.nan
    gap = result.simulate(rig.torque, angle=rig.angle)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(gap)), np.arange(4000, 4000 + length + 1))
    assert np.nanmax(np.abs(gap - whole)) < 0.2 * np.abs(whole).max()
    torque = rig.torque.copy()
    torque[1000:1003], torque[3000:3004] = np.nan, np.nan
    result.stiffness = stiffness
    gap = result.simulate(torque, angle=rig.angle)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(gap)), np.arange(3000, 3004))
    # Nothing tells the state behind a gap.
    assert np.isnan(result.simulate(torque, (0.0, 0.0))[3000:]).all()
    assert np.isfinite(gap).sum() == n - 4


def test_a_late_torque_is_moved_back_and_its_end_is_unknown() -> None:
    rig = tvident.simulate_torsional_rig(duration=6.0, seed=4)
    late = np.concatenate([np.full(5, rig.torque[0]), rig.torque[:-5]])
    result = tvident.identify(rig.angle, late, sample_rate=1000, lag=0.005)
    simulated = result.simulate(late)
    assert np.isnan(simulated[-5:]).all()
    assert np.isfinite(simulated[:-5]).all()
    assert result.vaf() > 99.9


def test_records_of_a_batch_are_simulated_on_their_own(rig: tvident.Recording) -> None:
    angle = np.stack([rig.angle[:4000], rig.angle[1000:5000]])[:, np.newaxis].astype(np.float32)
    torque = np.stack([rig.torque[:4000], rig.torque[1000:5000]])[:, np.newaxis]
    both = tvident.identify(angle, torque, sample_rate=1000)
    assert both.simulate(torque).shape == angle.shape
    assert both.vaf().shape == (2, 1)
    assert both.held_back().simulated.shape == (2, 1)
    alone = tvident.identify(angle[1, 0], torque[1, 0], sample_rate=1000)
    assert both.vaf()[1, 0] == pytest.approx(alone.vaf(), rel=1e-12)
    assert "(median of all records)" in both.summary().splitlines()[1]
    with pytest.raises(ValueError, match=r"torque must have a record for each.*shape \(4000,\)"):
        both.simulate(torque[0, 0])


def test_what_cannot_be_simulated_is_refused_with_the_rule(
    rig: tvident.Recording, result: tvident.Identification
) -> None:
    with pytest.raises(ValueError, match=r"record's 6000 samples where parameters change.*got 100.*identify stiffness"):
        result.simulate(rig.torque[:100])
    with pytest.raises(ValueError, match=r"initial must be a finite angle and velocity"):
        result.simulate(rig.torque, (1.0, np.nan))
    with pytest.raises(ValueError, match=r"got both; drop one"):
        result.simulate(rig.torque, (1.0, 0.0), angle=rig.angle)
    with pytest.raises(ValueError, match=r"got only one of them"):
        result.vaf(rig.angle)
    with pytest.raises(ValueError, match=r"same shape; got \(5999,\) and \(6000,\)"):
        result.vaf(rig.angle[1:], rig.torque)
    unstable = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    unstable.stiffness = np.full(rig.angle.size, -1e4)
    with pytest.raises(ValueError, match=r"is lost after .* s, since the identified system is unstable"):
        unstable.simulate(rig.torque, (1.0, 0.0))
    light: dict[str, Any] = {"sample_rate": 1000, "inertia": 0, "stiffness": "constant"}
    for term in ("coulomb", "viscous_asymmetric"):
        friction = tvident.identify(rig.angle, rig.torque, damping="constant", terms=[term], **light)
        with pytest.raises(ValueError, match=rf"without inertia must be linear.*got {term}; give it an inertia"):
            friction.simulate(rig.torque)
    spring = tvident.identify(rig.angle, rig.torque, damping=0, terms=(), **light)
    np.testing.assert_allclose(spring.simulate(rig.torque), rig.torque / spring.stiffness[0], rtol=1e-12)


@pytest.mark.slow
def test_a_result_knows_its_record_only_as_long_as_it_is_there(rig: tvident.Recording) -> None:
    angle, torque = rig.angle.copy(), rig.torque.copy()
    result = tvident.identify(angle, torque, sample_rate=1000, stiffness="constant")
    again = pickle.loads(pickle.dumps(result))  # noqa: S301 - its own
    assert again.summary() == result.summary()
    with pytest.raises(ValueError, match=r"stored without it; give angle= and torque="):
        again.vaf()
    assert again.vaf(angle, torque) == result.vaf()
    known = result.held_back()
    angle[:] = angle[::-1]
    assert result.held_back() is known
    with pytest.raises(ValueError, match=r"hold other samples by now"):
        result.simulate(torque)
    changed = tvident.identify(angle, torque, sample_rate=1000, stiffness="constant")
    angle *= 2
    assert "hold other samples by now" in changed.summary().splitlines()[1]


def test_a_part_that_was_held_back_tells_a_good_model_from_a_bad_one(
    rig: tvident.Recording, result: tvident.Identification
) -> None:
    good = result.held_back()
    assert good.simulated > 99.5
    assert good.predicted > good.simulated
    assert good.parts == 10
    constant: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
    bad = tvident.identify(rig.angle, rig.torque, sample_rate=1000, **constant).held_back()
    assert bad.simulated < 90 < bad.predicted < good.predicted
    first = result.summary().splitlines()[1]
    assert first.startswith("explains 99.")
    assert good.ahead == result.settings["window_length"] / 1000
    assert (
        f"predicted one test function ahead ({1000 * good.ahead:.0f} ms) in the last tenth of every tenth, held back"
        in first
    )
    paper = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper").held_back()
    assert paper.parts < 10
    assert paper.simulated > 90


ALIKE = 1.0
"""Percent of the variance that the same samples may be explained by differently: constants are those of 59 s or of 590 s."""


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("stiffness", ["constant", "windowed"])
def test_a_long_record_is_told_by_stretches_of_it(stiffness: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    long = tvident.simulate_torsional_rig(660.0, pattern="ramp" if stiffness == "windowed" else "constant", seed=5)
    result = tvident.identify(long.angle, long.torque, sample_rate=1000, stiffness=stiffness)
    found = result.held_back()
    assert found.stretch == 32.768
    assert "in a tenth of the last 32.8 s of every tenth, held back from the fit" in found.words()
    assert (found.parts, found.ahead) == (10, result.settings["window_length"] / 1000)
    # The same samples, held back from a fit to all the others.
    tenth = round(32_768 / 10)
    parts = [(end - 66_000, end - 2 * tenth, end - tenth) for end in range(66_000, 660_001, 66_000)]
    monkeypatch.setattr("tvident._results.simulated.ends_of_stretches", lambda *_: [])
    monkeypatch.setattr("tvident._results.simulated.parts_of", lambda *_: parts)
    result._held_back = None  # noqa: SLF001 - what is tested
    whole = result.held_back()
    assert not np.isfinite(whole.stretch)
    for name in ("simulated", "predicted", "steady"):
        assert getattr(found, name) == pytest.approx(getattr(whole, name), abs=ALIKE)


@pytest.mark.slow
def test_stretches_tell_of_a_spring_that_is_relaxed_at_another_angle() -> None:
    """The whole was identified once more, and less of it foreseen over longer gaps."""
    rig = tvident.simulate_torsional_rig(800.0, seed=5, pattern="slider", angle_noise=1e-3)
    about_zero = tvident.identify(rig.angle, rig.torque, sample_rate=1000).held_back()
    moved = tvident.identify(rig.angle + 0.6 * rig.angle.std(), rig.torque, sample_rate=1000)
    assert "angle_zero" in moved.constants
    assert moved.held_back().stretch == about_zero.stretch
    assert moved.held_back().predicted == pytest.approx(about_zero.predicted, abs=0.1)


@pytest.mark.slow
def test_a_long_record_whose_stretches_are_lost_is_told_by_all_of_it() -> None:
    long = tvident.simulate_torsional_rig(660.0, pattern="constant", seed=5)
    angle = long.angle.copy()
    angle[66_000 - 32_768 : 66_000 - 6_600] = np.nan
    found = tvident.identify(angle, long.torque, sample_rate=1000, stiffness="constant").held_back()
    assert found.predicted > 99
    angle[:] = np.nan
    angle[:20_000] = long.angle[:20_000]
    lost = tvident.identify(angle, long.torque, sample_rate=1000, stiffness="constant").held_back()
    assert "no sample that was held back has an angle" in lost.why_not


def test_noise_that_no_model_explains_is_not_explained() -> None:
    generator = np.random.default_rng(3)
    angle, torque = generator.standard_normal((2, 4000))
    result = tvident.identify(
        angle, torque, sample_rate=1000, inertia="constant", damping="constant", stiffness="constant"
    )
    held = result.held_back()
    assert held.why_not or held.predicted < 10


def test_the_record_is_not_copied(rig: tvident.Recording, result: tvident.Identification) -> None:
    recorded = result._recorded  # noqa: SLF001 - what is tested
    assert recorded is not None
    assert np.shares_memory(recorded.angles, rig.angle)


def test_a_stored_result_of_some_samples_takes_the_record_that_it_was_found_in(tmp_path: Path) -> None:
    """It wanted the samples up to the last that has a result, 3951 of 4000."""
    rig = tvident.simulate_torsional_rig(duration=4.0)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, step=50)
    result.save(tmp_path / "some.npz")
    stored = tvident.load(tmp_path / "some.npz")
    assert stored.vaf(angle=rig.angle, torque=rig.torque) == result.vaf()
    assert stored.vaf(angle=rig.angle[:3951], torque=rig.torque[:3951]) > 99.9
    with pytest.raises(ValueError, match=r"record.s 3951 samples .* got 3950"):
        stored.vaf(angle=rig.angle[:3950], torque=rig.torque[:3950])
