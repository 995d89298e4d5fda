"""Arrays as pandas, polars, xarray, MATLAB and dask have them: understood, or refused with what to type instead."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import tvident
from rig_in_containers import ANGLE, DATES, PLAIN, TORQUE, N, identified

pd = pytest.importorskip("pandas")
pl = pytest.importorskip("polars")
xr = pytest.importorskip("xarray")


def matlab(values: Any) -> Any:
    """Give an array as a field of a MATLAB structure has it: a column, in an array of one object."""
    field = np.empty((1, 1), object)
    field[0, 0] = values[:, np.newaxis]
    return field


@pytest.mark.parametrize(
    "pair",
    [
        (ANGLE[:, None], TORQUE[:, None]),
        (ANGLE[:, None], TORQUE),
        (ANGLE[None], TORQUE[:, None]),
        (matlab(ANGLE), matlab(TORQUE)),
        (pd.DataFrame({"a": ANGLE}), pd.Series(TORQUE)),
        (pd.Series(ANGLE, dtype="Float64"), pd.Series(TORQUE, dtype="Float64")),
        (pl.Series(ANGLE), pl.DataFrame({"t": TORQUE})),
        (xr.DataArray(ANGLE, dims="time"), xr.DataArray(TORQUE, dims="time")),
    ],
    ids=["columns", "column", "row and column", "MATLAB", "table", "nullable", "polars", "xarray"],
)
def test_one_record_in_any_shape(pair: tuple[Any, Any]) -> None:
    assert_array_equal(identified(*pair).stiffness, PLAIN.stiffness)


def test_missing_values_of_tables_are_missing() -> None:
    missing = ANGLE.copy()
    missing[300:310] = np.nan
    expected = identified(missing, TORQUE)
    none = [None if np.isnan(one) else one for one in missing]
    for angle in (pd.Series(none, dtype="Float64"), pl.Series(none)):
        found = identified(angle, TORQUE)
        assert_array_equal(found.status, expected.status)
        assert_array_equal(found.stiffness, expected.stiffness)


def test_several_records_have_time_where_the_container_says() -> None:
    angles, torques = np.stack([ANGLE, 2 * ANGLE]), np.stack([TORQUE, 2 * TORQUE])
    expected = identified(angles, torques)
    tables = [kind({"one": ANGLE, "two": 2 * ANGLE}) for kind in (pd.DataFrame, pl.DataFrame)]
    first = xr.DataArray(angles.T, dims=("time", "trial"), coords={"trial": ["one", "two"]})
    last = xr.DataArray(torques, dims=("trial", "time"), coords={"trial": ["one", "two"]})
    for angle, torque in ((tables[0], pd.DataFrame(torques.T)), (tables[1], torques), (first, last)):
        result = identified(angle, torque)
        assert_array_equal(result.stiffness, expected.stiffness)
        assert list(result.to_xarray().stiffness.sel({result.to_xarray().stiffness.dims[0]: "two"})[:2]) == list(
            expected.stiffness[1, :2]
        )
        assert result.to_pandas().xs("two")["stiffness"].tolist() == expected.stiffness[1].tolist()
        assert result.to_polars()["stiffness"].to_list() == expected.stiffness.ravel().tolist()


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        ((np.stack([ANGLE] * 3, -1), np.stack([TORQUE] * 3, -1)), r"time must be the last axis; .* pass angle\.T and"),
        ((np.zeros(80), np.zeros(400)), r"got \(80,\) and \(400,\); .* give both: sample_rate=\(200, 1000\), say"),
        ((np.zeros((5, 80)), np.zeros((80, 5))), "angle and torque must have the same shape; .*; transpose one of"),
        ((pd.Series(ANGLE, index=DATES), pd.Series(TORQUE, index=DATES[::-1])), r"same samples; .*\.reindex\(angle"),
        ((pd.Series(ANGLE)[: N // 2], pd.Series(TORQUE)[N // 2 :]), r"same samples; .* sample 0 are 0 and 500; pass"),
        (
            (
                xr.DataArray(ANGLE, {"time": np.arange(N)}, "time"),
                xr.DataArray(TORQUE, {"time": np.arange(N) + 1.0}, "time"),
            ),
            "same samples; along 'time' .* xarray.align",
        ),
    ],
    ids=["time first", "two rates", "transposed", "dates", "cut elsewhere", "coordinates"],
)
def test_what_does_not_belong_together_is_refused(pair: tuple[Any, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        identified(*pair)


@pytest.mark.parametrize("place", ["angle", "torque", "mask", "instrument", "stiffness", "t"])
def test_dask_is_never_computed_silently(place: str) -> None:
    da = pytest.importorskip("dask.array")
    computed = []

    def watched(block: Any) -> Any:
        computed.append(1)
        return block

    lazy = da.from_array(ANGLE).map_blocks(watched, dtype=float, meta=np.empty(0))
    computed.clear()  # of what is asked for its type
    for values in (lazy, xr.DataArray(lazy, dims="time"), [lazy, lazy]):
        channels: dict[str, Any] = {"angle": ANGLE, "torque": TORQUE, place: values}
        if place != "t":
            channels["sample_rate"] = 1000
        with pytest.raises(
            TypeError, match=rf"^{place} must be in memory; got a dask array.*; pass {place}\.(compute|load)"
        ):
            tvident.identify(**channels)
    assert not computed


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (xr.Dataset({"angle": ("time", ANGLE)}), r"one channel; got a Dataset of angle; .*angle\['angle'\]"),
        (pl.LazyFrame({"a": ANGLE}), r"in memory; got a polars LazyFrame.*; pass angle\.collect\(\)"),
        ({"position": ANGLE}, r"got records with fields position; take one field by its name: angle\['position'\]"),
        (pd.Series(["a"] * N), "must hold numbers"),
        (pd.Series(DATES), "must hold numbers; got dates"),
    ],
    ids=["Dataset", "lazy", "dictionary", "text", "dates"],
)
def test_what_is_no_channel_is_refused(values: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        identified(values, TORQUE)


def test_records_below_each_other_are_no_record() -> None:
    """Trials that an index of two levels tells apart were one record, with a jump from one to the next."""
    rig = tvident.simulate_torsional_rig(duration=2.0)
    levels = {"trial": range(2), "time": np.arange(1000) / 1000}
    index = pd.MultiIndex.from_product(list(levels.values()), names=list(levels))
    angle, torque = (pd.Series(one, index=index) for one in (rig.angle, rig.torque))
    with pytest.raises(
        ValueError,
        match=r"begins again at sample 1000; if these are records one below the other, pass angle.unstack\(0\), or one of",
    ):
        tvident.identify(angle, torque, sample_rate=1000)
    swapped = angle.swaplevel().sort_index()
    with pytest.raises(ValueError, match=r"pass y.unstack\(1\)"):
        tvident.fit_local_polynomials(swapped, 101, sample_rate=1000)
    result = tvident.identify(angle.unstack(0), torque.unstack(0), sample_rate=1000, stiffness="constant")
    assert result.inertia.shape == (2, 1000)
    one = tvident.identify(angle.loc[[0]], torque.loc[[0]], sample_rate=1000, stiffness="constant")
    np.testing.assert_array_equal(one.inertia, result.inertia[0])


def test_an_index_of_two_levels_may_belong_to_one_record() -> None:
    """The cure made ten records of one whose samples were called by second and millisecond."""
    levels = pd.MultiIndex.from_arrays([np.arange(N) // 100, np.arange(N) % 100], names=["second", "millisecond"])
    angle, torque = pd.Series(ANGLE, levels), pd.Series(TORQUE, levels)
    with pytest.raises(ValueError, match="begins again at sample 100;") as said:
        identified(angle, torque)
    assert "angle.xs(0, level=0)" in str(said.value)
    assert str(said.value).endswith(
        "if all is one record, as where levels are seconds and milliseconds, pass angle.to_numpy()"
    )
    assert_array_equal(identified(angle.to_numpy(), torque.to_numpy()).stiffness, PLAIN.stiffness)


@pytest.mark.parametrize("name", ["time", "t", "Zeit"])
def test_a_rate_that_labels_called_as_times_show_in_no_unit_is_refused(name: str) -> None:
    """Nobody says that such labels are seconds, but a rate of 1000 Hz beside steps of 1/512 made the inertia four times too small."""
    rig = tvident.simulate_torsional_rig(duration=2, sample_rate=512)
    seconds = np.arange(rig.angle.size) / 512
    for labels in (seconds, 1000 * seconds):
        index = pd.Index(labels, name=name)
        angle, torque = pd.Series(rig.angle, index), pd.Series(rig.torque, index)
        with pytest.raises(
            ValueError, match=r"labels of the samples, which are called as times are; got 0.001 s \(1000"
        ):
            tvident.identify(angle, torque, sample_rate=1000)
        found = tvident.identify(angle, torque, sample_rate=512)
        assert found.settings["sample_rate"] == 512
    coordinates = {name: seconds}
    arrays = [xr.DataArray(one, dims=name, coords=coordinates) for one in (rig.angle, rig.torque)]
    with pytest.raises(ValueError, match="called as times are"):
        tvident.identify(*arrays, sample_rate=1000)
    counted = pd.RangeIndex(rig.angle.size, name=name)
    tvident.identify(pd.Series(rig.angle, counted), pd.Series(rig.torque, counted), sample_rate=512)
    turns = pd.Index(seconds, name="position")
    tvident.fit_local_polynomials(pd.Series(rig.angle, turns), 51, delta=1)


@pytest.mark.parametrize(("name", "scale"), [("time [s]", 1.0), ("t/ms", 1e3), ("Zeit [us]", 1e6)])
def test_a_rate_that_labels_show_in_another_unit_than_theirs_is_refused(name: str, scale: float) -> None:
    """Labels in s, as their name said, let a rate pass that was a thousand times too large."""
    rig = tvident.simulate_torsional_rig(duration=2, sample_rate=512)
    index = pd.Index(scale * np.arange(rig.angle.size) / 512, name=name)
    angle, torque = pd.Series(rig.angle, index), pd.Series(rig.torque, index)
    assert tvident.identify(angle, torque, sample_rate=512).settings["sample_rate"] == 512
    for rate in (1000, 512e3, 0.512):
        with pytest.raises(
            ValueError, match=r"and labels 0\.00195312 s apart \(512 Hz\); give the labels as t=, or pass"
        ):
            tvident.identify(angle, torque, sample_rate=rate)
    counted = pd.RangeIndex(rig.angle.size, name=name)
    tvident.identify(pd.Series(rig.angle, counted), pd.Series(rig.torque, counted), sample_rate=512)
    # A torque or an angle is no time, whatever it is called.
    for other in ("T [N m]", "t [deg]"):
        tvident.fit_local_polynomials(pd.Series(rig.angle, index.rename(other)), 51, sample_rate=1000)
