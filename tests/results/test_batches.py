"""Records of a batch by NumPy's indexing: always of the batch, never of the samples."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import tvident

RIGS = [tvident.simulate_torsional_rig(duration=2.0, seed=seed) for seed in range(6)]
ANGLE = np.stack([rig.angle for rig in RIGS]).reshape(2, 3, -1)
TORQUE = np.stack([rig.torque for rig in RIGS]).reshape(2, 3, -1)
COORDINATES = {"rig": ["a", "b"], "trial": [10, 20, 30], "time": np.arange(2000) / 1000}


@pytest.fixture(scope="module")
def result() -> tvident.Identification:
    angle, torque = (xr.DataArray(one, COORDINATES, ("rig", "trial", "time")) for one in (ANGLE, TORQUE))
    return tvident.identify(angle, torque, sample_rate=1000, step=100)


@pytest.mark.parametrize(
    "place",
    [
        (..., 1),
        (..., slice(0, 2)),
        (0, ...),
        (1, ..., 2),
        ...,
        (None, 0),
        [1],
        (slice(None), [0, 2]),
        np.array([[True, False, True], [False, True, False]]),
    ],
)
def test_an_index_is_one_of_the_batch(result: tvident.Identification, place: Any) -> None:
    """With an ellipsis it was one of the samples, where arrays have them."""
    part, numbers = result[place], np.arange(6).reshape(2, 3)[place]
    records = numbers.reshape(-1)
    assert part.stiffness.shape == (*numbers.shape, 20)
    assert part.status.shape == part.stiffness.shape
    for values, of_all in ((part.stiffness, result.stiffness), (part.stderr["stiffness"], result.stderr["stiffness"])):
        assert np.array_equal(values.reshape(-1, 20), of_all.reshape(6, 20)[records])
    constant, _ = part.constants["inertia"]
    assert np.array_equal(np.ravel(constant), result.constants["inertia"][0].reshape(6)[records])
    assert part.to_xarray().stiffness.shape == part.stiffness.shape


def test_names_of_records_stay(result: tvident.Identification) -> None:
    some = result[:, [0, 2]].to_xarray()
    assert some.stiffness.dims == ("rig", "trial", "time")
    assert some.trial.to_numpy().tolist() == [10, 30]
    one = result[1, 2].to_xarray()
    assert (one.stiffness.dims, str(one.rig.to_numpy()), int(one.trial)) == (("time",), "b", 30)
    for new_axis in (True, None):
        assert result[new_axis].to_xarray().stiffness.dims == ("record_0", "record_1", "record_2", "time")
    pairs = result[[0, 1], [2, 0]].to_xarray()
    assert pairs.stiffness.dims == ("record", "time")
    frames = [pd.DataFrame(dict(zip("abc", one[0], strict=True))) for one in (ANGLE, TORQUE)]
    of_columns = tvident.identify(*frames, sample_rate=1000, step=100)
    assert of_columns[[0, 2]].to_pandas().index.get_level_values("record").unique().tolist() == ["a", "c"]


@pytest.mark.parametrize("place", [(0, 0, 0), 5, "a", 1.5, np.ones((2, 3, 20), bool)])
def test_an_index_that_names_no_record_hears_what_there_is(result: tvident.Identification, place: Any) -> None:
    with pytest.raises(IndexError, match=r"an index must name records of a batch of shape \(2, 3\); got .*between"):
        result[place]


def test_notebooks_call_records_as_they_are_indexed(result: tvident.Identification) -> None:
    """They said result[3], of a batch of two by three."""
    page = result._repr_html_()
    assert "<caption>record 0, 1</caption>" in page
    assert "and 3 more records: result[1, 0]" in page
