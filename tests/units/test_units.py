"""Units as headers write them: each means what Pint's registry says, or is refused."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pint
import pytest

from tvident import Channel
from tvident._units import LINEAR, ROTARY, factor_of_derivative, factor_to, is_unit, named_unit, unit_of
from tvident._units.symbols import SYMBOLS

PINT: Any = pint.application_registry
INTO = ("kg", "m", "s", "rad", "V", "A", "K", "count")
"""What the powers of a dimension are of."""

OTHER_NAMES = {
    **dict.fromkeys(("rev", "revs", "revolutions", "turns"), "turn"),
    **dict.fromkeys(("cts", "counts", "ticks", "LSB", "digits"), "count"),
    "Nms": "newton * meter * second",
    "gon": "grade",
    "in": "inch",
    "lbs": "pound",
    "lbm": "pound",
    "kp": "kgf",
    "gf": "gram_force",
    "°": "degree",
    "Newton": "newton",
    "Newtons": "newton",
    "Volt": "volt",
    "Volts": "volt",
    "amp": "ampere",
    "amps": "ampere",
    "Amps": "ampere",
    "secs": "second",
    "millisecond": "ms",
    "milliseconds": "ms",
    "msecs": "ms",
    "%": "percent",
    "mdeg": "millidegree",
    "millidegrees": "millidegree",
    "rads": "radian",
    "mrev": "milliturn",
    **dict.fromkeys(("sek", "Sek", "Sekunde", "Sekunden"), "second"),
    **dict.fromkeys(("Joule", "Joules"), "joule"),
    "sec": "second",
    "msec": "ms",
    "usec": "us",
    "nsec": "ns",
}
"""What Pint calls symbols that it does not know, or takes for something else."""


def by_pint(text: str, dimension: tuple[int, ...]) -> float:
    """Give the factor that Pint knows for the same unit."""
    base = " * ".join(f"{unit}**{power}" for unit, power in zip(INTO, dimension, strict=True) if power)
    return float((1 * PINT.parse_units(text)).to(base or "dimensionless").magnitude)


@pytest.mark.parametrize("symbol", [one for one, (factor, _) in SYMBOLS.items() if not np.isnan(factor)])
def test_every_symbol_means_what_pint_says(symbol: str) -> None:
    factor, dimension = SYMBOLS[symbol]
    name = OTHER_NAMES.get(symbol, symbol)
    np.testing.assert_allclose(by_pint(name, dimension), factor, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "pints"),
    [
        *((text, "N*m") for text in ("N m", "Nm", "N·m", "N.m", "N-m", "[Nm]", "(N m)", "N*m", "newton * meter")),
        *((text, "N*mm") for text in ("Nmm", "N mm", "N-mm")),
        ("mNm", "mN*m"),
        ("kNm", "kN*m"),
        ("Ncm", "N*cm"),
        ("lbf-in", "lbf*inch"),
        ("N m s/rad", "N*m*s/rad"),
        ("Nms/rad", "N*m*s/rad"),
        ("Nm/(rad/s)", "N*m*s/rad"),
        ("kgm2", "kg*m**2"),
        ("kg·m²", "kg*m**2"),
        ("rad s⁻²", "rad/s**2"),
        ("°/s", "degree/s"),
        ("m/s2", "m/s**2"),
        ("1/s", "1/s"),
        ("µrad", "urad"),
        ("Nm/A", "N*m/A"),
        *((text, "degree") for text in ("DEG", "Deg", "Degrees", "deg.")),
        *((text, "N*m") for text in ("NM", "N-M", "N\N{NON-BREAKING HYPHEN}m", "N\N{MINUS SIGN}m", "NEWTON-METERS")),
        ("FT-LBF", "ft*lbf"),
        ("DEG/SEC", "degree/s"),
        ("mSec", "ms"),
        ("hrs", "hour"),
        *((text, "degree") for text in ("degs", "Degree(s)", "deg(s)", "DEGS")),
        ("MDEG", "millidegree"),
        *((text, "turn") for text in ("REV", "Revs")),
        *((text, "kN") for text in ("KN", "kilonewton")),
        *((text, "kN*m") for text in ("KNM", "kN * m")),
        ("daNm", "daN*m"),
        *((text, "mm") for text in ("MM", "millimeters")),
        ("MN", "MN"),
        *((text, "MN*m") for text in ("MN m", "MN*m", "MN-m")),
        ("COUNTS", "count"),
        ("KHZ", "kHz"),
        *((text, "second") for text in ("Sek.", "Sekunden")),
        ("kg * m ** 2", "kg*m**2"),
        ("kg m ^ 2", "kg*m**2"),
        ("1 / ms", "1/ms"),
        ("KG", "kg"),
    ],
)
def test_units_as_headers_write_them(text: str, pints: str) -> None:
    unit = unit_of(text)
    assert unit is not None
    np.testing.assert_allclose(by_pint(pints, unit.dimension), unit.factor, rtol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x",
        "angle",
        "Time",
        "t",
        "abs",
        "hh:mm:ss",
        "N m/",
        "N/(m",
        "m^",
        "raw",
        "N" * 70,
        "M",
        "S",
        "Min",
        "Grad",
        "grad",
    ],
)
def test_words_are_no_units(text: str) -> None:
    assert unit_of(text) is None
    assert is_unit(text) == (text == "")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("angle [deg]", ("angle", "deg")),
        ("Torque (Nmm)", ("Torque", "Nmm")),
        ("M/(N·m)", ("M", "N·m")),
        ("t/ms", ("t", "ms")),
        ("angle, deg", ("angle", "deg")),
        ("knee_angle_deg", ("knee_angle", "deg")),
        ("Force [N] (raw)", ("Force (raw)", "N")),
        ("dθ/dt", ("dθ/dt", "")),
        ("L/R", ("L/R", "")),
        ("m/s", ("m/s", "")),
        ("angle (tics)", ("angle", "tics")),
        ("Angle [deg] - AVE", ("Angle - AVE", "deg")),
        ("Torque (Nmm) raw", ("Torque raw", "Nmm")),
        ("[deg] angle", ("angle", "deg")),
        ("H(s) gain", ("H(s) gain", "")),
        ("Y[0]", ("Y[0]", "")),
        ("Y[1]", ("Y[1]", "")),
        ("ratio [1]", ("ratio", "1")),
        ("Angle deg", ("Angle", "deg")),
        ("Angle - deg", ("Angle", "deg")),
        ("Torque N m", ("Torque", "N m")),
        ("torque_N_m", ("torque", "N-m")),
        ("torque_nmm", ("torque", "Nmm")),
        ("position_nm", ("position_nm", "")),
        ("angle_deg_filtered", ("angle_filtered", "deg")),
        ("kneeAngleDeg", ("kneeAngle", "Deg")),
        ("timestamp_ns", ("timestamp", "ns")),
        ("force_kN", ("force", "kN")),
        ("torque_ft_lb", ("torque", "ft-lb")),
        ("angle_min", ("angle_min", "")),
        ("hip_rms", ("hip_rms", "")),
        ("M/Nm", ("M", "Nm")),
        ("angle en deg", ("angle", "deg")),
        ("in s", ("time", "s")),
        ("logged in", ("logged in", "")),
        ("M / N mm", ("M", "N mm")),
        ("s/mm", ("s", "mm")),
        ("N/mm", ("N/mm", "")),
        ("Winkel/Grad", ("Winkel", "Grad")),
        ("ANGLE_DEG", ("ANGLE", "DEG")),
        ("Knee_Angle_Deg", ("Knee_Angle", "Deg")),
        ("FORCE_KN", ("FORCE_KN", "")),
        ("elapsed_turns", ("elapsed_turns", "")),
        ("time_bins", ("time_bins", "")),
        ("Velocity rad per s", ("Velocity rad per s", "")),
        ("Velocity rad s-1", ("Velocity rad s-1", "")),
        ("RATE_DEG_S", ("RATE_DEG_S", "")),
        ("Angle deg raw", ("Angle raw", "deg")),
        ("KneeAngle_deg_", ("KneeAngle", "deg")),
        ("Force_N_", ("Force", "N")),
        ("Angle..deg.", ("Angle", "deg")),
        ("Torque..N.m.", ("Torque", "N.m")),
        ("Angle（deg）", ("Angle", "deg")),  # noqa: RUF001 - as Japanese programs write them
        ("Angle［left］", ("Angle", "left")),  # noqa: RUF001 - likewise
        ("TIME_MS", ("TIME", "ms")),
        *(
            (text, ("Torque", "MNm"))
            for text in ("Torque [MNm]", "Torque_MNm", "Torque MNm", "Torque/MNm", "Torque in MNm")
        ),
        ("Torque (MNm) left", ("Torque left", "MNm")),
        *((text, ("Torque", "mNm")) for text in ("Torque_mNm", "Torque_mnm", "Torque_MNM")),
        *((text, ("t", "Ms")) for text in ("t/Ms", "t, Ms", "t in Ms", "t (Ms)")),
        ("TimeMS", ("Time", "ms")),
        ("timestampNs", ("timestamp", "ns")),
        ("Time..s.", ("Time", "s")),
        ("elapsedMillis", ("elapsed", "ms")),
        ("timestamps", ("timestamps", "")),
        ("header.stamp.nanosec", ("header.stamp.nanosec", "")),
        ("motor_current_A", ("motor_current", "A")),
        ("phase_current_A", ("phase_current_A", "")),
        ("Strom mA", ("Strom", "mA")),
        ("joint_A", ("joint_A", "")),
        ("deg", ("deg", "deg")),
        ("ms", ("ms", "ms")),
        ("millis", ("millis", "ms")),
        ("run.ms", ("run.ms", "")),
        ("TIME [MS]", ("TIME", "ms")),
        ("Time [MS]", ("Time", "MS")),
    ],
)
def test_names_and_units_are_told_apart(name: str, expected: tuple[str, str]) -> None:
    assert named_unit(name) == expected


def test_what_cannot_be_converted_is_refused_with_the_cure() -> None:
    assert factor_to(ROTARY, "torque", "in-lb", name="x") == pytest.approx(0.112984829)
    assert factor_to(LINEAR, "torque", "kgf", name="x") == pytest.approx(9.80665)
    assert factor_to(ROTARY, "time", None, name="x") == 1
    for system, quantity, unit in (
        (ROTARY, "angle", "counts"),
        (ROTARY, "torque", "V"),
        (LINEAR, "torque", "kg"),
        (ROTARY, "angle", "grades"),
        (ROTARY, "time", "°C"),
    ):
        with pytest.raises(ValueError, match=f"{quantity}_unit='{system.units[quantity]}' if the numbers are in"):
            factor_to(system, quantity, unit, name="the channel")


@pytest.mark.parametrize("text", ["Grad", "grad", "[Grad]", "GRAD"])
def test_a_degree_in_german_is_asked_for(text: str) -> None:
    """The cure was angle_unit='rad', which nobody means who writes Grad."""
    with pytest.raises(ValueError, match="angle_unit='deg' or angle_unit='gon'"):
        factor_to(ROTARY, "angle", text, name="the angle")


@pytest.mark.parametrize("text", ["tr", "Umdr.", "tr."])
def test_turns_in_other_languages(text: str) -> None:
    """``Angle (tr)`` was unknown beside ``tr/min``."""
    assert factor_to(ROTARY, "angle", text, name="the angle") == math.tau


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        *((text, math.pi / 30) for text in ("rpm", "1/min", "min-1", "min⁻¹", "U/min", "Umdr./min", "r/min", "tr/min")),
        *((text, math.tau) for text in ("rev/s", "rps", "U/s")),
        *((text, math.pi / 180) for text in ("deg/s", "°/s", "dps")),
        ("rad/s", 1),
    ],
)
def test_speeds_of_turning(text: str, expected: float) -> None:
    """1/min was taken for radians per minute: 6.28 times too small, without a word."""
    assert factor_of_derivative(ROTARY, "velocity", text) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("name", "text"), [("velocity", "1/s"), ("velocity", "Hz"), ("acceleration", "1/s^2")])
def test_what_may_count_turns_or_radians_is_refused(name: str, text: str) -> None:
    with pytest.raises(ValueError, match="whether radians or turns are counted"):
        factor_of_derivative(ROTARY, name, text)


def test_an_accelerometer_measures_in_g() -> None:
    for text, expected in (("g", 9.80665), ("[g]", 9.80665), ("mg", 9.80665e-3), ("mm/s^2", 1e-3)):
        assert factor_of_derivative(LINEAR, "acceleration", text) == pytest.approx(expected, rel=1e-12)
    with pytest.raises(ValueError, match=r"divide it in m/s\^2 by its radius in m"):
        factor_of_derivative(ROTARY, "acceleration", "g")
    with pytest.raises(ValueError, match="converted to m/s; got 'g'"):
        factor_of_derivative(LINEAR, "velocity", "g")


@pytest.mark.parametrize("text", ["A", "mA", "V"])
def test_a_current_is_told_what_makes_a_torque_of_it(text: str) -> None:
    with pytest.raises(ValueError, match="multiplied by the torque of one A or V"):
        factor_to(ROTARY, "torque", text, name="the torque")


@pytest.mark.parametrize("text", ["%", "% rated", "[%]"])
def test_a_percentage_of_a_torque_is_told_what_makes_a_torque_of_it(text: str) -> None:
    """Drives record it; the torque was to be one that is in N m already."""
    with pytest.raises(ValueError, match="a percentage must be multiplied by the torque of 1 %"):
        factor_to(ROTARY, "torque", text, name="the torque")


@pytest.mark.parametrize(
    "text", ["Degree(s)", "[Degree(s)]", "(deg)", "((deg))", "< deg >", "Nm/(rad/s)", "(Nm", "N(m)", "[]", "(-)"]
)
def test_brackets_around_a_unit_are_none_of_it(text: str) -> None:
    """Of ``Degree(s)`` in a line of units the last one was taken off."""
    assert is_unit(text)


@pytest.mark.parametrize(
    ("quantity", "text", "cure"),
    [
        ("time", "MS", "time_unit='ms'"),
        ("time", "[Ms]", "time_unit='ms'"),
        ("time", "mS", "time_unit='ms'"),
        ("angle", "Mrad", "angle_unit='mrad'"),
        ("angle", "Mm", "angle_unit='mm'"),
        ("torque", "MNm", "MN m as written; give torque_unit='mNm', or another"),
        ("torque", "[MNm]", "torque_unit='mNm'"),
    ],
)
def test_a_capital_that_means_a_million_is_asked_for(quantity: str, text: str, cure: str) -> None:
    """Megasiemens were taken for milliseconds, and megametres for millimetres, without a word."""
    assert unit_of(text) is None
    assert is_unit(text)
    with pytest.raises(ValueError, match=f"must mean one thing.*{cure}"):
        factor_to(ROTARY, quantity, text, name=f"the {quantity}")


def test_slices_keep_their_unit_and_what_is_computed_has_none() -> None:
    angle = Channel(np.arange(10.0), "deg")
    for same in (angle[2:5], angle.copy(), pickle.loads(pickle.dumps(angle))):  # noqa: S301 - our own
        assert isinstance(same, Channel)
        assert same.unit == "deg"
    for computed in (angle * 2, angle**2, np.deg2rad(angle), angle.mean(keepdims=True)):
        assert not isinstance(computed, Channel)
    for kept in (-angle, angle - angle.mean(), angle - angle[0], 1 + angle, np.abs(angle), np.diff(angle)):
        assert isinstance(kept, Channel)
        assert kept.unit == "deg"
    np.testing.assert_array_equal(angle - angle[0], np.arange(10.0))
    with pytest.raises(ValueError, match="must be in one unit; got 'deg' and 'rad'; convert one with"):
        angle - Channel(angle, "rad")
    written_otherwise: Any = angle - Channel(angle, "°")
    assert written_otherwise.unit == "deg"
    for other in (np.add.reduce(angle), np.subtract.outer(angle, angle)):
        assert not isinstance(other, Channel)
    moved = angle.copy()
    moved -= 1
    assert moved.unit == "deg"
    turned = angle.to("rad")
    assert turned.unit == "rad"
    np.testing.assert_allclose(turned, np.deg2rad(np.arange(10.0)))
    with pytest.raises(ValueError, match="one of the same quantity; got 'deg' and 'N m'"):
        angle.to("N m")


@pytest.mark.parametrize("unit", [5, None, (), b"rad", [1]])
def test_a_unit_is_a_text(unit: object) -> None:
    with pytest.raises(TypeError, match="a unit must be a text"):
        Channel(np.zeros(3), "rad").to(unit)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="a unit must be a text"):
        Channel(np.zeros(3), unit)  # type: ignore[arg-type]


def test_a_unit_that_is_long_makes_no_long_message() -> None:
    with pytest.raises(ValueError, match="same quantity") as refused:
        Channel(np.zeros(3), "x" * 5000).to("rad")
    assert len(str(refused.value)) < 200


@pytest.mark.parametrize(
    ("name", "bare", "unit", "factor"),
    [
        ("torque_pct", "torque", "%", None),
        ("Target Torque percent", "Target Torque", "%", None),
        ("\u30c8\u30eb\u30af[N\u30fbm]", "\u30c8\u30eb\u30af", "N\u30fbm", 1.0),
        ("\u00c1ngulo [grados]", "\u00c1ngulo", "grados", np.pi / 180),
        ("Hoek (graden)", "Hoek", "graden", np.pi / 180),
    ],
)
def test_units_of_other_languages_and_percentages(name: str, bare: str, unit: str, factor: float | None) -> None:
    """`torque_pct` was N m: an inertia of 1.23 for .0123; the others were refused as unknown."""
    assert named_unit(name) == (bare, unit)
    found = unit_of(unit)
    assert found is not None
    if factor is not None:
        assert found.factor == pytest.approx(factor)
