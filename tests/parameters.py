"""Parameters of tests by how long they take."""

from __future__ import annotations

from typing import Any

import pytest


def long(*values: object) -> list[Any]:
    """Give parameters, or tuples of them, that are left to `make test-long`."""
    return [pytest.param(*(one if isinstance(one, tuple) else (one,)), marks=pytest.mark.long) for one in values]
