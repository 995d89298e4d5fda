"""Units of channels: what is in degrees, newton millimetres and milliseconds gives the same result as in rad, N m and s."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray

import tvident

RIG = tvident.simulate_torsional_rig(duration=4.0, pattern="constant", seed=3)
PLAIN = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000)


def assert_same(found: tvident.Identification) -> None:
    """Compare results of the same samples that were rounded once more: by some 1e-16, which equations amplify by their condition."""
    for name, (value, error) in PLAIN.constants.items():
        assert abs(found.constants[name][0] - value) < 1e-3 * error
    np.testing.assert_allclose(found.stiffness, PLAIN.stiffness, rtol=1e-6)


def test_units_that_are_given() -> None:
    found = tvident.identify(
        np.rad2deg(RIG.angle), 1e3 * RIG.torque, t=1e3 * RIG.time, angle_unit="deg", torque_unit="N mm", time_unit="ms"
    )
    assert_same(found)
    assert found.settings["sample_rate"] == pytest.approx(1000)
    assert_same(tvident.identify(np.rad2deg(RIG.angle), RIG.torque, delta=1, angle_unit="°", time_unit="ms"))


def test_units_that_channels_say(tmp_path: Path) -> None:
    with (tmp_path / "x.csv").open("w") as file:
        file.write("Zeit;Winkel;M\nms;°;Nmm\n")
        for row in zip(1e3 * RIG.time, np.rad2deg(RIG.angle), 1e3 * RIG.torque, strict=True):
            file.write(";".join(map(repr, map(float, row))) + "\n")
    recording = tvident.read_recording(tmp_path / "x.csv")
    call: dict[str, Any] = {"angle": recording["Winkel"], "torque": recording["M"]}
    assert_same(tvident.identify(**call, t=recording["Zeit"]))
    assert_same(tvident.identify(**call, sample_rate=recording.sample_rate))
    degrees = xarray.DataArray(np.rad2deg(RIG.angle), dims="time", attrs={"units": "degrees"})
    assert_same(tvident.identify(degrees, RIG.torque, sample_rate=1000, angle_unit="degrees"))
    compared = tvident.compare_models(
        **call, models={"a": {}, "b": {"damping": 0}}, sample_rate=1000, stiffness="constant"
    )
    assert compared.results["a"].constants["inertia"][0] == pytest.approx(PLAIN.constants["inertia"][0], rel=0.01)


def test_an_attribute_that_arithmetic_kept_converts_nothing() -> None:
    """np.deg2rad of an xarray or a pandas series still says degrees: it was converted twice, I 3283 times too large, without a word."""
    series = pd.Series(np.rad2deg(RIG.angle))
    series.attrs["units"] = "deg"
    array = xarray.DataArray(np.rad2deg(RIG.angle), dims="time", attrs={"units": "deg"})
    for angle in (series, array):
        for one in (angle, np.deg2rad(angle)):
            with pytest.raises(ValueError, match="angle_unit='deg', or angle_unit='rad' if they were converted"):
                tvident.identify(one, RIG.torque, sample_rate=1000)
        assert_same(tvident.identify(angle, RIG.torque, sample_rate=1000, angle_unit="deg"))
        assert_same(tvident.identify(np.deg2rad(angle), RIG.torque, sample_rate=1000, angle_unit="rad"))
    velocity = xarray.DataArray(RIG.true_velocity, dims="time", attrs={"units": "deg/s"})
    with pytest.raises(ValueError, match="velocity must be in the unit of results"):
        tvident.identify(RIG.angle, RIG.torque, velocity=velocity, sample_rate=1000)
    times = xarray.DataArray(1e3 * RIG.time, dims="time", attrs={"units": "ms"})
    assert_same(tvident.identify(RIG.angle, RIG.torque, t=times))
    plain = xarray.DataArray(RIG.angle, dims="time", attrs={"units": "rad"})
    assert_same(tvident.identify(plain, RIG.torque, sample_rate=1000))


def test_times_that_were_computed_from_labels_are_not_converted_again() -> None:
    """Arithmetic of xarray keeps `units`, so `angle.time / 1000` was divided by 1000 twice: 1 MHz, *I* a millionth, without a word."""
    labels = {"time": ("time", 1e3 * RIG.time, {"units": "ms"})}
    angle, torque = (xarray.DataArray(one, dims="time", coords=labels) for one in (RIG.angle, RIG.torque))
    assert_same(tvident.identify(angle, torque, t=angle.time))
    seconds = (angle.time / 1000).assign_attrs(units="ms")  # as arithmetic of recent versions leaves it
    with pytest.raises(ValueError, match=r"an attribute says 'ms'.*or time_unit='s' if they were converted"):
        tvident.identify(angle, torque, t=seconds)
    with pytest.raises(ValueError, match=r"an attribute says 'ms'.*; pass \.to_numpy\(\) in s$"):
        tvident.fit_local_polynomials(angle, 51, t=seconds)
    assert_same(tvident.identify(angle, torque, t=seconds, time_unit="s"))
    assert_same(tvident.identify(angle, torque, t=seconds.to_numpy()))
    with pytest.raises(ValueError, match="must be that of the times that the samples are labelled with; got 1 s"):
        tvident.identify(angle, torque, t=angle.time.to_numpy())
    assert_same(tvident.identify(angle, torque, t=angle.time.to_numpy(), time_unit="ms"))


def test_a_position_and_a_force_are_a_linear_axis(tmp_path: Path) -> None:
    found = tvident.identify(1e3 * RIG.angle, RIG.torque, sample_rate=1000, angle_unit="mm", torque_unit="N")
    assert_same(found)
    assert (found.units["inertia"], found.units["damping"], found.units["stiffness"]) == ("kg", "N s/m", "N/m")
    words = found.summary() + found.scan().summary()
    assert "rad" not in words
    assert "N m" not in words
    assert " m in the position" in words
    assert "angle" not in words
    assert found.plot().axes[0].get_ylabel() == "N/m"
    found.save(tmp_path / "x.csv")
    assert (tmp_path / "x.csv").read_text().startswith("time [s],inertia [kg],inertia_stderr [kg],damping [N s/m],")


@pytest.mark.parametrize(
    ("units", "message"),
    [
        ({"angle_unit": "counts"}, "the angle must be in a unit that can be converted to rad; got 'counts'"),
        ({"torque_unit": "V"}, "the torque must be in a unit that can be converted to N m; got 'V'"),
        (
            {"angle_unit": "rad", "torque_unit": "N"},
            "an angle beside a torque or a position beside a force; got 'rad' and 'N'; give torque_unit='N m', say, if the axis turns",
        ),
        (
            {"angle_unit": "mm", "torque_unit": "N mm"},
            "got 'mm' and 'N mm'; give torque_unit='N', say, if the axis slides and this is a force, or angle_unit='deg' if it turns",
        ),
        (
            {"angle_unit": "mm", "torque_unit": "kg cm"},
            "got 'mm' and 'kg cm'; give torque_unit='N', say, if the axis slides",
        ),
        ({"angle_unit": "mm", "torque_unit": "V"}, "the torque must be in a unit that can be converted to N; got 'V'"),
        ({"time_unit": "ticks"}, "got 'ticks'; write one of s, ms, min"),
        ({"angle_unit": "furlong"}, "must be one that is known; got 'furlong'"),
    ],
)
def test_units_that_cannot_be_meant_are_refused(units: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, **units)
    with pytest.raises(TypeError, match="angle_unit must be text"):
        tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, angle_unit=1)  # type: ignore[call-overload]


def advice(angle: Any, torque: Any, **call: Any) -> str:
    return "; ".join(tvident.identify(angle, torque, **{"sample_rate": 1000, "stiffness": "constant", **call}).advice)


def test_numbers_that_are_not_plausible_are_asked_about() -> None:
    assert "?" not in advice(RIG.angle, RIG.torque)
    degrees = np.rad2deg(RIG.angle) / np.abs(np.rad2deg(RIG.angle)).max() * 160
    assert "the angle reaches" in advice(degrees, RIG.torque)
    assert "160: degrees?" in advice(degrees, RIG.torque)
    assert "degrees?" not in advice(degrees, RIG.torque, angle_unit="deg")
    counts = np.round(RIG.angle / (2 * np.pi) * 8192)
    assert "in whole numbers: counts of an encoder, or degrees?" in advice(counts, RIG.torque)
    first = tvident.identify(counts, RIG.torque, sample_rate=1000).summary().splitlines()[0]
    assert first.endswith("all in other units if a channel is: see what to do")
    doubtful, known = (
        tvident.identify(degrees, RIG.torque, sample_rate=1000, angle_unit=unit).summary().splitlines()[0]
        for unit in (None, "deg")
    )
    assert doubtful == f"{known}; all in other units if a channel is: see what to do"
    assert "time in milliseconds?" in advice(RIG.angle, RIG.torque, sample_rate=None, t=1e3 * RIG.time)
    assert "time in milliseconds?" in advice(RIG.angle, RIG.torque, sample_rate=None, t=1e2 * RIG.time)  # of 10 kHz
    assert "milliseconds" not in advice(RIG.angle, RIG.torque, sample_rate=None, t=10 * RIG.time)
    reversed_sign = advice(RIG.angle, -RIG.torque)
    assert "negative: is the torque's sign reversed, are the channels swapped?" in reversed_sign
    assert "inertia" in reversed_sign
    assert "stiffness" in reversed_sign


def test_times_that_count_samples_are_asked_about() -> None:
    """A counter heard "milliseconds?" alone, which is right at 1 kHz only."""
    counted = advice(RIG.angle, RIG.torque, sample_rate=None, t=np.arange(1, 1 + RIG.angle.size))
    assert "time_unit='ms' with t= or delta=; if it counts samples, give sample_rate= in its place" in counted
    assert "counts samples" not in advice(RIG.angle, RIG.torque, sample_rate=None, t=1e2 * RIG.time)


@pytest.mark.parametrize(
    ("factor", "first", "word", "unit"),
    [
        (1e6, 0.0, "microseconds", "us"),
        (1e5, 0.0, "microseconds", "us"),  # 10 kHz
        (1 / 86_400, 45_296.5, "days", "days"),
        (1 / 86_400, 739_200.5, "days", "days"),
    ],
)
def test_stamps_and_days_are_asked_about_with_the_unit_that_cures(
    factor: float, first: float, word: str, unit: str
) -> None:
    """Nanoseconds heard "milliseconds?", which left an inertia of 1e4 kg m², and days nothing."""
    times = first + factor * RIG.time
    if factor > 1:
        times = np.round(times).astype(np.int64)
    call: dict[str, Any] = {"sample_rate": 1000, "stiffness": "constant"}
    result = tvident.identify(RIG.angle, RIG.torque, **{**call, "sample_rate": None, "t": times})
    assert f"is the time in {word}? Then give time_unit='{unit}' with t=" in "; ".join(result.advice)
    assert "all in other units if a channel is" in result.summary().splitlines()[0]
    cured = tvident.identify(RIG.angle, RIG.torque, **{**call, "sample_rate": None, "t": times}, time_unit=unit)
    assert "is the time in" not in "; ".join(cured.advice)
    if factor == 1e6:
        expected = tvident.identify(RIG.angle, RIG.torque, **call).constants["inertia"][0]
        assert cured.constants["inertia"][0] == pytest.approx(expected, rel=1e-6)


def test_nanoseconds_since_1970_are_refused_with_the_unit_that_cures() -> None:
    """They were asked about, beside an inertia of 1e16 kg m²."""
    times = np.round(1.7e18 + 1e9 * RIG.time).astype(np.int64)
    call: dict[str, Any] = {"stiffness": "constant", "t": times}
    with pytest.raises(ValueError, match=r"if it counts nanoseconds since 1970, .* or give time_unit='ns'"):
        tvident.identify(RIG.angle, RIG.torque, **call)
    cured = tvident.identify(RIG.angle, RIG.torque, **call, time_unit="ns")
    expected = tvident.identify(RIG.angle, RIG.torque, stiffness="constant", sample_rate=1000)
    assert cured.constants["inertia"][0] == pytest.approx(expected.constants["inertia"][0], rel=1e-6)


@pytest.mark.parametrize(
    ("step", "words", "units"),
    [
        (1e9 / 51_200, "microseconds (51.2 Hz) or nanoseconds (51.2 kHz)", ("us", "ns")),
        (1e6 / 51_200, "milliseconds (51.2 Hz) or microseconds (51.2 kHz)", ("ms", "us")),
        (1e9 / 1000, "nanoseconds", ("ns",)),
        (60.0, "microseconds", ("us",)),
        (1e11, "nanoseconds", ("ns",)),
    ],
)
def test_both_units_of_time_are_named_where_both_are_possible(step: float, words: str, units: tuple[str, ...]) -> None:
    """Nanoseconds at 51.2 kHz heard "microseconds?" alone."""
    result = tvident.identify(RIG.angle, RIG.torque, t=step * np.arange(RIG.angle.size), stiffness="constant")
    asked = next(one for one in result.advice if "is the time in" in one)
    given = " or ".join(f"time_unit='{unit}'" for unit in units)
    assert asked.endswith(f"is the time in {words}? Then give {given} with t= or delta=")


def test_a_damping_that_feeds_energy_and_a_spring_that_pushes_are_asked_about() -> None:
    generator = np.random.default_rng(0)
    t = np.arange(8000) / 1000
    phases = generator.uniform(0, 2 * np.pi, 12)
    rates = 2 * np.pi * np.linspace(0.7, 9, 12)
    angle, velocity, acceleration = (
        sum(
            np.real((1j * rate) ** order * 0.1 * np.exp(1j * (rate * t + phase)))
            for rate, phase in zip(rates, phases, strict=True)
        )
        for order in range(3)
    )
    torque = 0.02 * acceleration - 0.3 * velocity - 12 * angle + 0.01 * generator.standard_normal(t.size)
    words = advice(angle + 1e-5 * generator.standard_normal(t.size), torque)
    assert "damping is negative: energy would be fed in" in words
    assert "stiffness has the other sign than inertia" in words


def test_units_and_questions_stay_with_the_parts_of_a_result(tmp_path: Path) -> None:
    both = np.stack([RIG.angle, RIG.angle]), np.stack([RIG.torque, -RIG.torque])
    found = tvident.identify(*both, sample_rate=1000, angle_unit="m", torque_unit="N", stiffness="constant")
    assert sum("sign reversed" in line for line in found.advice) == 1
    assert "sign reversed" not in "".join(found[0].advice)
    assert "sign reversed" in "".join(found[1].advice)
    assert found[1].between(1, 2).units["stiffness"] == "N/m"
    found[0].save(tmp_path / "x.npz")
    again = tvident.load(tmp_path / "x.npz")
    assert again.units["stiffness"] == again.scan().units["stiffness"] == "N/m"
    assert "kg" in str(again.value("inertia"))


def test_channels_with_units_are_converted_wherever_they_are_taken() -> None:
    degrees, millimetres = tvident.Channel(np.rad2deg(RIG.angle), "deg"), tvident.Channel(1e3 * RIG.torque, "N mm")
    assert PLAIN.vaf(degrees, millimetres) == pytest.approx(PLAIN.vaf(RIG.angle, RIG.torque))
    np.testing.assert_allclose(
        PLAIN.simulate(millimetres, angle=degrees), PLAIN.simulate(RIG.torque, angle=RIG.angle), rtol=1e-9
    )
    with pytest.raises(ValueError, match="the torque must be in a unit that can be converted to N m; got 'V'"):
        PLAIN.vaf(degrees, tvident.Channel(RIG.torque, "V"))
    inertia = tvident.Channel(np.full(RIG.angle.size, 0.0123e7), "g cm^2")
    known = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, inertia=inertia)
    assert known.inertia[0] == pytest.approx(0.0123)
    damping = tvident.Channel(np.full(RIG.angle.size, 8.0), "N mm s")
    assert tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, damping=damping).damping[0] == pytest.approx(0.008)
    with pytest.raises(
        ValueError, match=r"a known inertia must be in a unit that can be converted to kg m\^2; got 'kg'"
    ):
        tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, inertia=tvident.Channel(inertia, "kg"))


def test_a_result_with_functions_of_ones_own_can_be_stored() -> None:
    term = tvident.Term("own", lambda t, angle, velocity: angle**3)  # noqa: ARG005 - what a term is given
    found = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, terms=["offset", term])
    assert len(pickle.dumps(found)) < 2 * sum(values.nbytes for values in found.columns().values())
    assert pickle.loads(pickle.dumps(found)).advice == found.advice  # noqa: S301 - our own


def test_an_angle_that_wraps_at_a_turn_is_in_rad() -> None:
    """It was asked for its unit again where the unwrapped angle moved through two turns."""
    angle, torque = 100 * RIG.angle, 100 * RIG.torque
    assert "degrees?" in advice(angle, torque)
    wrapped = np.angle(np.exp(1j * angle))
    assert "degrees?" not in advice(wrapped, torque, period=2 * np.pi)
