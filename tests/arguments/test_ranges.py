"""Percentiles of long records: the same as NumPy's, without sorting what is all alike."""

import numpy as np
import pytest

from tvident._arguments import percentiles


@pytest.mark.parametrize("count", [1, 2, 9, 1000])
def test_percentiles_are_those_of_numpy(count: int) -> None:
    values = np.random.default_rng(count).standard_normal(count)
    assert percentiles(values, 5, 50, 95) == np.percentile(values, [5, 50, 95]).tolist()


def test_numbers_that_are_all_alike_are_their_percentiles() -> None:
    assert percentiles(np.full(7, 0.1), 50, 95) == [0.1, 0.1]


def test_no_numbers_have_none() -> None:
    assert np.isnan(percentiles(np.empty(0), 5, 50)).all()
