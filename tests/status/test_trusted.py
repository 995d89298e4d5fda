"""What the flags of samples and of the record say together."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from scipy.signal import chirp, lsim

import tvident
from tvident import Status

OF_A_SAMPLE = (
    Status.INVALID
    | Status.EDGE
    | Status.GAP
    | Status.LOWEST_ORDER
    | Status.HIGHEST_ORDER
    | Status.EXACT
    | Status.RANK_DEFICIENT
    | Status.ILL_CONDITIONED
    | Status.NOISE_MODEL
)
OF_A_RECORD = (
    Status.RANK_DEFICIENT
    | Status.ILL_CONDITIONED
    | Status.NOISE_MODEL
    | Status.COLOURED
    | Status.KIND_CONTRADICTED
    | Status.WINDOW_LIMIT
    | Status.LAG_SUSPECTED
    | Status.TERM_SUSPECTED
    | Status.SCALES_DISAGREE
    | Status.CHANNEL_SUSPECTED
)
CONSTANT: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}


def distrusts_the_whole(summary: str) -> bool:
    """Return whether the verdict is against a record for another reason than that most samples are flagged."""
    verdict = summary.splitlines()[0]
    return verdict.startswith("do not trust") and "of the samples are flagged" not in verdict


@pytest.fixture(scope="module")
def rig() -> tvident.Recording:
    return tvident.simulate_torsional_rig(duration=6.0, angle_noise=1e-3)


def sine() -> tuple[Any, Any]:
    t = np.arange(6000) / 1000
    generator = np.random.default_rng(0)
    angle = np.sin(2 * np.pi * 3 * t)
    return angle + 1e-4 * generator.standard_normal(t.size), 10 * angle + 0.01 * generator.standard_normal(t.size)


def test_every_flag_is_in_a_group_and_the_documentation_says_in_which() -> None:
    assert sum(Status) == OF_A_SAMPLE | OF_A_RECORD
    text = " ".join((Status.__doc__ or "").split())
    samples, records = text.split("Flags of a sample are in")[1].split("Flags of a record are in")
    records = records.split("Three are in both groups")[0]
    assert [str(flag.name) in samples for flag in Status] == [flag in OF_A_SAMPLE for flag in Status]
    assert [str(flag.name) in records for flag in Status] == [flag in OF_A_RECORD for flag in Status]


@pytest.mark.parametrize(
    "call",
    [{}, {"method": "paper"}, CONSTANT, {"method": tvident.StrongForm(), **CONSTANT}, {"inertia": "windowed"}],
    ids=str,
)
def test_flags_of_samples_and_of_records_stand_apart(rig: tvident.Recording, call: dict[str, Any]) -> None:
    for angle, torque in ((rig.angle, rig.torque), sine(), (rig.angle[5:], rig.torque[:-5])):
        result = tvident.identify(angle, torque, sample_rate=1000, **call)
        assert np.bitwise_or.reduce(result.status) & ~np.uint16(OF_A_SAMPLE) == 0
        assert result.record_status & ~OF_A_RECORD == 0
        assert isinstance(result.record_status, int)
        good = result.trusted
        for name in ("inertia", "damping", "stiffness"):
            assert np.isfinite(getattr(result, name)[good]).all()
        doubtful = Status.INVALID | Status.RANK_DEFICIENT | Status.ILL_CONDITIONED | Status.NOISE_MODEL
        expected = result.status & doubtful == 0
        if result.record_status & (Status.RANK_DEFICIENT | Status.ILL_CONDITIONED | Status.SCALES_DISAGREE):
            expected[:] = False
        if distrusts_the_whole(result.summary()):
            expected[:] = False
        np.testing.assert_array_equal(good, expected)


def test_a_late_torque_concerns_the_record_and_leaves_its_samples_good(rig: tvident.Recording) -> None:
    result = tvident.identify(rig.angle[5:], rig.torque[:-5], sample_rate=1000)
    assert Status.LAG_SUSPECTED in result.record_status
    assert (result.status == 0).mean() > 0.9
    assert (result.status & Status.LAG_SUSPECTED == 0).all()
    assert any(line.startswith("record  LAG_SUSPECTED") for line in result.summary().splitlines())
    assert "whole record: " in result.plot().axes[-1].get_xlabel()


def test_what_a_record_does_not_determine_is_not_trusted() -> None:
    result = tvident.identify(*sine(), sample_rate=1000, **CONSTANT)
    assert result.record_status & (Status.ILL_CONDITIONED | Status.RANK_DEFICIENT)
    assert not result.trusted.any()


def test_a_record_whose_signs_contradict_each_other_is_not_trusted() -> None:
    # Every window of a sweep hears one frequency, at which inertia and stiffness trade places, and the clock of the angle jitters.
    generator = np.random.default_rng(0)
    rate, duration, frequency = 500, 40.0, 4.0
    time = np.arange(int(duration * rate)) / rate
    inertia, speed = 0.01, 2 * np.pi * frequency
    damping, stiffness = 0.2 * inertia * speed, inertia * speed**2
    torque = chirp(time, 0.1 * frequency, duration, 5 * frequency, method="logarithmic")
    angle = lsim(([1.0], [inertia, damping, stiffness]), torque, time)[1]
    angle = np.interp(time + 0.6 / rate * generator.uniform(-0.5, 0.5, time.size), time, angle)
    angle += 1e-4 * angle.std() * generator.standard_normal(time.size)
    torque += 1e-3 * generator.standard_normal(time.size)
    found = tvident.identify(angle, torque, sample_rate=rate)
    assert found.record_status & Status.ILL_CONDITIONED
    assert not found.trusted.any()
    assert "stiffness has both signs" in found.summary()
    # The constants that are advised are within a hundredth.
    assert "try inertia='constant'" in found.advice[0]
    assert "the two trade places; make constant what need not change" in found.advice[1]
    constants: Any = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")
    again = tvident.identify(angle, torque, sample_rate=rate, **constants)
    assert again.trusted.any()
    assert again.value("stiffness").value == pytest.approx(stiffness, rel=0.01)


def test_a_stiffness_of_both_signs_is_trusted_where_the_motion_tells_it_from_an_inertia_that_changes() -> None:
    generator = np.random.default_rng(0)
    time = np.arange(10_000) / 500
    speeds = 2 * np.pi * generator.uniform(0.3, 20, (25, 1))
    phases = speeds * time + generator.uniform(0, 2 * np.pi, (25, 1))
    amplitudes = 1 / (1 + (speeds / 6 / np.pi) ** 2)
    angle, velocity, acceleration = (
        (amplitudes * part).sum(0) for part in (np.sin(phases), speeds * np.cos(phases), -(speeds**2) * np.sin(phases))
    )
    inertia, stiffness = 0.01 * (1 + 0.4 * np.sin(np.pi * time / 4)), 3 + 8 * np.sin(0.4 * np.pi * time)
    torque = inertia * acceleration + 0.05 * velocity + stiffness * angle
    angle += 1e-4 * angle.std() * generator.standard_normal(time.size)
    torque += 1e-3 * torque.std() * generator.standard_normal(time.size)
    found = tvident.identify(angle, torque, sample_rate=500)
    assert not found.record_status & Status.ILL_CONDITIONED
    assert found.trusted.mean() > 0.9
    assert np.median(np.abs(found.inertia / inertia - 1)) < 0.005
    assert (found.stiffness < 0).mean() > 0.2


def test_records_of_a_batch_have_flags_of_their_own(rig: tvident.Recording) -> None:
    n = rig.angle.size - 5
    angle = np.stack([rig.angle[:n], rig.angle[5:]])[np.newaxis]
    torque = np.stack([rig.torque[:n], rig.torque[:n]])[np.newaxis]
    result = tvident.identify(angle, torque, sample_rate=1000)
    flags = np.asarray(result.record_status)
    assert flags.shape == (1, 2)
    assert flags.dtype == np.uint16
    assert (flags & Status.LAG_SUSPECTED != 0).tolist() == [[False, True]]
    assert result.trusted.shape == angle.shape
    assert "1 of 2 records  LAG_SUSPECTED" in result.summary()


def test_reasons_and_advice_are_attributes_and_no_settings(rig: tvident.Recording) -> None:
    result = tvident.identify(rig.angle[5:], rig.torque[:-5], sample_rate=1000)
    assert result.reasons
    assert all(isinstance(line, str) and line in result.summary() for line in (*result.reasons, *result.advice))
    assert any("lag=0.005" in line or "lag=0.0049" in line for line in result.advice)
    assert not {"reasons", "advice"} & result.settings.keys()


def copied(result: Any) -> Any:
    return pickle.loads(pickle.dumps(result))  # noqa: S301 - written here


def in_minus(rig: tvident.Recording) -> tuple[Any, Any]:
    return rig.angle, -rig.torque


def disturbed(rig: tvident.Recording) -> tuple[Any, Any]:
    return rig.angle, rig.torque + 5 * np.sin(3 * np.arange(rig.torque.size) / 1000)


def marked(rig: tvident.Recording) -> tuple[Any, Any]:
    angle = rig.angle.copy()
    angle[2000:2100] = -9999
    return angle, rig.torque


def with_spikes(rig: tvident.Recording) -> tuple[Any, Any]:
    steady = tvident.simulate_torsional_rig(duration=rig.angle.size / 1000, pattern="constant")
    angle = steady.angle.copy()
    angle[[1000, 2500, 4000]] += 0.5
    return angle, steady.torque


@pytest.mark.parametrize(
    ("spoilt", "call"),
    [
        (in_minus, {}),
        (in_minus, {"method": "paper"}),
        (disturbed, {"method": "paper", **CONSTANT}),
        (marked, {}),
        (with_spikes, {"method": tvident.StrongForm(), **CONSTANT}),
    ],
)
def test_nothing_is_trusted_of_a_record_that_the_verdict_distrusts(
    rig: tvident.Recording, spoilt: Any, call: dict[str, Any], tmp_path: Any
) -> None:
    result = tvident.identify(*spoilt(rig), sample_rate=1000, **call)
    assert not result.trusted.any()
    assert distrusts_the_whole(result.summary())
    assert "0.0% can be trusted" in repr(result)
    assert not result.columns()["trusted"].any()
    # Numbers are told all the same, and what is made of the result says so too.
    assert np.isfinite(result.value("inertia").value)
    part = result.between(1.0, 2.0)
    result.save(tmp_path / "whole.npz")
    part.save(tmp_path / "part.npz")
    for one in (part, copied(part), copied(result)):
        assert not one.trusted.any()
        assert distrusts_the_whole(one.summary())
    for name in ("whole", "part"):
        assert not tvident.load(tmp_path / f"{name}.npz").trusted.any()


def test_records_of_a_batch_are_trusted_as_its_verdict_says(rig: tvident.Recording) -> None:
    angle, torque = np.stack([rig.angle] * 3), np.stack([rig.torque, -rig.torque, rig.torque])
    result = tvident.identify(angle, torque, sample_rate=1000)
    assert "do not trust 1 of them, such as record 1" in result.summary().splitlines()[0]
    assert result.trusted.any(axis=-1).tolist() == [True, False, True]
    assert [bool(one.trusted.any()) for one in result] == [True, False, True]


def test_records_of_a_part_of_a_batch_are_trusted_as_the_whole_is(rig: tvident.Recording) -> None:
    """A part has no recording: records of one explained too little and were trusted."""
    angle = np.stack([rig.angle] * 3)
    torque = np.stack(
        [rig.torque, rig.torque + 2 * np.random.default_rng(1).standard_normal(rig.torque.size), -rig.torque]
    )
    result = tvident.identify(angle, torque, sample_rate=1000)
    each = result.trusted.any(axis=-1).tolist()
    assert each == [True, False, False]
    for part in (result.between(1, 3), copied(result.between(1, 3)), copied(result)):
        assert part.trusted.any(axis=-1).tolist() == each
        assert [bool(one.trusted.any()) for one in part] == each
        assert part[1:].trusted.any(axis=-1).tolist() == each[1:]


@pytest.mark.parametrize("noise", [0.0, 1e-4, 3e-3])
def test_verdicts_take_nothing_from_records_without_a_fault(noise: float) -> None:
    rig = tvident.simulate_torsional_rig(duration=10.0, angle_noise=noise, seed=3)
    for call in ({}, {"method": "paper"}, {"method": tvident.StrongForm()}, CONSTANT, {"inertia": 0.0123}):
        result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, **call)
        doubtful = Status.INVALID | Status.RANK_DEFICIENT | Status.ILL_CONDITIONED | Status.NOISE_MODEL
        verdict = result.summary().splitlines()[0]
        if call is not CONSTANT:
            assert not verdict.startswith("do not trust"), (call, verdict)
            np.testing.assert_array_equal(result.trusted, result.status & doubtful == 0)


def test_trials_that_the_verdict_distrusts_are_not_trusted() -> None:
    rigs = [tvident.simulate_torsional_rig(duration=6.0, seed=seed, pattern="constant") for seed in range(3)]
    angle, torque = (np.stack([getattr(one, name) for one in rigs]) for name in ("angle", "torque"))
    good = tvident.identify(angle, torque, sample_rate=1000, ensemble_axis=0)
    assert not good.summary().startswith("do not trust")
    assert good.trusted.mean() > 0.9
    bad = tvident.identify(angle, -torque, sample_rate=1000, ensemble_axis=0)
    assert distrusts_the_whole(bad.summary())
    assert not bad.trusted.any()
    assert not bad.between(1.0, 2.0).trusted.any()
    assert not copied(bad).trusted.any()


def test_what_is_shown_by_itself_waits_for_no_trial(rig: tvident.Recording) -> None:
    """In a notebook a result of 20 s, low-passed, was shown after 4 s."""
    result = tvident.identify(*disturbed(rig), sample_rate=1000, method="paper", **CONSTANT)
    improve = result._recorded.improve  # noqa: SLF001 - what tries
    tried: list[str] = []

    def counted(*given: Any) -> Any:
        tried.append("once")
        return improve(*given)

    object.__setattr__(result._recorded, "improve", counted)  # noqa: SLF001 - likewise
    part = result.between(1.0, 2.0)
    for one in (result, part):
        assert "unflagged, summary() has the verdict" in repr(one)
        assert "result.summary() says what to do" in one._repr_html_()
        assert "trusted" not in one.columns(judged=False)
        with pytest.raises(TypeError, match="judged must be True or False"):
            one.columns(judged=np.array([1, 2]))
    assert not tried
    verdict = result.summary().splitlines()[0].removeprefix("do not trust: ").split(";")[0]
    assert len(tried) == 1
    for one in (result, part):
        assert f"0.0% can be trusted: {verdict}>" in repr(one)
        assert "says what to do" not in one._repr_html_()
        assert not one.columns()["trusted"].any()
    # What needs no trial is said at once.
    assert "0.0% can be trusted: inertia is negative" in repr(tvident.identify(*in_minus(rig), sample_rate=1000))


@pytest.mark.parametrize("call", [{}, {"method": "paper"}], ids=str)
@pytest.mark.parametrize("samples", [slice(None, None, 1), slice(2000, 2001)], ids=["all", "one sample"])
def test_nothing_is_trusted_of_arrays_that_were_written_over_before_anybody_asked(
    rig: tvident.Recording, samples: slice, call: dict[str, Any]
) -> None:
    angle, torque = rig.angle.copy(), rig.torque.copy()
    asked, result = (tvident.identify(angle, torque, sample_rate=1000, **call) for _ in range(2))
    before = asked.trusted
    angle[samples] = angle[::-1][samples] + 1e-3 * (samples.step is None)
    np.testing.assert_array_equal(asked.trusted, before)
    assert "written over" not in asked.summary().splitlines()[0]
    assert not result.trusted.any()
    assert result.summary().startswith(
        "do not trust: its arrays were written over before it was looked at; see what to do"
    )
    assert "ask for trusted or summary() before you write into them, or give copies" in result.advice[0]


def test_records_of_a_batch_are_known_again_one_by_one(rig: tvident.Recording) -> None:
    angles, torques = np.stack([rig.angle] * 3), np.stack([rig.torque] * 3)
    batch = tvident.identify(angles, torques, sample_rate=1000)
    angles[1, 100:200] = 0
    assert [bool(one.trusted.any()) for one in batch] == [True, False, True]
    assert "record 1: its arrays were written over" in batch.summary().splitlines()[0]


def test_what_a_mask_held_belongs_to_what_was_identified(rig: tvident.Recording) -> None:
    mask = np.ones(rig.angle.size, bool)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, mask=mask)
    mask[:1000] = False
    assert not result.trusted.any()
