"""Parameters of tests by how long they take."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import settings

OF_ALL = 100
"""Examples of a property that says nothing of their number, in `make test-long`."""
LEAST = 3


def long(*values: object) -> list[Any]:
    """Give parameters, or tuples of them, that are left to `make test-long`."""
    return [pytest.param(*(one if isinstance(one, tuple) else (one,)), marks=pytest.mark.long) for one in values]


def examples(count: int) -> int:
    """Give how many examples of a slow property are tried: so many in `make test-long`, more in `make soak`, else a quarter."""
    return max(min(count, LEAST), count * settings().max_examples // OF_ALL)
