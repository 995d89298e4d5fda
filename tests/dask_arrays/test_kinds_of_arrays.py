"""Dask arrays of every kind that an array in memory may be."""

from __future__ import annotations

from typing import Any

import dask.array as da
import dask.dataframe as dd
import numpy as np
import pandas as pd
import pytest
import xarray as xr

import tvident
import tvident.dask

Y = np.sin(np.arange(3000) / 50) + 1e-3 * np.random.default_rng(0).standard_normal(3000)
HIDDEN = np.arange(3000) % 997 == 77


def same_derivatives(chunked: Any, values: Any) -> None:
    found = tvident.dask.fit_local_polynomials(chunked, 101, sample_rate=1000)
    whole = tvident.fit_local_polynomials(values, 101, sample_rate=1000)
    assert np.array_equal(found.derivatives.compute(), whole.derivatives, equal_nan=True)
    assert np.array_equal(found.status.compute(), whole.status)


def test_masked_samples_are_missing_whatever_lies_below_the_mask() -> None:
    values = np.ma.array(np.where(HIDDEN, 999.0, Y), mask=HIDDEN)
    same_derivatives(da.from_array(values, chunks=700), values)
    counts = np.ma.array(np.where(HIDDEN, 999, np.round(1000 * Y)).astype(np.int16), mask=HIDDEN)
    same_derivatives(da.from_array(counts, chunks=700), counts)


def test_masked_samples_of_an_identification_are_missing_and_masked_weights_zero() -> None:
    rig = tvident.simulate_torsional_rig(duration=6.0)
    hidden = np.arange(6000) % 997 == 77
    torque = np.ma.array(np.where(hidden, 999.0, rig.torque), mask=hidden)
    weights = np.ma.array(np.where(hidden, 7.0, 1.0), mask=hidden)
    angle = da.from_array(rig.angle, chunks=2000)
    found = tvident.dask.identify(angle, da.from_array(torque, chunks=2000), sample_rate=1000, method="paper")
    whole = tvident.identify(rig.angle, torque, sample_rate=1000, method="paper")
    assert np.array_equal(found.stiffness.compute(), whole.stiffness, equal_nan=True)
    weighted = tvident.dask.identify(
        angle,
        da.from_array(rig.torque, chunks=2000),
        weights=da.from_array(weights, chunks=2000),
        sample_rate=1000,
        method="paper",
    )
    plain = tvident.dask.identify(
        angle,
        da.from_array(rig.torque, chunks=2000),
        weights=da.from_array(np.where(hidden, 0.0, 1.0), chunks=2000),
        sample_rate=1000,
        method="paper",
    )
    assert np.array_equal(weighted.stiffness.compute(), plain.stiffness.compute(), equal_nan=True)


@pytest.mark.parametrize("kind", [">f8", ">i4", "f2", "bool"])
def test_numbers_of_any_type_are_read(kind: str) -> None:
    values = np.round(100 * Y).astype(kind)
    same_derivatives(da.from_array(values, chunks=700), values)


@pytest.mark.parametrize(
    ("values", "window", "words"),
    [
        (da.from_array(Y, chunks=700)[da.from_array(Y, chunks=700) > 0], 101, r"call y\.compute_chunk_sizes\(\)"),
        (dd.from_pandas(pd.Series(Y), npartitions=3), 101, r"pass y\.to_dask_array\(lengths=True\)"),
        (xr.DataArray(Y, dims="time").chunk(700), 101, r"pass y\.data"),
        (Y, 101, "the function of tvident for arrays in memory"),
        (da.from_array(Y, chunks=700), "auto", r"fit_local_polynomials\(part, 'auto'\)\.window_length"),
    ],
)
def test_what_is_no_dask_array_hears_how_it_becomes_one(values: Any, window: Any, words: str) -> None:
    with pytest.raises((TypeError, ValueError), match=words):
        tvident.dask.fit_local_polynomials(values, window)
