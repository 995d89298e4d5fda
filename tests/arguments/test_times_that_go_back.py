"""Times that go back: what programs write so is named, with its cure."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import tvident

COUNT = np.arange(2000)
ANGLE = np.sin(0.1 * COUNT)


def refused(t: npt.NDArray[np.float64]) -> str:
    with pytest.raises(ValueError, match="t must increase") as caught:
        tvident.identify(ANGLE, ANGLE, t=t)
    return str(caught.value)


@pytest.mark.parametrize("ticks", [2000, 1999.7])
def test_a_counter_that_begins_again_is_named(ticks: float) -> None:
    """It was to be sorted by time."""
    words = refused(np.round(COUNT * ticks) % 65536 * 1e-6)
    assert (
        "by the same, as a counter does that begins again after 0.065536 s: unwrap it by that (numpy.unwrap)" in words
    )
    assert "give sample_rate=500 if samples were taken evenly" in words
    assert "sort" not in words


def test_trials_below_each_other_are_to_be_cut() -> None:
    """They were to be unwrapped, which joins them."""
    words = refused(np.tile(np.arange(400) / 500, 5))
    assert "if trials follow one another, cut the record where each begins and give a list of them" in words


def test_a_clock_that_was_set_back_once_is_no_counter() -> None:
    words = refused(COUNT / 500 - (COUNT > 700))
    assert "or cut the record where its clock was set back" in words
    assert "counter" not in words
    assert "last" not in words


def test_a_clock_that_is_set_back_by_other_spans_is_no_counter() -> None:
    assert "counter" not in refused(COUNT / 500 - (COUNT > 700) - 0.5 * (COUNT > 900))


@pytest.mark.parametrize(
    ("rows", "words"), [(1, "last row, if it is no sample"), (3, "last 3 rows, if they are no samples")]
)
def test_rows_of_means_below_the_numbers_are_asked_about(rows: int, words: str) -> None:
    t = COUNT / 500
    t[-rows:] = np.linspace(2.0, 2.1, rows)
    assert words in refused(t)
