"""Random arguments: what a user may mean, and what nobody can."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

ODD: tuple[Any, ...] = (
    *(0, -1, 1.5, 2.0, True, None, "x", b"5", [1], (), {}, 1j, np.nan, np.inf, -np.inf),
    *(2**31, 2**32 + 1, 2**53, 2**62, 2**63, 2**64, -(2**63), 10**400, -(10**400), 10**5000),
    *(1e300, 1e308, 5e-324, 1e-320, 1e18, 1e-18),
    *(np.int8(5), np.float32(3), np.array(3), np.array([1, 2]), np.array("x"), np.bool_(1), np.datetime64(3, "s")),
    *("0.2 s", "0.2s ", "auto", " auto ", "-1 s", "inf s", "1e300 s", "1e-300 s", "\x1b[31m", "a\nb"),
    *(object(), len, np.ma.masked),
)
"""What is no sane value for anything."""


def one(generator: np.random.Generator, *sane: Any) -> Any:
    """Give a sane value, or once in eight times an odd one."""
    choices = ODD if generator.random() < 1 / 8 else sane
    return choices[int(generator.integers(len(choices)))]


def window(generator: np.random.Generator, samples: int) -> int:
    """Give a length of windows: small, usual, about as long as the record."""
    usual = (1, 2, 3, 4, 5, 7, 9, 11, 15, 17, 21, 31, 51, 63, 101, 151, 201, 301)
    near = (samples - 2, samples - 1, samples, samples + 1, samples + 2, int(generator.integers(0, samples + 3)))
    return max(0, int(generator.choice(usual if generator.random() < 0.7 else near)))


def some(generator: np.random.Generator, options: dict[str, Callable[[], Any]], share: float = 0.2) -> dict[str, Any]:
    """Give some of the options."""
    return {name: draw() for name, draw in options.items() if generator.random() < share}
