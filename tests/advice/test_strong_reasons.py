"""What the strong form says in words."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import signal

import calls
import tvident
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]

RIG = tvident.simulate_torsional_rig(8.0)


def paper(angle: Array, torque: Array, **call: Any) -> tvident.Identification:
    found: tvident.Identification = tvident.identify(angle, torque, sample_rate=1000, **calls.paper(**call))
    return found


def advice(result: tvident.Identification) -> str:
    assert all(sentence in result.summary() for sentence in result.advice)
    return "\n".join(result.advice)


def single_sine() -> tuple[Array, Array]:
    generator = np.random.default_rng(0)
    t = np.arange(8000) / 1000
    omega = 6 * np.pi
    angle = np.sin(omega * t)
    torque = (15 - 0.0123 * omega**2) * angle + 0.00825 * omega * np.cos(omega * t)
    return angle + 1e-3 * generator.standard_normal(t.size), torque + 0.5 * generator.standard_normal(t.size)


def test_a_good_recording_is_told_what_was_chosen_and_what_would_help_most() -> None:
    result = paper(RIG.angle, RIG.torque)
    orders, errors, scales = result.reasons
    assert "of up to 15, in every window by aicc" in orders
    assert "times those of independent equations" in errors
    assert "was not tested, since windows of 201 samples were given: result.scan()" in scales
    assert "give inertia='constant', or its value" in advice(result)
    followed = paper(RIG.angle, RIG.torque, inertia="constant", damping="constant")
    assert advice(followed) == ""


def test_kinds_that_nothing_tests_are_named() -> None:
    result = tvident.identify(
        RIG.angle, RIG.torque, sample_rate=1000, **calls.strong(selection="pooled", variation="linear")
    )
    assert "inertia and damping constant: the strong form does not test it" in "\n".join(result.reasons)


@pytest.mark.parametrize("kind", ["windowed", "constant"])
def test_a_single_sine_does_not_tell_inertia_from_stiffness(kind: str) -> None:
    kinds: dict[str, Any] = dict.fromkeys(("inertia", "damping", "stiffness"), kind)
    result = paper(*single_sine(), **kinds)
    assert "inertia and stiffness are nearly collinear" in advice(result)
    flags = result.status | result.record_status
    assert np.mean(flags & Status.ILL_CONDITIONED != 0) > 0.8


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ({"window_length": 401}, "use a shorter window_length until that is rare"),
        ({"max_order": 5}, "raise max_order= above 5, or use a shorter window_length"),
        ({"window_length": 9, "criterion": "aic"}, "need more samples: use a longer window_length"),
    ],
)
def test_orders_at_the_end_of_the_candidates_get_the_papers_advice(call: dict[str, Any], words: str) -> None:
    found = advice(paper(RIG.angle, RIG.torque, **call))
    assert "the highest order was best" in found
    assert words in found


def test_what_rests_is_told_to_be_left_out() -> None:
    angle = RIG.angle.copy()
    angle[2000:5000] = angle[2000]
    found = advice(paper(angle, RIG.torque))
    assert "% of the windows do not determine inertia, damping and stiffness" in found
    assert "order 0 was best: the angle is at rest there" in found
    nothing = paper(np.zeros(2000), np.zeros(2000))
    assert advice(nothing).startswith("the record does not determine inertia, damping and stiffness: nothing moves")
    missing = paper(np.full(2000, np.nan), np.zeros(2000))
    assert advice(missing).startswith("the angle holds no numbers: all 2000 samples are missing")
    assert "\nno window holds enough equations" in advice(missing)


@pytest.mark.slow
def test_a_term_that_looks_like_another_is_told() -> None:
    # Within 0.05 s the motion mostly keeps its direction, so friction looks like an offset.
    found = advice(paper(RIG.angle, RIG.torque, stiffness=0, regression_window=50, terms=["coulomb", "offset"]))
    assert "two terms are collinear as long as the motion keeps its direction" in found


def test_many_records_are_spoken_of_together() -> None:
    angles = np.stack([RIG.angle] * 3)
    torques = np.stack([RIG.torque] * 3)
    result = paper(angles, torques, window_length=401)
    alone = paper(RIG.angle, RIG.torque, window_length=401)
    # The samples that are looked at lie elsewhere, so shares differ by a percent.
    together, one = (re.sub(r"[\d.]+%", "", advice(found)) for found in (result, alone))
    assert together == one


def test_no_reason_is_about_other_recordings() -> None:
    given: list[dict[str, Any]] = [{}, {"inertia": "constant"}, calls.weak()]
    for call in given:
        result = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, **call)
        assert not any("recordings" in reason for reason in result.reasons)


def test_a_torque_that_is_mostly_zero_is_no_error() -> None:
    rig = tvident.simulate_torsional_rig(6.0, angle_noise=1e-3)
    torque = rig.torque.copy()
    torque[:4200] = 0
    result = tvident.identify(
        rig.angle, torque, sample_rate=1000, **calls.paper(window_length=61, regression_window=60)
    )
    assert "inf" not in " ".join(result.advice) + result.summary()


@pytest.mark.slow
@pytest.mark.parametrize("samples", [200_000, *long(1_000_000)])
def test_a_second_in_a_quarter_of_an_hour_is_told_of(samples: int) -> None:
    rig = tvident.simulate_torsional_rig(1.0)
    angle, torque = np.full(samples, np.nan), np.zeros(samples)
    second = slice(samples // 2 + 600, samples // 2 + 1600)
    angle[second], torque[second] = rig.angle, rig.torque
    result = tvident.identify(angle, torque, sample_rate=1000, method="paper")
    # 800 equations, and windows of 200 of which more are there than there are unknowns, as in any gap.
    assert np.count_nonzero(result.status & Status.INVALID == 0) == 800 + 1 + 2 * (100 - 4)
    assert not any("no window holds enough equations" in one for one in result.advice)
    assert any(one.startswith("orders ") for one in result.reasons)


@pytest.mark.first(1)
@pytest.mark.parametrize("step", [1, 7])
def test_advice_is_on_what_the_mask_leaves(step: int) -> None:
    rig = tvident.simulate_torsional_rig(40.0)
    angle, torque, mask = rig.angle.copy(), rig.torque.copy(), np.ones(40_000, bool)
    angle[10_000:30_000], torque[10_000:30_000], mask[9800:30_200] = angle[10_000], 0, False
    result = tvident.identify(angle, torque, sample_rate=1000, method="paper", mask=mask, step=step)
    assert not any("mask=" in one for one in result.advice)


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"lag": 4}, ["the torque is late by", "try lag=0.00"]),
        ({"friction": 0.1}, ["dry friction of", "'coulomb']"]),
        ({"stiffness": 0.0, "friction": 0.1}, ["stiffness is none", "try stiffness=0, terms=["]),
    ],
)
def test_what_the_weak_form_finds_missing_is_tried_there_and_said_here(
    change: dict[str, float], words: list[str]
) -> None:
    late = int(change.get("lag", 0))
    clean = tvident.simulate_torsional_rig(8.0, pattern="constant", angle_noise=1e-6, torque_snr_db=40)
    velocity = np.gradient(clean.angle, 1e-3)
    torque = clean.torque + change.get("friction", 0.0) * np.sign(velocity)
    if "stiffness" in change:
        torque = torque - clean.stiffness * clean.angle
    angle, torque = clean.angle[late:], torque[: torque.size - late]
    for result in (paper(angle, torque), paper(angle, torque, inertia="constant", damping="constant")):
        first = result.advice[0]
        assert first.startswith("in weak form: ")
        assert all(one in first for one in words), first
        assert advice(result).count("dry friction") == ("friction" in change)
        assert result.summary().splitlines()[0].endswith("see what to do")


@pytest.mark.parametrize("lacks", ["length", "angle"])
def test_a_record_that_the_weak_form_cannot_take_has_a_summary(lacks: str) -> None:
    # The middle 16384 samples are tried.
    angle, torque = (np.tile(channel, 3)[: 40 if lacks == "length" else 18_000] for channel in (RIG.angle, RIG.torque))
    if lacks == "angle":
        angle[500:-500] = np.nan
    result = paper(angle, torque, window_length=9, max_order=5, regression_window=9)
    assert np.isfinite(result.stiffness).any()
    assert result.summary()


@pytest.mark.first(1)
@pytest.mark.parametrize("pattern", ["constant", "slider"])
def test_swapped_channels_are_asked_about_where_exchanging_them_explains_the_record(pattern: Any) -> None:
    rig = tvident.simulate_torsional_rig(4.0, pattern=pattern)
    cases: list[tuple[Any, str]] = [("auto", ""), ("paper", "in weak form: ")]
    for method, start in cases:
        swapped = tvident.identify(rig.torque, rig.angle, sample_rate=1000, method=method)
        assert swapped.summary().startswith("do not trust")
        assert swapped.advice[0].startswith(f"{start}are the channels of angle and torque swapped?")
        right = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method=method)
        assert "swapped" not in advice(right)


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("seed", range(17060, 17064))
def test_a_slow_machine_with_swapped_channels_is_not_told_of_a_lag(seed: int) -> None:
    """A torque that is late by 53 samples explained 88 % of what is held back."""
    drawn = np.random.default_rng(seed)
    time = np.arange(16_000) / 1000
    tones = zip(drawn.uniform(0.3, 12, 25), drawn.uniform(0, 2 * np.pi, 25), strict=True)
    torque = sum(np.sin(2 * np.pi * one * time + phase) for one, phase in tones) / 5
    _, angle, _ = signal.lsim(([1.0], [0.05, 1.2, 40.0]), torque, time)
    angle, torque = (one + 2e-3 * one.std() * drawn.standard_normal(one.size) for one in (angle, torque))
    assert tvident.identify(torque, angle, sample_rate=1000).advice[0].startswith("are the channels")
    assert "swapped" not in advice(tvident.identify(angle, torque, sample_rate=1000))


@pytest.mark.first(1)
@pytest.mark.parametrize("form", [calls.paper, calls.strong])
@pytest.mark.parametrize("end", [3010, 6000])
def test_nothing_is_said_of_a_model_where_samples_are_missing(form: Any, end: int) -> None:
    holed = RIG.angle.copy()
    holed[3000:end] = np.nan
    result = tvident.identify(holed, RIG.torque, sample_rate=1000, **form())
    _, recorded, predicted = result.predicted_torque()
    half = result.settings["window_length"] // 2
    whole = np.ones(holed.size, bool)
    for first, last in ((0, half), (3000 - half, end + half), (holed.size - half, holed.size)):
        whole[first:last] = False
    there = np.isfinite(predicted)
    assert not there[~whole].any()
    assert np.mean(there[whole]) > 0.98
    explained = 1 - np.var((recorded - predicted)[there]) / np.var(recorded[there])
    assert 0.97 < explained < 0.999
    assert re.search(r"model explains 9[789]\.\d+ % of the torque", result.summary().splitlines()[0])
    assert "nothing moves there" not in advice(result)
