"""Results in the containers that samples came in: with their index, coordinates and attributes."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import tvident
from rig_in_containers import ANGLE, DATES, GIVEN, PLAIN, TORQUE, N

pd = pytest.importorskip("pandas")
pl = pytest.importorskip("polars")
xr = pytest.importorskip("xarray")

UTC = DATES.tz_convert(None).to_numpy()


def test_an_index_of_dates_is_the_time_and_comes_back() -> None:
    angle = pd.Series(ANGLE, index=DATES, name="elbow")
    angle.attrs = {"subject": 7}
    result = tvident.identify(angle, TORQUE, step=2, **GIVEN)
    assert_array_equal(result.stiffness, PLAIN.stiffness[::2])
    assert_array_equal(result.time, PLAIN.time[::2])
    table = result.to_pandas()
    assert table.index.equals(DATES[::2])
    assert table.attrs["subject"] == 7
    assert table.attrs["units"]["stiffness_stderr"] == "N m/rad"
    assert json.loads(table.attrs["settings"]) == result.settings
    assert result.to_polars()["when"][0] == DATES[0].tz_convert(None)
    with pytest.raises(TypeError, match="identify needs the sample period"):
        tvident.identify(pd.Series(ANGLE), TORQUE)


def test_a_part_is_found_by_dates() -> None:
    result = tvident.identify(pd.Series(ANGLE, index=DATES), TORQUE, **GIVEN)
    expected = result.between(0.2, 0.6)
    # Summer time began in between: 01:59:59.7 + 0.4 s.
    for first, last in (
        ("2024-03-31 01:59:59.7", "2024-03-31 03:00:00.1"),
        (DATES[200], DATES[600].tz_convert("UTC")),
        (DATES[200].to_pydatetime(), 0.6),
    ):
        assert_array_equal(result.between(first, last).time, expected.time)
    with pytest.raises(ValueError, match=r"begin must be a date as the samples have, or seconds; got 'monday'"):
        result.between("monday")
    with pytest.raises(TypeError, match=r"begin must be a number; got '2024-03-31'"):
        PLAIN.between("2024-03-31")
    trial = tvident.identify(
        xr.DataArray(ANGLE, {"time": UTC}, ("time",), attrs={"units": "rad", "lab": "A"}), TORQUE, **GIVEN
    )
    assert_array_equal(trial.between(UTC[200], UTC[600]).time, expected.time)
    assert "units" not in trial.to_xarray().attrs


def test_coordinates_and_attributes_of_xarray_come_back() -> None:
    angle = xr.DataArray(
        ANGLE, {"time": ("time", PLAIN.time, {"units": "s"}), "joint": "elbow"}, "time", attrs={"lab": "A"}
    )
    made = tvident.identify(angle, TORQUE, **GIVEN).to_xarray()
    assert made.sizes == {"time": N}
    assert made.coords["joint"] == "elbow"
    assert made.attrs["lab"] == "A"
    assert made.stiffness.attrs["units"] == "N m/rad"
    assert_array_equal(made.stiffness, PLAIN.stiffness)
    assert_array_equal(PLAIN.to_xarray().time, PLAIN.time)


def test_a_filter_gives_the_container_that_it_got() -> None:
    expected, axis = tvident.savgol_filter(ANGLE, 31, 3, deriv=1), {"time": UTC}
    series = pd.Series(ANGLE, DATES, name="elbow")
    series.attrs = {"subject": 7}
    found = tvident.savgol_filter(series, 31, 3, deriv=1)
    pd.testing.assert_series_equal(found, pd.Series(expected, DATES, name="elbow"))
    assert found.attrs == {"subject": 7}
    for table in (pd.DataFrame({"a": ANGLE, "b": -ANGLE}, DATES), pl.DataFrame({"a": ANGLE, "b": -ANGLE})):
        found = tvident.savgol_filter(table, 31, 3, deriv=1)
        assert type(found) is type(table)
        assert_array_equal(found["a"], expected)
        assert_array_equal(found["b"], -expected)
        with pytest.raises(ValueError, match="time must be the rows of a table; got axis=1 for x"):
            tvident.savgol_filter(table, 31, 3, axis=1)
    trials = xr.DataArray(
        np.stack([ANGLE, -ANGLE], -1), {**axis, "trial": [1, 2]}, ("time", "trial"), attrs={"lab": "A"}
    )
    found = tvident.savgol_filter(trials, 31, 3, deriv=1)
    xr.testing.assert_identical(found, trials.copy(data=np.stack([expected, -expected], -1)))
    fields = np.array(list(zip(ANGLE, -ANGLE, strict=True)), dtype=[("a", float), ("b", float)])
    assert_array_equal(tvident.savgol_filter(fields, 31, 3, deriv=1)["b"], -expected)


def test_derivatives_know_index_and_coordinates() -> None:
    expected = tvident.fit_local_polynomials(ANGLE, 31, sample_rate=1000)
    fit = tvident.fit_local_polynomials(pd.Series(ANGLE, DATES), 31)
    assert_array_equal(fit.derivatives, expected.derivatives)
    assert fit.to_pandas().index.equals(DATES)
    assert_array_equal(fit.to_pandas()["derivative_2"], expected.derivatives[2])
    trials = xr.DataArray(np.stack([ANGLE, -ANGLE], -1), {"time": UTC}, ("time", "trial"))
    made = tvident.fit_local_polynomials(trials, 31, step=2).to_xarray()
    assert made.derivative_1.dims == ("trial", "time")
    assert_array_equal(made.derivative_1[0], expected.derivatives[1, ::2])
    assert_array_equal(made.time, UTC[::2])
