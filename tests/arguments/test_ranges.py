"""Percentiles of long records: the same as NumPy's, without sorting what is all alike."""

import numpy as np
import pytest

from tvident._arguments import finite, percentiles, told_once


@pytest.mark.parametrize("count", [1, 2, 9, 1000])
def test_percentiles_are_those_of_numpy(count: int) -> None:
    values = np.random.default_rng(count).standard_normal(count)
    assert percentiles(values, 5, 50, 95) == np.percentile(values, [5, 50, 95]).tolist()


@pytest.mark.parametrize("kind", ["noise", "walk", "ramp", "periodic", "steps", "few", "spikes", "single"])
def test_percentiles_of_long_records_are_those_of_numpy_to_the_last_bit(kind: str) -> None:
    generator, count = np.random.default_rng(3), 300_001
    noise = generator.standard_normal(count)
    values = {
        "noise": noise,
        "walk": np.cumsum(noise),
        "ramp": np.arange(count) / 7,
        # As often as numbers are looked at.
        "periodic": np.where(np.arange(count) % (count // 8192) == 0, 9.0, noise),
        "steps": np.where(np.arange(count) // 5000 % 2, 0.1, noise),
        "few": np.round(noise),
        "spikes": np.where(noise > 4, 1e9 * noise, 0.3),
        "single": noise.astype(np.float32),
    }[kind]
    shares = (0, 0.1, 5, 33.3, 50, 95, 99.99, 100)
    assert percentiles(values, *shares) == np.percentile(values, shares).tolist()


def test_numbers_that_are_all_alike_are_their_percentiles() -> None:
    assert percentiles(np.full(7, 0.1), 50, 95) == [0.1, 0.1]


def test_no_numbers_have_none() -> None:
    assert np.isnan(percentiles(np.empty(0), 5, 50)).all()


def test_one_number_for_all_samples_is_told_once() -> None:
    one = np.broadcast_to(np.array([[1.0], [2.0]]), (2, 500))
    assert told_once(one).tolist() == [[1.0], [2.0]]
    every = np.ones((2, 500))
    assert told_once(every) is every


@pytest.mark.parametrize("lacking", [[], [0, 1, 99], [0, 50], list(range(100))])
def test_finite_numbers_are_those_that_are_there(lacking: list[int]) -> None:
    values = np.arange(100.0)
    values[lacking] = np.nan
    assert finite(values).tolist() == values[np.isfinite(values)].tolist()
    assert np.shares_memory(finite(values), values) == (50 not in lacking)
