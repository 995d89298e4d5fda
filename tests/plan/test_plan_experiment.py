"""Plans: the bound holds in simulation, and what is planned reaches what was wanted."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from commands import run

GUESS: dict[str, Any] = {"inertia": 0.0123, "damping": 0.05, "stiffness": 13.0, "band": (0.5, 12)}

WITHIN = 0.1
"""Of the bound: what is promised."""


def recorded(plan: tvident.ExperimentPlan, seed: int, noise: tuple[float, float]) -> tuple[Any, Any]:
    """Give the steady response to what was planned, which sines give exactly."""
    generator = np.random.default_rng(seed)
    time = np.arange(round(plan.duration * 1000)) / 1000
    s = 2j * np.pi * plan.frequencies
    phasors = plan.amplitudes * np.exp(1j * generator.uniform(0, 2 * np.pi, s.size))
    torque, angle = np.zeros((2, time.size))
    for one, phasor in zip(s, phasors, strict=True):
        turning = phasor * np.exp(one * time)
        torque += turning.real
        angle += (turning / (GUESS["inertia"] * one**2 + GUESS["damping"] * one + GUESS["stiffness"])).real
    return angle + noise[0] * generator.standard_normal(time.size), torque + noise[1] * generator.standard_normal(
        time.size
    )


@pytest.mark.parametrize("angle_noise", [1e-6, 1e-3])
def test_errors_are_the_bound(angle_noise: float) -> None:
    plan = tvident.plan_experiment(**GUESS, torque_noise=0.02, angle_noise=angle_noise, torque_rms=0.2, duration=10)
    constant: dict[str, Any] = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")
    errors: dict[str, list[float]] = {name: [] for name in constant}
    off: list[float] = []
    for seed in range(4):
        angle, torque = recorded(plan, seed, (angle_noise, 0.02))
        result = tvident.identify(angle, torque, sample_rate=1000, **constant)
        for name, found in errors.items():
            found.append(result.constants[name][1] / GUESS[name])
            off.append((result.constants[name][0] - GUESS[name]) / (plan.errors[name] * GUESS[name]))
    for name, found in errors.items():
        assert np.mean(found) == pytest.approx(plan.errors[name], rel=WITHIN), name
    # Twelve numbers of variance one, at four standard deviations.
    assert np.mean(np.square(off)) < 1 + 4 * math.sqrt(2 / 12)


@pytest.mark.slow
def test_a_stiffness_that_changes_has_the_bound_of_its_windows() -> None:
    plan = tvident.plan_experiment(**GUESS, torque_noise=0.02, torque_rms=0.2, duration=20, resolution=2.0)
    angle, torque = recorded(plan, 0, (0.0, 0.02))
    pulses = tvident.Expansion("block_pulse", size=10)
    result = tvident.identify(angle, torque, sample_rate=1000, inertia="constant", damping="constant", stiffness=pulses)
    # Windows are 2 s, of sines of 0.5 Hz and more: information scatters from window to window.
    found = np.sqrt(np.mean(result.stderr["stiffness"] ** 2)) / 13
    assert found == pytest.approx(plan.errors["stiffness"], rel=WITHIN)


def test_duration_and_amplitude_reach_what_is_wanted() -> None:
    long = tvident.plan_experiment(**GUESS, torque_noise=0.02, torque_rms=0.005)
    assert long.reached
    assert long.errors["stiffness"] == pytest.approx(0.02, rel=1e-3)
    strong = tvident.plan_experiment(**GUESS, torque_noise=0.02, duration=long.duration)
    assert strong.torque_rms == pytest.approx(0.005, rel=1e-3)
    torque = strong.excitation(sample_rate=100)
    assert torque.std() == pytest.approx(strong.torque_rms, rel=0.3)
    # Milliseconds would do if a period of the torque fitted in.
    short = tvident.plan_experiment(**GUESS, torque_noise=0.02, torque_rms=0.5)
    assert short.duration == pytest.approx(10 / 0.5)
    assert short.errors["stiffness"] < 0.002
    assert "record 20 s, ten periods of 0.5 Hz: less torque would do" in short.summary()
    hasty = tvident.plan_experiment(**GUESS, torque_noise=0.02, torque_rms=0.5, duration=3)
    assert "these hold 1.5 periods of 0.5 Hz: errors will be larger" in hasty.summary()
    assert "errors will be larger" not in short.summary()
    never = tvident.plan_experiment(**GUESS, torque_noise=0.02, torque_rms=1e-4, resolution=0.2)
    assert not never.reached
    assert "cannot be reached" in never.summary()


def test_power_goes_where_it_tells_most() -> None:
    plan = tvident.plan_experiment(**GUESS, torque_noise=0.02, torque_rms=0.1, duration=10)
    assert np.sum(plan.amplitudes**2) / 2 == pytest.approx(0.01)
    even = tvident.plan_experiment(**{**GUESS, "band": (0.5, 0.6)}, torque_noise=0.02, torque_rms=0.1, duration=10)
    assert plan.errors["stiffness"] < even.errors["stiffness"]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"stiffness": None}, "guess of stiffness"),
        ({"band": (3, 1)}, "must rise"),
        ({"band": None}, r"band=\(0.5, 12\)"),
        ({"torque_rms": None}, "torque or the time"),
        ({"band": 5}, "lowest and the highest frequency; got 5"),
        ({"band": "0.5 12"}, "lowest and the highest frequency; got '0.5 12'"),
        ({"band": [(1, 2), 3]}, r"lowest and the highest frequency; got \[\(1, 2\), 3\]"),
    ],
)
def test_what_is_missing_is_said(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        tvident.plan_experiment(**{**GUESS, "torque_noise": 0.02, "torque_rms": 0.1, **changed})


def test_what_would_be_ignored_is_refused() -> None:
    """A guess beside a result was, without a word, and so was `more` without one."""
    rig = tvident.simulate_torsional_rig(duration=4.0)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    # Constants of a part are those of the whole: errors were taken as those of so short a record.
    with pytest.raises(
        ValueError, match=r"got a part of .* samples; pass the whole result, or identify the part alone"
    ):
        tvident.plan_experiment(result=result.between(1, 2))
    assert tvident.plan_experiment(result=result.between()).errors == tvident.plan_experiment(result=result).errors
    with pytest.raises(TypeError, match="got result= and inertia=, band=; leave out one"):
        tvident.plan_experiment(result=result, inertia=0.01, band=(1, 2))
    with pytest.raises(TypeError, match="got result= and angle_noise=, sample_rate=; leave out one"):
        tvident.plan_experiment(result=result, sample_rate=500, angle_noise=0.0)
    with pytest.raises(TypeError, match="more must go with result="):
        tvident.plan_experiment(**GUESS, torque_noise=0.02, torque_rms=0.1, more=5)
    ran = run("plan", "one.npz", "--inertia", "0.01")
    assert ran.returncode == 2
    assert "got 'one.npz' and --inertia; leave out one of them" in ran.stderr
    assert run("plan", "--inertia", "0.01", "--more", "5").returncode == 2


def test_a_torque_has_the_frequencies_of_its_plan_or_is_refused() -> None:
    """Sines beyond half the rate came out as others, and a plan to go on with a recording as zeros."""
    plan = tvident.plan_experiment(**GUESS, torque_noise=0.02, torque_rms=0.1)
    with pytest.raises(ValueError, match="more than twice the highest frequency, 12 Hz; got 5 Hz; raise it"):
        plan.excitation(sample_rate=5)
    with pytest.raises(ValueError, match="seed must be at least 0; got -1"):
        plan.excitation(sample_rate=100, seed=-1)
    rig = tvident.simulate_torsional_rig(duration=4.0)
    longer = tvident.plan_experiment(result=tvident.identify(rig.angle, rig.torque, sample_rate=1000))
    with pytest.raises(ValueError, match="one to go on with a recording"):
        longer.excitation(sample_rate=100)


def test_units_are_those_of_the_axis(tmp_path: Any) -> None:
    turning = tvident.plan_experiment(**GUESS, torque_noise=0.02, angle_noise=1e-4, torque_rms=0.01)
    inner = tvident.plan_experiment(
        **GUESS, torque_noise=20, angle_noise=math.degrees(1e-4), torque_rms=10, angle_unit="deg", torque_unit="N mm"
    )
    np.testing.assert_allclose(inner.amplitudes, turning.amplitudes, rtol=1e-12)
    assert inner.duration == pytest.approx(turning.duration, rel=1e-9)
    assert inner.units == turning.units
    assert turning.units["stiffness"] == "N m/rad"
    sliding = tvident.plan_experiment(**GUESS, torque_noise=0.02, angle_noise=0.1, torque_rms=0.01, angle_unit="mm")
    # One equation is the other in other units, and so is what is said.
    np.testing.assert_array_equal(sliding.amplitudes, turning.amplitudes)
    assert sliding.units == {"angle": "m", "torque": "N", "inertia": "kg", "damping": "N s/m", "stiffness": "N/m"}
    words = turning.summary().replace("torque", "force").replace("the angle", "the position")
    # The column of amplitudes is narrower.
    assert sliding.summary().split() == words.replace("N m", "N").replace(" rad ", " m ").split()
    assert "torque_rms= in N, or" in refused(angle_unit="mm")
    assert "torque_rms= in N mm, or" in refused(torque_unit="N mm")
    assert "angle and torque must be those of one axis" in refused(angle_unit="mm", torque_unit="N mm")
    # What goes on from a result has its units.
    rig = tvident.simulate_torsional_rig(duration=4.0)
    channels = (tvident.Channel(rig.angle, "m"), tvident.Channel(rig.torque, "N"))
    tvident.identify(*channels, sample_rate=1000).save(tmp_path / "one.npz")
    assert tvident.plan_experiment(result=tvident.load(tmp_path / "one.npz")).units == sliding.units


def refused(**units: Any) -> str:
    with pytest.raises(ValueError, match=r"must|needs") as said:
        tvident.plan_experiment(**GUESS, torque_noise=0.02, **units)
    return str(said.value)


def test_the_command_says_units_and_writes_them(tmp_path: Any) -> None:
    numbers = "--inertia 1.2 --damping 3 --stiffness 1300 --band 0.5 12 --torque-noise 0.02 --torque-rms 0.1"
    slides = ["plan", *numbers.split(), "--torque-unit", "N"]
    ran = run(*slides, "-o", str(tmp_path / "force.csv"))
    assert ran.returncode == 0, ran.stderr
    assert "force of 0.1 N rms, which moves the position by about" in ran.stdout
    assert not re.search(r"N m|rad\b|torque|angle", ran.stdout)
    assert (tmp_path / "force.csv").read_text().startswith("time [s],torque [N]\n")
    found = json.loads(run(*slides, "--json").stdout)
    assert found["units"]["torque"] == "N"
    assert found["units"]["inertia"] == "kg"
    assert found["torque_rms"] == 0.1
    assert found["verdict"] == ran.stdout.splitlines()[0]
    assert len(found["frequencies"]) == len(found["amplitudes"]) > 0
    rig = tvident.simulate_torsional_rig(duration=4.0)
    tvident.identify(rig.angle, rig.torque, sample_rate=1000).save(tmp_path / "one.npz")
    more = json.loads(run("plan", str(tmp_path / "one.npz"), "--json").stdout)
    assert (more["torque_rms"], more["frequencies"]) == (None, [])
    assert more["units"]["torque"] == "N m"
    assert 0 < more["errors"]["inertia"] < more["before"]["inertia"]


def test_the_command(tmp_path: Any) -> None:
    numbers = "--inertia 0.0123 --damping 0.05 --stiffness 13 --band 0.5 12 --torque-noise 0.02 --torque-rms 0.01"
    words = ["plan", *numbers.split(), "-o"]
    ran = run(*words, str(tmp_path / "torque.csv"))
    assert ran.returncode == 0, ran.stderr
    assert "stiffness within 2 %: record" in ran.stdout
    assert (tmp_path / "torque.csv").exists()
    rig = tvident.simulate_torsional_rig(duration=4.0)
    tvident.identify(rig.angle, rig.torque, sample_rate=1000, stiffness=13.0).save(tmp_path / "given.npz")
    given = run("plan", str(tmp_path / "given.npz"))
    assert "stiffness within 2 %: no error of it is known" in given.stdout
    tvident.identify(rig.angle, rig.torque, sample_rate=1000).save(tmp_path / "one.npz")
    more = run("plan", str(tmp_path / "one.npz"), "--more", "60")
    assert more.returncode == 0, more.stderr
    assert "stiffness within 2 %: reached already; expected of 64 s in all:" in more.stdout
    known = run("plan", str(tmp_path / "one.npz"), "--wanted", "0.00001")
    assert "cannot be reached by recording longer" in known.stdout


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "name", ["inertia", "damping", "stiffness", "torque_noise", "angle_noise", "duration", "wanted"]
)
@pytest.mark.parametrize("value", [1e-300, 1e-24, 1e24, 1e300])
def test_numbers_at_the_limits_of_doubles_are_refused_or_planned(name: str, value: float) -> None:
    guess: dict[str, Any] = {"inertia": 0.01, "damping": 0.01, "stiffness": 0.4, "band": (1, 10), "torque_noise": 0.01}
    try:
        plan = tvident.plan_experiment(**{**guess, "duration": 10.0, name: value})
    except ValueError as refused:
        assert "; take other units" in str(refused) or "; check the units" in str(refused)  # noqa: PT017 - or none
    else:
        assert np.isfinite([plan.duration, plan.torque_rms, plan.angle_rms, *plan.errors.values()]).all()


def test_a_part_stays_one_in_a_file_and_of_a_batch(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=2.0)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    result.between(0.5, 1).save(tmp_path / "part.npz")
    batch = tvident.identify(np.stack([rig.angle] * 2), np.stack([rig.torque] * 2), sample_rate=1000)
    for part in (tvident.load(tmp_path / "part.npz"), batch.between(0.5, 1)[0], batch[0].between(0.5, 1)):
        with pytest.raises(ValueError, match="got a part of 501 samples"):
            tvident.plan_experiment(result=part)
    tvident.plan_experiment(result=batch[0])
