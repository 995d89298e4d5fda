"""Repeated trials that share their parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import tvident
from merged.simulated import Trials, coupled, simulated
from parameters import examples, long
from reference import merged as reference

Array = npt.NDArray[np.float64]

identify: Any = tvident.identify
"""Its type is that of a single record."""

OPTIONS: dict[str, Any] = {"sample_rate": 1000, "ensemble_axis": 0}


@settings(max_examples=examples(8))
@given(
    seed=st.integers(0, 2**31),
    lengths=st.lists(st.integers(300, 700), min_size=2, max_size=4),
    half=st.integers(12, 25),
    gap=st.booleans(),
)
def test_constants_are_those_of_the_rows_of_all_trials(seed: int, lengths: list[int], half: int, *, gap: bool) -> None:
    rng = np.random.default_rng(seed)
    angles, torques = [], []
    for samples in lengths:
        trial = simulated(1, samples, lambda t: 15 + 0 * t, seed=int(rng.integers(2**31)), angle_noise=1e-2)
        angles.append(trial.angle[0])
        torques.append(trial.torque[0])
    if gap:
        angles[0][100:103] = np.nan
    form = tvident.WeakForm(window_length=2 * half + 1, exponent=8)
    found = identify(
        angles, torques, method=form, stiffness="constant", inertia="constant", damping="constant", **OPTIONS
    )
    names = ["inertia", "damping", "stiffness", "offset"]
    # Of noisy short trials nothing may be known.
    assume(set(names) <= set(found.constants))
    elements: list[list[reference.Entry]] = [[(0, place, 0, 1.0)] for place in range(3)]
    elements.append([(0, None, 0, 1.0)])
    trials = [(angle[np.newaxis], torque[np.newaxis]) for angle, torque in zip(angles, torques, strict=True)]
    noise = found.settings["noise"][0]
    expected = reference.constants(trials, elements, (half, 8), 1e-3, noise)
    errors = np.array([found.constants[name][1] for name in names])
    # The same normal equations, solved through factors here and squared there: rounding times the square of a condition number of 1e3.
    np.testing.assert_allclose(
        [found.constants[name][0] for name in names], expected, rtol=1e-8, atol=float(1e-6 * errors.max())
    )


def rms(found: Array, true: Array) -> float:
    return float(np.sqrt(np.nanmean((found - true) ** 2)) / np.mean(true))


def within_20_ms(values: Array, before: float, after: float) -> bool:
    """Whether a step is followed, 10 to 90 %, within 20 samples."""
    part = (values - before) / (after - before)
    last_low, first_high = np.flatnonzero(part < 0.1)[-1], np.flatnonzero(part > 0.9)[0]
    return bool(first_high - last_low <= 20)


@pytest.mark.slow
def test_short_trials_together_follow_what_none_could() -> None:
    trials = simulated(50, 500, lambda t: np.where(t < 0.2465, 12.0, 18.0), seed=3)
    found = identify(trials.angle, trials.torque, **OPTIONS)
    assert found.stiffness.shape == (500,)
    assert rms(found.stiffness, trials.stiffness) < 0.03
    assert within_20_ms(found.stiffness, 12.0, 18.0)
    for name, true in (("inertia", trials.inertia), ("damping", trials.damping)):
        value, error = found.constants[name]
        assert abs(value - true) < 4 * error
        assert error < 0.05 * true
    smooth = simulated(50, 500, lambda t: 15 + 4 * np.sin(4 * np.pi * t), seed=4)
    found = identify(smooth.angle, smooth.torque, **OPTIONS)
    assert rms(found.stiffness, smooth.stiffness) < 0.03
    inside = np.abs(found.stiffness - smooth.stiffness) < 2 * found.stderr["stiffness"]
    assert inside[found.status == 0].mean() > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4016, 4000, *long(4018, 4028, 4039, 4048)])
def test_windows_end_at_a_jump_when_their_length_is_chosen(seed: int) -> None:
    # Lengths were compared across a jump that had just been found: of 60 records 47 had the shortest, and of five an offset was said to
    # change.
    at = np.random.default_rng(seed).uniform(0.15, 0.35)
    trials = simulated(50, 500, lambda t: np.where(t < at, 12.0, 18.0), seed=seed)
    found = identify(trials.angle, trials.torque, **OPTIONS)
    assert not found.record_status
    assert not found.advice
    (jump,) = found.jumps
    assert abs(jump - at) < 0.003
    assert rms(found.stiffness, trials.stiffness) < 0.03


def test_errors_shrink_with_the_root_of_the_number_of_trials() -> None:
    trials = simulated(10, 2000, lambda t: 15 + 0 * t, seed=5)
    form = tvident.WeakForm(window_length=61, exponent=8, regression_window=400)
    all_together = identify(trials.angle, trials.torque, method=form, inertia="constant", damping="constant", **OPTIONS)
    each = [
        identify(angle[np.newaxis], torque[np.newaxis], method=form, inertia="constant", damping="constant", **OPTIONS)
        for angle, torque in zip(trials.angle, trials.torque, strict=True)
    ]
    for name in ("inertia", "damping", "stiffness"):
        single = np.median([np.nanmedian(one.stderr[name]) for one in each])
        assert np.nanmedian(all_together.stderr[name]) * 10**0.5 == pytest.approx(single, rel=0.15), name
    actual = [np.nanmean((one.stiffness - 15) ** 2) for one in (all_together, *each)]
    assert (actual[0] / np.mean(actual[1:])) ** 0.5 < 0.6


def coloured(rng: np.random.Generator, shape: tuple[int, ...], correlation: float) -> Array:
    """Give first-order noise of variance one."""
    noise = rng.standard_normal(shape)
    for sample in range(1, shape[-1]):
        noise[..., sample] = correlation * noise[..., sample - 1] + (1 - correlation**2) ** 0.5 * noise[..., sample]
    return noise


@pytest.mark.parametrize(
    ("trials", "samples", "seeds"), [(1, 8000, range(2)), *long((1, 8000, range(8)), (10, 2000, range(8)))]
)
def test_coloured_noise_of_the_angle_is_taken_for_what_it_is(trials: int, samples: int, seeds: range) -> None:
    # With its variance at the highest frequencies alone, I and K were 5 to 8 % off and told to be known ten times better.
    inside = []
    for seed in seeds:
        simple = simulated(trials, samples, lambda t: 15 + 4 * np.sin(0.4 * np.pi * t), seed=seed, angle_noise=0.0)
        noise = coloured(np.random.default_rng(seed), simple.angle.shape, 0.9)
        angle = simple.angle + 1e-2 * simple.angle.std(axis=1, keepdims=True) * noise
        found = identify(angle, simple.torque, **OPTIONS)
        assert found.trusted.mean() > 0.9
        assert "of an angle is" in " ".join(found.reasons)
        for name in ("inertia", "stiffness"):
            true = getattr(simple, name)
            assert rms(found.elements[name], true) < 0.015, (name, seed)
            inside.append(np.mean(np.abs(found.elements[name] - true) < 1.96 * found.stderr[name]))
    assert np.mean(inside) > (0.9 if len(seeds) > 2 else 0.7)


@pytest.mark.parametrize(("given", "bound"), [(1, "at least"), (20_000, "at most")])
def test_a_window_that_there_is_not_is_refused(given: int, bound: str) -> None:
    rig = tvident.simulate_torsional_rig(duration=1.0, seed=1, angle_noise=1e-3)
    angles, torques = np.stack([rig.angle] * 3), np.stack([rig.torque] * 3)
    with pytest.raises(ValueError, match=f"regression_window must be {bound} about .* got {given}; use"):
        tvident.identify(
            angles, torques, sample_rate=1000, ensemble_axis=0, method=tvident.WeakForm(regression_window=given)
        )


@pytest.mark.parametrize(
    ("seed", "at"),
    [
        (3025, 3.117),
        *long((3053, 2.776), (1, 2.5), (2, 2.5), (3, 2.5), (3008, 3.166), (3027, 1.821), (3006, 1.568), (3029, 2.828)),
    ],
)
def test_steps_of_a_full_endpoint_stiffness_are_followed(seed: int, at: float) -> None:
    # kg, N s/m, N/m: an arm that holds a handle stiffens in every direction. Windows that only the longer side of the step held
    # predicted that side best, and the other side spoke against none: one element of three stayed constant, 7.7 % off.
    # In three of 36 no jump was found with windows that were at most 1.8 times as long as the shortest (3.16 % off).
    at_rest, step = np.array([[300.0, -80.0], [-80.0, 220.0]]), np.array([[40.0, -40.0], [-40.0, 40.0]])

    def stiffness(t: Array) -> Array:
        return np.asarray(at_rest[:, :, np.newaxis] + step[:, :, np.newaxis] * (t > at))

    inertia, damping = np.array([[1.5, 0.2], [0.2, 1.1]]), np.array([[15.0, 3.0], [3.0, 12.0]])
    trials = coupled(stiffness, inertia, damping, 5000, seed=seed, trials=10)
    symmetric = tvident.Matrix("symmetric")
    found = identify(
        trials.angle, trials.torque, inertia=symmetric, damping=symmetric, stiffness=symmetric, dof_axis=1, **OPTIONS
    )
    np.testing.assert_array_equal(found.stiffness[0, 1], found.stiffness[1, 0])
    for place in ((0, 0), (0, 1), (1, 1)):
        off = np.sqrt(np.mean((found.stiffness[place] - trials.stiffness[place]) ** 2))
        assert off < 0.03 * np.abs(trials.stiffness[place].mean()), place
    np.testing.assert_allclose(found.jumps, [at], atol=0.01)
    assert not found.record_status
    assert all(found.identifiable.values())


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "at"), [(15505, 3.302), *long((15502, 1.947), (15507, 1.953), (15512, 3.347))])
def test_entries_that_step_together_are_set_free_together(seed: int, at: float) -> None:
    # After the first was followed neither of the others explained a fifth alone, and no jump was seen beside them: both stayed
    # constant and up to 22 % off, though their parts differed (4 of 14 records).
    at_rest, step = np.array([[220.0, -60.0], [-60.0, 160.0]]), np.array([[40.0, 20.0], [20.0, -40.0]])

    def stiffness(t: Array) -> Array:
        return np.asarray(at_rest[:, :, np.newaxis] + step[:, :, np.newaxis] * (t > at))

    inertia, damping = np.array([[1.2, 0.2], [0.2, 0.9]]), np.array([[12.0, 2.0], [2.0, 10.0]])
    trials = coupled(stiffness, inertia, damping, 5000, seed=seed, trials=10, highest=15.0)
    constant, free = tvident.Matrix("symmetric", "constant"), tvident.Matrix("symmetric")
    found = identify(
        trials.angle, trials.torque, inertia=constant, damping=constant, stiffness=free, dof_axis=1, **OPTIONS
    )
    for place in ((0, 0), (0, 1), (1, 1)):
        off = np.sqrt(np.mean((found.stiffness[place] - trials.stiffness[place]) ** 2))
        assert off < 0.03 * np.abs(trials.stiffness[place].mean()), place
    np.testing.assert_allclose(found.jumps, [at], atol=0.01)
    assert not found.record_status & tvident.Status.KIND_CONTRADICTED


def test_trials_that_differ_are_said_to() -> None:
    alike = simulated(6, 1500, lambda t: 15 + 0 * t, seed=6)
    found = identify(alike.angle, alike.torque, **OPTIONS)
    assert not found.record_status & tvident.Status.KIND_CONTRADICTED
    values, errors = found.trial_spread["stiffness"]
    assert values.shape == errors.shape == (6,)
    assert np.all(np.abs(values) < 5 * errors)
    parts = [simulated(1, 1500, lambda t, k=k: k + 0 * t, seed=7 + place) for place, k in enumerate((13.0, 15.0, 17.0))]  # type: ignore[misc]
    different = [np.concatenate([getattr(part, name) for part in parts]) for name in ("angle", "torque")]
    found = identify(*different, **OPTIONS)
    assert found.record_status & tvident.Status.KIND_CONTRADICTED
    assert any("trials do not share stiffness" in line for line in found.advice)
    assert "trials do not share stiffness" in found.summary()
    assert "of the torque, averaged over the test function" in found.summary().splitlines()[1]


def test_trials_of_several_lengths_are_aligned_on_their_phase() -> None:
    rng = np.random.default_rng(8)
    angles, torques, phases = [], [], []
    for _ in range(20):
        samples = int(rng.integers(520, 680))
        phase = np.arange(samples) / samples

        def stiffness(t: Array, samples: int = samples) -> Array:
            return 15 + 4 * np.sin(2 * np.pi * t * 1000 / samples)

        trial: Trials = simulated(1, samples, stiffness, seed=int(rng.integers(2**31)))
        angles.append(trial.angle[0])
        torques.append(trial.torque[0])
        phases.append(phase)
    found = identify(angles, torques, phase=phases, **OPTIONS)
    assert found.phase is not None
    expected = 15 + 4 * np.sin(2 * np.pi * found.phase)
    assert rms(found.stiffness, expected) < 0.03
    unaligned = identify(angles, torques, **OPTIONS)
    assert rms(unaligned.stiffness, 15 + 4 * np.sin(2 * np.pi * unaligned.time * 1000 / 600)) > 0.03


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"phase": np.ones((3, 400))}, "grow"),
        ({"phase": np.ones((3, 300))}, "sample for every sample"),
        ({"phase": np.tile(np.linspace(0, 2 * np.pi, 400), (3, 1))}, "divide it by its period"),
        ({"lag": "auto"}, "not supported"),
        ({"instrument": np.ones((3, 400))}, "not supported"),
        ({"method": "paper"}, "WeakForm"),
        ({"dof_axis": 0}, "shape \\(trials, masses, n\\)"),
        ({"stiffness": "varying", "damping": tvident.Expansion("bspline")}, "stiffness='varying'; say"),
        ({"ensemble_axis": 1}, "ensemble_axis must be"),
        ({"structure": tvident.Chain(1, [("base", 0)])}, "dof_axis"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_cure(options: dict[str, Any], message: str) -> None:
    trials = simulated(3, 400, lambda t: 15 + 0 * t, seed=9)
    with pytest.raises(ValueError, match=message):
        identify(trials.angle, trials.torque, **{**OPTIONS, **options})


@pytest.mark.parametrize("more", [{}, {"dof_axis": 1, "structure": tvident.Chain(1, [("base", 0)])}])
def test_a_trial_without_an_acceleration_is_refused(more: dict[str, Any]) -> None:
    rig = tvident.simulate_torsional_rig(duration=1.0, seed=1)
    angles, torques = ([one, one[:2]] for one in (rig.angle, rig.torque))
    if more:
        angles, torques = ([one[None] for one in each] for each in (angles, torques))
    with pytest.raises(ValueError, match="trials must hold at least 3 samples each; got one of 2; leave it out"):
        tvident.identify(angles, torques, sample_rate=1000, ensemble_axis=0, **more)


def test_a_trial_of_which_nothing_is_left_is_named() -> None:
    """A dead channel counted as one of the trials, without a word."""
    rigs = [tvident.simulate_torsional_rig(duration=1.0, seed=seed) for seed in range(4)]
    angle, torque = np.stack([rig.angle for rig in rigs]), np.stack([rig.torque for rig in rigs])
    call: dict[str, Any] = {"sample_rate": 1000, "ensemble_axis": 0}
    assert not any("tells nothing" in line for line in tvident.identify(angle, torque, **call).advice)
    angle[2] = np.nan
    found = tvident.identify(angle, torque, **call)
    assert "trial 2 tells nothing: its samples are missing" in found.summary()
    with pytest.raises(TypeError, match="settings must be those of one record; got those of trials or masses"):
        tvident.identify(angle[0], torque[0], sample_rate=1000, settings=found.settings)
    angle[1] = np.nan
    words = "trials 1, 2 tell nothing: their samples are missing, or nothing moves there; check the channels, or leave them out"
    assert words in tvident.identify(angle, torque, **call).advice


def test_trials_without_an_angle_dilute_no_noise() -> None:
    """Noise of the angle was the mean over all trials: errors were 1.3 times those of the trials that there are."""
    trials = simulated(12, 2000, lambda t: 12 + 4 * np.sin(np.pi * t), seed=71800)
    angle = trials.angle.copy()
    angle[2:] = np.nan
    found = identify(angle, trials.torque, sample_rate=1000, ensemble_axis=0)
    alone = identify(trials.angle[:2], trials.torque[:2], sample_rate=1000, ensemble_axis=0)
    for name in ("inertia", "damping"):
        assert found.constants[name][1] == pytest.approx(alone.constants[name][1], rel=0.05)


def test_every_trial_may_have_its_own_mask() -> None:
    """Masks were refused as float64, which they were turned into."""
    rigs = [tvident.simulate_torsional_rig(duration=1.0, seed=seed) for seed in range(4)]
    angles, torques = [rig.angle for rig in rigs], [rig.torque for rig in rigs]
    mask = np.ones((4, 1000), np.bool_)
    mask[:, 300:340] = False
    np.testing.assert_array_equal(
        identify(angles, torques, mask=mask, **OPTIONS).stiffness,
        identify(angles, torques, mask=mask[0], **OPTIONS).stiffness,
    )
    mask[2] = False
    wrong = [*torques[:2], torques[2] + 5, torques[3]]
    found = identify(angles, wrong, mask=mask, **OPTIONS).stiffness
    for same in (mask, list(mask), mask.tolist(), list(mask[..., np.newaxis])):
        np.testing.assert_allclose(identify(angles, torques, mask=same, **OPTIONS).stiffness, found, rtol=1e-12)
    lengths = [1000, 900, 950, 1000]
    angles, torques, wrong = (
        [one[:length] for one, length in zip(each, lengths, strict=True)] for each in (angles, torques, wrong)
    )
    masks = [one[:length] for one, length in zip(mask, lengths, strict=True)]
    np.testing.assert_allclose(
        identify(angles, torques, mask=masks, **OPTIONS).stiffness,
        identify(angles, wrong, mask=masks, **OPTIONS).stiffness,
        rtol=1e-12,
    )
    with pytest.raises(ValueError, match="mask must have a sample for every sample of the angle, trial by trial"):
        identify(angles, torques, mask=list(mask), **OPTIONS)
    with pytest.raises(TypeError, match="mask must hold True and False; got float64"):
        identify(angles, torques, mask=[1.0 * one for one in masks], **OPTIONS)


@pytest.mark.parametrize("seed", [1, 2, *long(3, 4, 5, 6)])
def test_what_changes_faster_than_windows_is_followed(seed: int) -> None:
    """Test functions were chosen as if nothing changed: intervals held 42 and 48 % of what they should, K was 1.0 and 1.2 % off."""
    trials = simulated(12, 1500, lambda t: 13 + 3 * np.sin(5 * np.pi * t + seed), seed=seed)
    found = identify(trials.angle, trials.torque, **OPTIONS)
    assert not found.record_status & tvident.Status.KIND_CONTRADICTED
    # Seeds 1 to 6: .98 and more, .0061 to .0141.
    assert np.mean(np.abs(found.stiffness - trials.stiffness) < 1.96 * found.stderr["stiffness"]) > 0.9
    assert rms(found.stiffness, trials.stiffness) < (0.009 if seed < 3 else 0.015)
    value, error = found.constants["inertia"]
    assert abs(value - trials.inertia) < 4 * error


@pytest.mark.parametrize("seed", [1, *long(2, 3, 4)])
def test_a_stiffness_of_20_hertz_is_followed_in_ten_trials(seed: int) -> None:
    """It was 21 % off, and trusted, with words about a missing term."""
    trials = simulated(10, 500, lambda t: 15 + 4 * np.sin(40 * np.pi * t), seed=seed)
    found = identify(trials.angle, trials.torque, **OPTIONS)
    off, inside = np.abs(found.stiffness - trials.stiffness), slice(50, -50)
    assert rms(found.stiffness[inside], trials.stiffness[inside]) < 0.03
    assert np.mean(off[inside] < 1.96 * found.stderr["stiffness"][inside]) > 0.9


@pytest.mark.parametrize("seed", [1, *long(2, 3)])
def test_what_no_window_follows_is_said_with_what_does(seed: int) -> None:
    """A stiffness of 80 Hz was 18 to 20 % off, and trusted."""

    def fast(t: Array) -> Array:
        return np.asarray(15 + 4 * np.sin(160 * np.pi * t))

    trials = simulated(10, 500, fast, seed=seed)
    found = identify(trials.angle, trials.torque, **OPTIONS)
    assert not found.trusted.any()
    words = "stiffness changes faster than they follow, or something acts in every trial then; functions of time have no windows"
    assert any(words in line for line in found.advice)
    # Half a second has 40 cycles.
    expanded = identify(trials.angle, trials.torque, **{**OPTIONS, "stiffness": tvident.Expansion("bspline", size=120)})
    inside = slice(25, -25)
    assert rms(expanded.stiffness[inside], fast(expanded.time)[inside]) < 0.06


def test_what_is_late_in_every_trial_is_no_change_that_windows_miss() -> None:
    """Trials that move alike have what is late or missing in common, too."""
    generator = np.random.default_rng(2)
    rig = tvident.simulate_torsional_rig(duration=4.0, seed=2, pattern="slider")
    torque = np.roll(rig.true_torque, 3)
    angles, torques = (
        np.stack([one + noise * np.std(one) * generator.standard_normal(one.size) for _ in range(8)])
        for one, noise in ((rig.true_angle, 1e-4), (torque, 1e-2))
    )
    found = identify(angles, torques, **OPTIONS)
    assert found.record_status & tvident.Status.LAG_SUSPECTED
    assert not any("faster than they follow" in line for line in found.advice)


@pytest.mark.parametrize("window_length", [17, 65])
def test_trials_that_share_all_differ_by_their_noise(window_length: int) -> None:
    """The angles' noise and the growth of what is windowed were differences of trials: 11 to 15 errors of the inertia, 3 of the damping."""
    rigs = [tvident.simulate_torsional_rig(2.0, seed=10 + seed) for seed in range(8)]
    noise = np.random.default_rng(10)
    angle, torque = (np.stack([getattr(rig, name) for rig in rigs]) for name in ("true_angle", "true_torque"))
    angle += 1e-4 * angle.std() * noise.standard_normal(angle.shape)
    torque += 3e-3 * torque.std() * noise.standard_normal(torque.shape)
    found = identify(angle, torque, method=tvident.WeakForm(window_length=window_length), **OPTIONS)
    assert not found.record_status & tvident.Status.KIND_CONTRADICTED
    for name in ("inertia", "damping", "stiffness"):
        values, errors = found.trial_spread[name]
        # From .83 to .99; eight χ² exceed 1.8² with a probability of 2e-5.
        assert np.sqrt(np.mean((values / errors) ** 2)) < 1.8


@pytest.mark.parametrize("is_given", [False, True])
def test_a_damping_that_swings_several_times_in_an_eighth_of_trials_is_no_constant(is_given: bool) -> None:
    """Eight parts are alike, and constants leave too little to look further: the damping was 14 % off, by 30 errors, without a word."""

    def damping(t: Array) -> Array:
        return np.asarray(0.03 * (1 + 0.2 * np.sin(2 * np.pi * t / 1.2)))

    rigs = [
        tvident.simulate_torsional_rig(15.0, 250, seed, "constant", angle_noise=9e-3, damping=damping)
        for seed in range(5)
    ]
    angle, torque = np.stack([rig.angle for rig in rigs]), np.stack([rig.torque for rig in rigs])
    kind = "constant" if is_given else "auto"
    result = identify(
        angle, torque, sample_rate=250, ensemble_axis=0, inertia="constant", damping=kind, stiffness="constant"
    )
    if is_given:
        assert result.record_status & tvident.Status.KIND_CONTRADICTED
    else:
        assert result.settings["kinds"]["damping"] == "windowed"
        assert np.sqrt(np.mean((result.damping / rigs[0].damping - 1) ** 2)) < 0.06
