"""The summary an engineer reads: a verdict first, numbers whose digits go together, and advice that leads to the answer."""

from __future__ import annotations

import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from tvident import recordings
from tvident._arguments import percent
from tvident._results.held_back import HeldBack, without_masked

RATE = 1000.0
TIME = np.arange(4000) / RATE
RNG = np.random.default_rng(5)


def motion(seed: int) -> tuple[Any, Any, Any]:
    """Give an angle of several frequencies, its velocity and its acceleration."""
    rng = np.random.default_rng(seed)
    frequencies, phases = rng.uniform(0.3, 6, 6), rng.uniform(0, 2 * np.pi, 6)
    w = 2 * np.pi * frequencies[:, np.newaxis]
    x = w * TIME + phases[:, np.newaxis]
    size = 0.3 / frequencies[:, np.newaxis]
    return (size * np.sin(x)).sum(0), (size * w * np.cos(x)).sum(0), -(size * w**2 * np.sin(x)).sum(0)


def followed(result: tvident.Identification, angle: Any, torque: Any, **given: Any) -> tvident.Identification:
    """Identify again as the first advice says, read as a user would."""
    line = result.advice[0]
    call = re.search(r": (?:try|give) (.*?)(?:;|$)", line)
    assert call, line
    options: dict[str, Any] = eval(f"dict({call[1]})")  # noqa: S307 - what a user types
    found: tvident.Identification = tvident.identify(angle, torque, sample_rate=RATE, **given, **options)
    return found


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("seed", [2, 3])
def test_a_machine_without_spring_is_told_so_and_is_right_when_it_follows(seed: int) -> None:
    angle, velocity, acceleration = motion(seed)
    torque = 0.5 * acceleration + 2 * velocity + 6 * np.tanh(velocity / 1e-3)
    torque = torque + 0.05 * np.random.default_rng(seed).standard_normal(torque.size)
    angle = angle + 1e-6 * np.random.default_rng(seed + 1).standard_normal(angle.size)
    result = tvident.identify(angle, torque, sample_rate=RATE)
    assert "stiffness is none" in result.advice[0]
    assert "stiffness=0" in result.advice[0]
    assert "dry friction of 6.0" in result.advice[0] or "dry friction of 5.9" in result.advice[0]
    again = followed(result, angle, torque)
    for name, true in (("inertia", 0.5), ("damping", 2.0), ("coulomb", 6.0)):
        assert again.value(name).value == pytest.approx(true, rel=0.02), name
    assert "stiffness" not in " ".join(again.advice)
    assert "stiffness is none" in pickle.loads(pickle.dumps(result)).advice[0]  # noqa: S301 - made here


def test_a_spring_that_is_there_is_kept(folder_of_recordings: Path) -> None:
    del folder_of_recordings
    rig = tvident.simulate_torsional_rig(duration=6.0, seed=3)
    torque = rig.torque + 0.08 * np.sign(np.gradient(rig.angle))
    result = tvident.identify(rig.angle, torque, sample_rate=RATE)
    assert not any("stiffness is none" in line or "stiffness=0" in line for line in result.advice)
    assert "coulomb" in result.advice[0]
    again = followed(result, rig.angle, torque)
    assert again.value("coulomb").value == pytest.approx(0.08, rel=0.1)
    assert again.held_back().predicted > result.held_back().predicted


@pytest.mark.first(1)
@pytest.mark.parametrize(("late", "word"), [(2, "delayed|late"), (-2, "early")])
def test_a_lag_is_late_or_early(late: int, word: str) -> None:
    rig = tvident.simulate_torsional_rig(duration=3.0, seed=2, pattern="constant")
    angle, torque = (rig.angle[late:], rig.torque[:-late]) if late > 0 else (rig.angle[:late], rig.torque[-late:])
    result = tvident.identify(angle, torque, sample_rate=RATE)
    assert re.search(word, result.advice[0]), result.advice
    assert "-" not in result.advice[0].partition("samples")[0]
    again = followed(result, angle, torque)
    assert again.settings["lag"] == pytest.approx(late / RATE, abs=0.2 / RATE)
    assert again.value("damping").value == pytest.approx(0.0081, rel=0.1)


@pytest.mark.slow
def test_records_of_a_batch_have_remedies_as_one_alone() -> None:
    rig = tvident.simulate_torsional_rig(duration=3.0, seed=3, pattern="constant")
    torques = np.stack([rig.torque, rig.torque + 0.08 * np.sign(np.gradient(rig.angle))])
    both = tvident.identify(np.stack([rig.angle] * 2), torques, sample_rate=RATE)
    alone = tvident.identify(rig.angle, torques[1], sample_rate=RATE)
    assert "try terms=['offset', 'coulomb']" in alone.advice[0]
    assert both[1].advice == alone.advice
    assert both[0].advice == tvident.identify(rig.angle, torques[0], sample_rate=RATE).advice
    assert "result[1].summary() tries what would explain record 1; so do those of other records" in both.advice


def test_friction_that_drives_the_motion_is_never_offered() -> None:
    angle, velocity, acceleration = motion(4)
    torque = 0.5 * acceleration + 2 * velocity + 40 * angle - 6 * np.tanh(velocity / 1e-3)
    torque += 0.05 * RNG.standard_normal(torque.size)
    advice = " ".join(tvident.identify(angle, torque, sample_rate=RATE).advice)
    assert "friction of" not in advice


def positioning_system(folder: Path) -> tuple[Any, Any]:
    """Give position and force of the positioning system EMPS."""
    path = folder / "emps.mat"
    if not path.exists():
        pytest.skip("the recording emps.mat is missing")
    channels = recordings.read(path)
    return channels["qm"], channels["vir"] * float(channels["gtau"])


def assert_as_published(found: tvident.Identification) -> None:
    """Compare with the published numbers, within 1 % and for damping 2 %."""
    for name, published, part in (("inertia", 95.1089, 0.01), ("damping", 203.5034, 0.02), ("coulomb", 20.3935, 0.01)):
        assert found.value(name).value == pytest.approx(published, rel=part), name


@pytest.mark.slow
def test_the_positioning_system_leads_to_what_was_published(folder_of_recordings: Path) -> None:
    position, force = positioning_system(folder_of_recordings)
    result = tvident.identify(position, force, sample_rate=RATE)
    assert result.summary().startswith("do not trust: stiffness has both signs (")
    assert "early" not in " ".join(result.advice)
    assert "lag" not in result.advice[0]
    again = followed(result, position, force)
    assert_as_published(again)
    assert not any("try" in line or "give inertia" in line or "lag=" in line for line in again.advice)


@pytest.mark.slow
def test_the_positioning_system_without_stiffness_leads_there_too(folder_of_recordings: Path) -> None:
    """With the inertia constant damping took over what that followed: 251 ± 19, where the advice had said 206."""
    position, force = positioning_system(folder_of_recordings)
    result = tvident.identify(position, force, sample_rate=RATE, stiffness=0)
    assert "inertia='constant', damping='constant'" in result.advice[0]
    again = followed(result, position, force, stiffness=0)
    assert_as_published(again)
    assert not any(": try " in line for line in again.advice)


def test_the_summary_begins_with_a_verdict_and_has_even_digits() -> None:
    rig = tvident.simulate_torsional_rig(duration=6.0)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=RATE)
    first, second, _, head, *rows = result.summary().splitlines()
    assert re.fullmatch(
        r"K\(t\) known to ± [\d.]+ %, I ± [\d.]+ %, C ± [\d.]+ %, model explains 99\.\d+ % of the torque", first
    )
    assert second.startswith("explains 99")
    assert head.split()[:4] == ["parameter", "kind", "median", "5"]
    for row in rows[:4]:
        cells = re.findall(r"-?\d+\.\d+(?:e-\d+)?", row)
        if "e-" not in cells[-1]:
            assert len({len(cell.partition(".")[2]) for cell in cells}) == 1, row
    text = result.summary()
    assert text.index("what was chosen") < text.index("samples, 5.999 s at 1000 Hz")
    assert "simulated recordings" not in text


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda angle, torque: (angle, -torque), "inertia is negative|damping is negative"),
        (lambda angle, torque: (angle, np.full_like(torque, np.nan)), "nothing could be identified"),
        (lambda angle, torque: (angle, RNG.standard_normal(torque.size)), "nothing could be identified"),
        (lambda angle, _: (np.sin(TIME[: angle.size] * 9), np.sin(TIME[: angle.size] * 9 + 0.1)), ".*"),
    ],
    ids=["sign", "missing", "noise", "one frequency"],
)
def test_what_must_not_be_trusted_says_so_first(change: Any, reason: str) -> None:
    rig = tvident.simulate_torsional_rig(duration=3.0)
    result = tvident.identify(*change(rig.angle, rig.torque), sample_rate=RATE)
    assert re.match(f"do not trust: (?:{reason})", result.summary().splitlines()[0])
    assert not any(": try " in line for line in result.advice)


def test_records_of_a_batch_are_judged_each() -> None:
    rig = tvident.simulate_torsional_rig(duration=3.0)
    both = tvident.identify(np.stack([rig.angle] * 2), np.stack([rig.torque, -rig.torque]), sample_rate=RATE)
    first = both.summary().splitlines()[0]
    assert first.startswith("2 records: K(t) known to")
    assert "do not trust 1 of them, such as record 1: inertia is negative" in first


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (0.9991, "99.910 %"),
        (0.5, "50 %"),
        (0.00123, "0.12 %"),
        (1.0, "100 %"),
        (1 - 1.4e-8, "99.999999 %"),
        (1 - 1e-9, "over 99.999999 %"),
        (1e-10, "under 0.000001 %"),
    ],
)
def test_percents_have_two_digits_of_what_is_left(share: float, words: str) -> None:
    assert percent(share) == words


def test_a_torque_that_is_mostly_noise_is_explained_as_far_as_it_is_none() -> None:
    """A servo's slow motion takes a quarter of what its torque sensor shows, and the rest is white."""
    generator, t = np.random.default_rng(0), np.arange(20_000) / 1000
    speed = np.cumsum(generator.standard_normal(t.size)) * 0.02
    speed = np.convolve(speed, np.hanning(800) / np.hanning(800).sum(), "same")
    inertia, damping = 1e-4, 7e-5
    torque = inertia * np.gradient(speed, t) + damping * speed
    noise = 4 * np.std(torque) * generator.standard_normal(t.size)
    call: dict[str, Any] = {"sample_rate": 1000, "inertia": "constant", "damping": "constant", "stiffness": 0}
    result = tvident.identify(np.cumsum(speed) / 1000, torque + noise, **call)
    first = result.summary().splitlines()[0]
    assert "of the torque, the rest is its noise" in first
    assert "do not trust" not in first
    value, error = result.constants["damping"]
    assert abs(value - damping) < 3 * error < damping
    # Beside a torque that nothing has to do with it is no such thing.
    other = tvident.identify(np.cumsum(speed) / 1000, noise, **call)
    assert other.summary().startswith("do not trust: ")


@pytest.mark.slow
def test_a_model_that_predicts_worse_than_a_constant_explains_nothing() -> None:
    rig = tvident.simulate_torsional_rig(duration=5.0, seed=4)
    result = tvident.identify(
        rig.angle, rig.torque, sample_rate=1000, inertia=0.05, damping="constant", stiffness="constant"
    )
    _, recorded, predicted = result.predicted_torque()
    there = np.isfinite(predicted)
    assert np.var((recorded - predicted)[there]) > np.var(recorded[there])
    assert result.summary().startswith("do not trust: the model explains nothing of the torque; see what to do")
    assert "explains nothing of the angle simulated and 61 % predicted" in HeldBack(-16.0, 61.0).words()
    assert "explains 0 % of the angle simulated" in HeldBack(0.0, 61.0).words()


@pytest.mark.slow
def test_a_torque_of_the_other_sign_that_is_late_is_named() -> None:
    """Windows that follow anything, and curves of an inertia and a damping, explained nothing of the torque, and no lag was named."""
    rig = tvident.simulate_torsional_rig(duration=5.0, seed=4)
    result = tvident.identify(rig.angle, -np.roll(rig.torque, 5), sample_rate=1000)
    _, recorded, predicted = result.predicted_torque()
    there = np.isfinite(predicted)
    assert np.var((recorded - predicted)[there]) < 0.05 * np.var(recorded[there])
    assert result.summary().startswith("do not trust: inertia is negative")
    assert any(line.startswith("the torque is late by 5.0") for line in result.advice)
    assert any("is the torque's sign reversed" in line for line in result.advice)


@pytest.mark.parametrize("seed", [1, 2])
def test_what_a_mask_leaves_out_is_not_explained_badly(seed: int) -> None:
    """A stiffness carried 23 s on through what was left out predicted its torque badly: "the model explains nothing of the torque"."""
    rig = tvident.simulate_torsional_rig(60.0, sample_rate=500, seed=seed, angle_noise=1e-3)
    torque = rig.torque + 0.06 * rig.torque.std() * np.sign(rig.true_velocity)
    mask = np.ones(torque.size, np.bool_)
    mask[15 * 500 : 38 * 500] = False
    for step in (1, 7):
        found = tvident.identify(rig.angle, torque, sample_rate=500, mask=mask, step=step)
        first = found.summary().splitlines()[0]
        assert first == "do not trust: another equation explains more, and finds another damping; see what to do"
        assert "coulomb" in found.advice[0]


@pytest.mark.parametrize("lengths", [(8.0, 5.0), (2.3, 0.25)], ids=["one touch", "many touches"])
def test_what_a_mask_leaves_out_is_not_held_back(lengths: tuple[float, float]) -> None:
    """What nobody recorded pushes there: it was said that 42 to 89 % are simulated, where the rest is 99.9 %."""
    rig = tvident.simulate_torsional_rig(20.0, seed=3, angle_noise=1e-3)
    every, long = lengths
    touched = (rig.time >= every) & (rig.time % every < long) & (rig.time < (13 if every == 8 else 20))
    mask = ~np.convolve(touched, np.ones(201), "same").astype(bool)
    angle, torque = rig.angle + np.where(touched, rig.angle.std() * np.sin(9 * rig.time), 0), rig.torque
    alone = tvident.identify(rig.angle, torque, sample_rate=1000).held_back()
    for masks in (mask, np.stack([mask, mask])):
        channels = (angle, torque) if masks.ndim == 1 else (np.stack([angle, angle]), np.stack([torque, torque]))
        found = tvident.identify(*channels, sample_rate=1000, mask=masks).held_back()
        for name in ("simulated", "predicted"):
            assert np.ravel(getattr(found, name)) == pytest.approx(getattr(alone, name), abs=0.1)


@given(
    seed=st.integers(0, 2**32 - 1),
    shape=st.sampled_from([(), (1,), (3,), (2, 2)]),
    kept=st.sampled_from([0.5, 0.9, 0.98]),
    window=st.integers(1, 40),
)
def test_parts_are_without_what_is_left_out_of_all_records(
    seed: int, shape: tuple[int, ...], kept: float, window: int
) -> None:
    generator = np.random.default_rng(seed)
    samples = 200
    mask = np.repeat(generator.random((*shape, samples // 5)) < kept, 5, axis=-1)
    ends = np.sort(generator.choice(samples + 1, 7, replace=False)).tolist()
    parts = list(zip(ends[:5], ends[1:6], ends[2:], strict=True))
    # One sample after the other: one that any record keeps is no place where something else acts on all.
    out = [not any(one[place] for one in mask.reshape(-1, samples)) for place in range(samples)]
    expected = []
    for begin, first, end in parts:
        start, stop = first, first
        while start > begin and not out[start - 1]:
            start -= 1
        while stop < end and not out[stop]:
            stop += 1
        if stop > first and first - start >= min(window, first - begin):
            expected.append((start, first, stop))
    assert without_masked(parts, mask, window) == (expected or parts)
    assert without_masked(parts, None, window) == parts


def test_what_a_mask_leaves_out_of_one_record_is_not_compared_there() -> None:
    """Records of a batch were touched at other times: each is explained as well as alone."""
    rig = tvident.simulate_torsional_rig(20.0, seed=3, angle_noise=1e-3)
    touched = [(rig.time >= begin) & (rig.time < begin + 3) for begin in (3, 11)]
    masks = [~np.convolve(one, np.ones(201), "same").astype(bool) for one in touched]
    angles = [rig.angle + np.where(one, rig.angle.std() * np.sin(9 * rig.time), 0) for one in touched]
    pairs = zip(angles, masks, strict=True)
    alone = [tvident.identify(one, rig.torque, sample_rate=1000, mask=mask).held_back() for one, mask in pairs]
    found = tvident.identify(
        np.stack(angles), np.stack([rig.torque] * 2), sample_rate=1000, mask=np.stack(masks)
    ).held_back()
    for name in ("simulated", "predicted"):
        assert getattr(found, name) == pytest.approx([getattr(one, name) for one in alone], abs=0.1)


def test_where_a_mask_leaves_no_part_all_parts_count() -> None:
    """Every other 10 ms, less than a test function, tells no state: all of the record does, and what is masked is not compared."""
    rig = tvident.simulate_torsional_rig(10.0, seed=3, angle_noise=1e-3)
    mask = np.arange(rig.time.size) // 10 % 2 == 0
    found = tvident.identify(rig.angle, rig.torque, sample_rate=1000, mask=mask).held_back()
    assert not found.why_not
    assert found.simulated > 99.5
