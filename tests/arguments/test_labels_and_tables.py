"""Labels of samples that are times, and tables given where one column is meant."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pytest
import xarray as xr

import tvident

RIG = tvident.simulate_torsional_rig(duration=2.0)
SECONDS = RIG.time
TABLE = pd.DataFrame({"t": SECONDS, "angle": RIG.angle, "torque": RIG.torque})
CALL: Any = tvident.identify
PLAIN = CALL(RIG.angle, RIG.torque, sample_rate=1000).constants["inertia"][0]


def series(labels: Any, name: str | None) -> tuple[Any, Any]:
    """Give angle and torque as series with labels of this name."""
    index = pd.Index(labels, name=name)
    return pd.Series(RIG.angle, index=index), pd.Series(RIG.torque, index=index)


@pytest.mark.parametrize("name", ["t", "time", "Time [s]", "time_s", "Zeit", "time (sec)"])
@pytest.mark.parametrize("kind", ["series", "column", "xarray"])
def test_labels_that_are_called_as_times_are_seconds(name: str, kind: str) -> None:
    """An index of seconds was no sample period, whatever it was called."""
    angle, torque = series(SECONDS, name)
    if kind == "column":
        angle, torque = angle.to_frame("angle"), torque.to_frame("torque")
    if kind == "xarray":
        angle, torque = (xr.DataArray(one, dims=[name], coords={name: SECONDS}) for one in (RIG.angle, RIG.torque))
    np.testing.assert_allclose(CALL(angle, torque).constants["inertia"][0], PLAIN, rtol=1e-9)
    fit = tvident.fit_local_polynomials(angle.to_numpy().ravel() if kind == "column" else angle, 21, max_deriv=1)
    if kind != "column":
        expected = tvident.fit_local_polynomials(RIG.angle, 21, max_deriv=1, sample_rate=1000)
        np.testing.assert_allclose(fit.derivatives[1], expected.derivatives[1], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(("labels", "name"), [(SECONDS, None), (SECONDS, "x")])
def test_labels_without_a_name_are_asked_for(labels: Any, name: str | None) -> None:
    angle, torque = series(labels, name)
    with pytest.raises(
        TypeError, match=r"labelled in steps of 0.001: give t=angle.index if they are seconds \(1000 Hz\)"
    ):
        CALL(angle, torque)
    result = CALL(angle, torque, t=angle.index)
    np.testing.assert_allclose(result.constants["inertia"][0], PLAIN, rtol=1e-9)
    array = xr.DataArray(RIG.angle, dims=["x"], coords={"x": SECONDS})
    with pytest.raises(TypeError, match=r"give t=angle\['x'\] if they are seconds"):
        CALL(array, RIG.torque)


@pytest.mark.parametrize(("labels", "name"), [(np.arange(SECONDS.size), "t"), (np.arange(SECONDS.size), None)])
def test_labels_that_count_samples_are_no_times(labels: Any, name: str | None) -> None:
    with pytest.raises(TypeError, match=r"give sample_rate=, delta= or t=$"):
        CALL(*series(labels, name))


@pytest.mark.parametrize(
    ("name", "labels"),
    [
        ("time [ms]", SECONDS * 1e3),
        ("time_ms", np.arange(SECONDS.size)),
        ("timestamp_us", 7 + 1000 * np.arange(SECONDS.size)),
    ],
)
def test_whole_milliseconds_are_what_their_name_says(name: str, labels: Any) -> None:
    """They were asked for: seconds that keep the name of what they were made from are no whole numbers."""
    angle, torque = series(labels, name)
    np.testing.assert_allclose(CALL(angle, torque).constants["inertia"][0], PLAIN, rtol=1e-9)
    times = pd.Series(labels, name=name)
    found = CALL(RIG.angle, RIG.torque, t=times)
    np.testing.assert_allclose(found.constants["inertia"][0], PLAIN, rtol=1e-9)
    np.testing.assert_allclose(found.time, SECONDS + found.time[0], atol=1e-9)
    with pytest.raises(ValueError, match="where its name says"):
        CALL(RIG.angle, RIG.torque, t=times / 1e3 if "ms" in name else times / 1e6)


@pytest.mark.parametrize("unit", ["s", "ms", "us"])
def test_a_unit_that_is_given_counts_more_than_one_in_a_name(unit: str) -> None:
    """Whole seconds called `time_ms` were milliseconds where `time_unit="s"` was given: an inertia of a millionth, without a word."""
    times = pd.Series(np.arange(SECONDS.size), name="time_ms")
    found = CALL(RIG.angle, RIG.torque, t=times, time_unit=unit)
    assert found.settings["sample_rate"] == pytest.approx({"s": 1.0, "ms": 1e3, "us": 1e6}[unit])


def test_labels_in_milliseconds_are_asked_for() -> None:
    angle, torque = series(SECONDS * 1e3 / 2, "time [ms]")
    with pytest.raises(ValueError, match=r"where its name says 'ms'.*time_unit='ms'"):
        CALL(angle, torque)
    np.testing.assert_allclose(CALL(angle, torque, time_unit="ms").constants["inertia"][0], PLAIN / 4, rtol=1e-9)
    # A rate says what unnamed labels are in.
    halves = series(SECONDS * 500, "t")
    assert CALL(*halves, sample_rate=2000).settings["sample_rate"] == 2000


@pytest.mark.parametrize("package", [pd.DataFrame, pl.DataFrame])
def test_a_whole_table_is_no_channel(package: Any) -> None:
    """Of one table for both channels every column was a record, whose angle and torque were the same."""
    table = package({name: TABLE[name].to_numpy() for name in TABLE})
    with pytest.raises(
        TypeError, match=r"angle and torque are one table of t, angle, torque.*angle as table\['angle'\]"
    ):
        CALL(table, table, sample_rate=1000)
    both = package({name: TABLE[name].to_numpy() for name in ("angle", "torque")})
    with pytest.raises(TypeError, match="angle and torque are one table"):
        CALL(both, both, sample_rate=1000)
    timed = [package({"t": SECONDS, name: TABLE[name].to_numpy()}) for name in ("angle", "torque")]
    with pytest.raises(TypeError, match=r"'t' is called as times are; pass .* angle as table\['angle'\]"):
        CALL(*timed, sample_rate=1000)
    alone = [package({name: TABLE[name].to_numpy()}) for name in ("angle", "torque")]
    np.testing.assert_allclose(CALL(*alone, sample_rate=1000).constants["inertia"][0], PLAIN, rtol=1e-12)


@pytest.mark.parametrize("names", [("T1", "T2"), ("t1", "t2"), ("T 1", "T 2"), ("T_1", "T_2", "T_3")])
def test_numbered_torques_are_no_times(names: tuple[str, ...]) -> None:
    """They are called by the letter of times, and all were said to be some."""
    angles = pd.DataFrame({f"q{name[-1]}": TABLE["angle"].to_numpy() for name in names})
    torques = pd.DataFrame({name: TABLE["torque"].to_numpy() for name in names})
    found = CALL(angles, torques, sample_rate=1000).constants["inertia"][0]
    np.testing.assert_allclose(found, np.full(found.shape, PLAIN), rtol=1e-9)
    with pytest.raises(TypeError, match=r"'time' is called as times are; pass .* torque as table\['T1'\]"):
        CALL(
            angles,
            torques.set_axis(["time", *(f"T{place}" for place in range(1, len(names)))], axis=1),
            sample_rate=1000,
        )


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((), "needs angle and torque; got none"),
        ((RIG.angle,), "needs angle and torque; got one channel"),
        ((TABLE,), r"got what holds t, angle, torque; write identify\(data\['angle'\], data\['torque'\]"),
        (({"angle": RIG.angle, "torque": RIG.torque},), "got what holds angle, torque"),
        ((tvident.FileRecording({"angle [rad]": RIG.angle}),), "got what holds angle"),
    ],
)
def test_one_thing_for_two_channels_is_told(given: tuple[Any, ...], words: str) -> None:
    """Python's own words named an argument that was missing."""
    with pytest.raises(TypeError, match=words):
        CALL(*given, sample_rate=1000)
