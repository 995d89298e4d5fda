"""Masked samples are missing samples in every function that takes arrays, whatever lies below the mask."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from calls import paper, weak

N = 1200
TIME = np.arange(N) / 1000
ANGLE = 0.2 * np.sin(2 * np.pi * 2 * TIME) + 0.1 * np.sin(2 * np.pi * 7 * TIME)
TORQUE = 15 * ANGLE + 0.01 * np.gradient(np.gradient(ANGLE, TIME), TIME)
HIDDEN = (np.arange(N) >= 500) & (np.arange(N) < 600)


def masked(values: npt.ArrayLike) -> Any:
    """Give values with a hundred spoilt ones below the mask."""
    return np.ma.masked_array(np.where(HIDDEN, 99, values), mask=HIDDEN)


def missing(values: npt.ArrayLike) -> Any:
    return np.where(HIDDEN, np.nan, values)


def assert_same(one: object, other: object) -> None:
    np.testing.assert_array_equal(np.asarray(one), np.asarray(other))


@pytest.mark.parametrize("window_length", [51, "auto"])
@pytest.mark.parametrize("kind", ["f8", "f4", ">f8", "i4", "i8", "u1", "g"])
def test_derivatives(kind: str, window_length: int | str) -> None:
    counts = np.round(100 * ANGLE + 50)
    with_mask = np.ma.masked_array(np.where(HIDDEN, 99, counts).astype(kind), mask=HIDDEN)
    one = tvident.fit_local_polynomials(with_mask, window_length)
    other = tvident.fit_local_polynomials(missing(counts), window_length)
    assert_same(one.status, other.status)
    assert_same(one.derivatives, other.derivatives)


@pytest.mark.parametrize("mode", ["interp", "wrap"])
def test_the_filter(mode: Any) -> None:
    found = tvident.savgol_filter(masked(ANGLE), 21, 3, mode=mode)
    assert_same(found, tvident.savgol_filter(missing(ANGLE), 21, 3, mode=mode))
    assert not np.ma.isMaskedArray(found)
    single: Any = np.ma.masked_array(ANGLE.astype(np.float32), mask=HIDDEN)
    assert tvident.savgol_filter(single, 21, 3).dtype == np.float32


def test_rolling_least_squares() -> None:
    columns = np.stack([ANGLE, TIME], axis=1)
    columns_masked = np.ma.masked_array(columns, mask=np.stack([HIDDEN, np.zeros(N, np.bool_)], axis=1))
    for one, other in (
        (
            tvident.rolling_least_squares(columns_masked, TORQUE, 50),
            (np.where(columns_masked.mask, np.nan, columns), TORQUE),
        ),
        (tvident.rolling_least_squares(columns, masked(TORQUE), 50), (columns, missing(TORQUE))),
    ):
        expected = tvident.rolling_least_squares(other[0], other[1], 50)
        assert_same(one.params, expected.params)
        assert_same(one.status, expected.status)


@pytest.mark.parametrize("call", [weak(), paper(window_length=51)], ids=["weak", "paper"])
def test_identification(call: dict[str, Any]) -> None:
    one = tvident.identify(masked(ANGLE), masked(TORQUE), sample_rate=1000, **call)
    other = tvident.identify(missing(ANGLE), missing(TORQUE), sample_rate=1000, **call)
    assert_same(one.stiffness, other.stiffness)
    assert_same(one.status, other.status)


def test_what_a_mask_masks_is_no_centre() -> None:
    mask: Any = np.ma.masked_array(np.ones(N, np.bool_), mask=HIDDEN)
    one = tvident.identify(ANGLE, TORQUE, sample_rate=1000, mask=mask)
    other = tvident.identify(ANGLE, TORQUE, sample_rate=1000, mask=~HIDDEN)
    assert_same(one.stiffness, other.stiffness)
    assert_same(one.status, other.status)


def test_a_known_parameter_must_not_be_masked() -> None:
    with pytest.raises(ValueError, match="a known damping must be finite at every sample; got 100 values that are not"):
        tvident.identify(ANGLE, TORQUE, sample_rate=1000, damping=masked(np.zeros(N)))
    known: Any = np.ma.masked_array(5.0, mask=True)
    with pytest.raises(ValueError, match="damping must be finite; got nan"):
        tvident.identify(ANGLE, TORQUE, sample_rate=1000, damping=known)


def test_masked_times_are_no_times() -> None:
    with pytest.raises(ValueError, match=r"t must hold finite times; t\[500\] is nan"):
        tvident.fit_local_polynomials(ANGLE, 51, t=masked(TIME))


def test_what_a_term_masks_is_missing() -> None:
    with_mask = tvident.Term("own", lambda _t, angle, _velocity: np.ma.masked_array(angle**3, mask=HIDDEN))
    without = tvident.Term("own", lambda _t, angle, _velocity: missing(angle**3))
    one, other = (tvident.identify(ANGLE, TORQUE, sample_rate=1000, terms=[term]) for term in (with_mask, without))
    assert_same(one.terms["own"], other.terms["own"])
    assert_same(one.stiffness, other.stiffness)


def test_samples_in_lists_keep_their_mask() -> None:
    samples = [np.ma.masked if hidden else value for hidden, value in zip(HIDDEN, ANGLE, strict=True)]
    found = tvident.fit_local_polynomials(samples, 51)
    assert_same(found.derivatives, tvident.fit_local_polynomials(missing(ANGLE), 51).derivatives)
    records = tvident.fit_local_polynomials([masked(ANGLE), ANGLE], 51)
    assert_same(records.derivatives[:, 0], found.derivatives)


def test_a_mask_that_masks_nothing_changes_nothing() -> None:
    nothing: Any = np.ma.masked_array(ANGLE)
    assert_same(
        tvident.fit_local_polynomials(nothing, 51).derivatives, tvident.fit_local_polynomials(ANGLE, 51).derivatives
    )
