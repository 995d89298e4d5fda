"""Units and labels that arrays bring along: used, or refused where nobody knows whether they still hold."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import tvident

pd = pytest.importorskip("pandas")
pl = pytest.importorskip("polars")
xr = pytest.importorskip("xarray")
pint = pytest.importorskip("pint")

RIG = tvident.simulate_torsional_rig(duration=1.0)
ANGLE, TORQUE, N = RIG.angle, RIG.torque, RIG.angle.size
DEGREES, MILLI = np.rad2deg(ANGLE), 1000 * TORQUE
GIVEN: dict[str, Any] = {"inertia": 0.0123, "method": tvident.WeakForm(window_length=33, exponent=9)}
PLAIN = tvident.identify(ANGLE, TORQUE, sample_rate=1000, **GIVEN)
UNIT = pint.application_registry


def assert_is_plain(angle: Any, torque: Any, **options: Any) -> None:
    found = tvident.identify(angle, torque, **({"sample_rate": 1000} | GIVEN | options))
    assert_allclose(found.stiffness, PLAIN.stiffness, rtol=1e-9)


@pytest.mark.filterwarnings("error")
def test_quantities_of_pint_are_converted() -> None:
    assert_is_plain(DEGREES * UNIT.deg, MILLI * UNIT.newton * UNIT.millimeter)
    assert_is_plain(ANGLE / (2 * np.pi) * UNIT.turn, TORQUE / 1.3558179483314 * UNIT.foot * UNIT.force_pound)
    times = 1000 * np.asarray(RIG.time) * UNIT.ms
    assert_is_plain(ANGLE * UNIT.rad, TORQUE * UNIT("N*m").units, sample_rate=None, t=times)
    with pytest.raises(ValueError, match="the torque must be in a unit that can be converted to N m; got 'V'"):
        assert_is_plain(ANGLE, TORQUE * UNIT.volt)


@pytest.mark.parametrize(
    "series", [lambda values, name: pd.Series(values, name=name), lambda values, name: pl.Series(name, values)]
)
def test_the_unit_in_the_name_of_a_series_is_never_overlooked(series: Any) -> None:
    """What pandas computes keeps the name: both np.deg2rad(series) and the series itself say [deg]."""
    angle, torque = series(DEGREES, "angle [deg]"), series(MILLI, "Torque (Nmm)")
    with pytest.raises(
        ValueError, match=r"name says 'deg'.*give angle_unit='deg', or angle_unit='rad' if they were converted"
    ):
        assert_is_plain(angle, TORQUE)
    with pytest.raises(ValueError, match=r"name says 'Nmm'.*give torque_unit='Nmm', or torque_unit='N m'"):
        assert_is_plain(ANGLE, torque)
    assert_is_plain(angle, torque, angle_unit="deg", torque_unit="N mm")
    assert_is_plain(series(ANGLE, "angle [deg]"), torque, angle_unit="rad", torque_unit="N mm")
    assert_is_plain(series(ANGLE, "angle [rad]"), series(TORQUE, "motor current [A]"))
    with pytest.raises(ValueError, match=r"the time must say its unit where its name says 'ms'"):
        assert_is_plain(ANGLE, TORQUE, sample_rate=None, t=series(RIG.time, "t [ms]"))
    # Seconds are no whole numbers of milliseconds' name.
    assert_is_plain(ANGLE, TORQUE, sample_rate=None, t=series(1000 * RIG.time, "t [ms]"))
    assert_is_plain(ANGLE, TORQUE, sample_rate=None, t=series(1000 * RIG.time, "t [ms]"), time_unit="ms")


def test_names_of_columns_say_that_an_axis_slides() -> None:
    table = pd.DataFrame({"x [m]": ANGLE, "F [N]": TORQUE})
    found = tvident.identify(table["x [m]"], table[["F [N]"]], sample_rate=1000, **GIVEN)
    assert found.value("stiffness").unit == "N/m"


def test_coordinates_in_milliseconds_are_times() -> None:
    coordinates = {"time": ("time", 1000 * np.asarray(RIG.time), {"units": "ms"})}
    angle, torque = (xr.DataArray(values, coordinates, "time") for values in (ANGLE, TORQUE))
    assert_is_plain(angle, torque, sample_rate=None)


def test_a_rate_that_contradicts_the_labels_is_refused() -> None:
    """A hundredfold inertia would follow from a tenth of the rate."""
    angle = pd.Series(ANGLE, index=pd.date_range("2024-01-01", periods=N, freq="1ms"))
    assert_is_plain(angle, TORQUE)
    with pytest.raises(ValueError, match=r"got 0.01 s \(100 Hz\), and labels 0.001 s apart \(1000 Hz\); leave it out"):
        assert_is_plain(angle, TORQUE, sample_rate=100)
    with pytest.raises(ValueError, match=r"labels 0.001 s apart"):
        tvident.fit_local_polynomials(angle, 21, delta=1.0)
    coarse = pd.Series(ANGLE, index=angle.index.round("2ms"))
    assert_is_plain(coarse, TORQUE)


@pytest.mark.parametrize("day", ["2024-03-31", "2024-10-27"])
def test_clocks_on_the_wall_jump_by_an_hour(day: str) -> None:
    utc = pd.date_range(f"{day} 00:59:59.5", periods=N, freq="1ms", tz="UTC")
    walls = utc.tz_convert("Europe/Berlin").tz_localize(None)
    with pytest.raises(ValueError, match=r"a step of an hour is that of summer time: give times in UTC"):
        assert_is_plain(pd.Series(ANGLE, index=walls), TORQUE, sample_rate=None)


def test_velocity_and_acceleration_are_converted() -> None:
    angle, torque = np.asarray(ANGLE), np.asarray(TORQUE)
    velocity = np.gradient(angle, 1e-3)
    plain = tvident.identify(angle, torque, velocity=velocity, sample_rate=1000)
    for unit, factor in (("deg/s", 180 / np.pi), ("rpm", 30 / np.pi)):
        channel = tvident.Channel(factor * velocity, unit)
        found = tvident.identify(angle, torque, velocity=channel, sample_rate=1000)
        assert found.value("inertia").value == pytest.approx(plain.value("inertia").value, rel=1e-6)
        assert "seems to be in" not in found.summary()
    with pytest.raises(ValueError, match="the velocity must be in a unit that can be converted to rad/s; got 'V'"):
        tvident.identify(angle, torque, velocity=tvident.Channel(velocity, "V"), sample_rate=1000)


def test_a_derivative_has_another_unit() -> None:
    angle = xr.DataArray(ANGLE, dims="time", attrs={"units": "rad", "lab": "A"})
    assert tvident.savgol_filter(angle, 21, 3).attrs == {"units": "rad", "lab": "A"}
    assert tvident.savgol_filter(angle, 21, 3, deriv=1).attrs == {"lab": "A"}
    assert angle.attrs["units"] == "rad"


def test_records_of_a_list_have_the_unit_of_their_channels() -> None:
    """They were stacked as plain numbers: degrees were rad."""
    angle, torque = tvident.Channel(DEGREES, "deg"), tvident.Channel(MILLI, "N mm")
    for both in (([angle, angle], [torque, torque]), (np.stack([angle, angle]), np.stack([torque, torque]))):
        found = tvident.identify(*both, sample_rate=1000, **GIVEN)
        assert_allclose(found.stiffness[1], PLAIN.stiffness, rtol=1e-9)
    shared = tvident.identify(
        [angle, angle], [torque, torque], sample_rate=1000, share="inertia", method=tvident.WeakForm(33, 9)
    )
    assert shared.constants["inertia"][0] == pytest.approx(0.0123, rel=0.05)
    trials: list[dict[str, Any]] = [{}, {"ensemble_axis": 0}]
    for options in trials:
        with pytest.raises(ValueError, match=r"records of a list must have one unit; got 'deg', ''"):
            tvident.identify([angle, ANGLE], [torque, torque], sample_rate=1000, **options)


def test_joined_channels_keep_their_unit() -> None:
    angle, other = tvident.Channel(DEGREES, "deg"), tvident.Channel(ANGLE, "rad")
    for kept in (np.concatenate([angle[:5], angle[5:]]), np.stack([angle, angle])):
        assert isinstance(kept, tvident.Channel)
        assert kept.unit == "deg"
    for joined in (
        np.concatenate([angle, other]),
        np.concatenate([angle, DEGREES]),
        np.interp(RIG.time, RIG.time, angle),
    ):
        assert not isinstance(joined, tvident.Channel)


def test_streams_and_comparisons_hear_units_too() -> None:
    angle, torque = tvident.Channel(DEGREES, "deg"), tvident.Channel(MILLI, "N mm")
    kinds = dict.fromkeys(("inertia", "damping", "stiffness"), "windowed")
    settings: dict[str, Any] = {
        "method": tvident.StrongForm(51, regression_window=50),
        "sample_rate": 1000,
        "terms": [],
        **kinds,
    }
    stream, plain = (tvident.IdentificationStream(**settings) for _ in range(2))
    assert_allclose(stream.push(angle, torque).stiffness, plain.push(ANGLE, TORQUE).stiffness, rtol=1e-6)
    with pytest.raises(ValueError, match=r"name says 'deg'"):
        stream.push(pd.Series(DEGREES, name="angle [deg]"), torque)
    given = tvident.IdentificationStream(angle_unit="deg", torque_unit="N mm", **settings)
    given.push(pd.Series(DEGREES, name="angle [deg]"), MILLI)
    assert PLAIN.vaf(angle=angle, torque=torque) == pytest.approx(PLAIN.vaf(angle=ANGLE, torque=TORQUE), rel=1e-9)
    with pytest.raises(ValueError, match=r"name says 'deg'.*pass \.to_numpy\(\) in rad"):
        PLAIN.vaf(angle=pd.Series(DEGREES, name="angle [deg]"), torque=torque)


def test_derivatives_say_their_unit_where_time_has_one() -> None:
    angle = tvident.Channel(DEGREES, "deg")
    fit = tvident.fit_local_polynomials(angle, 51, sample_rate=1000)
    expected = {"value": "deg", "derivative_1": "deg/s", "derivative_2_stderr": "deg/s^2", "sigma": "deg"}
    assert expected.items() <= fit.to_pandas().attrs["units"].items()
    assert fit.to_xarray().derivative_1.attrs["units"] == "deg/s"
    assert not tvident.fit_local_polynomials(angle, 51).to_pandas().attrs["units"]
    late = tvident.fit_local_polynomials(angle, 51, t=tvident.Channel(1000 * np.asarray(RIG.time) + 500, "ms"))
    assert_allclose(late.time, np.asarray(RIG.time) + 0.5, rtol=1e-12)
    assert_allclose(late.derivatives, fit.derivatives, rtol=1e-6, atol=1e-6 * np.abs(fit.derivatives).max())


@pytest.mark.parametrize(
    "columns",
    [
        (("elbow", "angle [deg]"), ("elbow", "torque [N mm]")),
        (("angle", "deg"), ("torque", "Nmm")),
        (("elbow", "angle", "deg"), ("elbow", "torque", "N mm")),
    ],
)
def test_a_unit_in_any_level_of_a_name_is_asked_about(columns: tuple[tuple[str, ...], ...]) -> None:
    """Columns of two levels were in rad and N m without a word: .215 kg m² for .0123."""
    rig = tvident.simulate_torsional_rig(2.0)
    table = pd.DataFrame({columns[0]: np.degrees(rig.angle), columns[1]: 1000 * rig.torque})
    with pytest.raises(ValueError, match="the angle must say its unit where its name says 'deg'"):
        tvident.identify(table[columns[0]], table[columns[1]], sample_rate=1000)
    found = tvident.identify(
        table[columns[0]], table[columns[1]], sample_rate=1000, angle_unit="deg", torque_unit="N mm"
    )
    assert found.value("inertia").value == pytest.approx(0.0123, rel=0.02)


def test_periods_of_pandas_tell_times() -> None:
    """The sample period was asked for."""
    rig = tvident.simulate_torsional_rig(2.0)
    index = pd.period_range("2024-01-01", periods=rig.angle.size, freq="ms")
    found = tvident.identify(pd.Series(rig.angle, index=index), pd.Series(rig.torque, index=index))
    assert found.settings["sample_rate"] == pytest.approx(1000)
    assert found.to_pandas().index.equals(index)
