"""Expansions that nobody can mean."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tvident import Expansion


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"size": 4}, "take 5"),
        ({"size": 2**53}, "at most 1024"),
        ({"largest": 2**53}, "at most 1024"),
        ({"degree": 9}, "take 3"),
        ({"limits": (3, 1)}, "exchange"),
        *(({"limits": odd}, r"limits must be a pair.*write \(0, 1\)") for odd in (3, (), (0, 1, 2), ((0, 1), (0, 1)))),
    ],
)
def test_an_expansion_that_cannot_be(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Expansion("fourier", **given)


def test_two_channels_have_at_most_1024_functions_in_all() -> None:
    channels = np.arange(10.0), np.arange(10.0) ** 2
    Expansion("bspline", of=channels, size=(32, 32))
    with pytest.raises(ValueError, match="at most 1024 functions in all; got 33 x 32"):
        Expansion("bspline", of=channels, size=(33, 32))
