"""Rows of numbers from columns: how results are kept, and what a file of rows holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import IO, Any

import numpy as np
import numpy.typing as npt

_AT_ONCE = 1 << 12
"""Rows that stay in the processor's cache while one column after the other is written into them."""


def write_rows(file: IO[bytes], row: np.dtype[Any], columns: Mapping[str, npt.NDArray[Any]]) -> int:
    """Write columns as rows with these fields, and return how many there are."""
    count = next(iter(columns.values())).size
    rows = np.empty(min(count, _AT_ONCE), row)
    for first in range(0, count, _AT_ONCE):
        some = rows[: count - first]
        for name, values in columns.items():
            some[name] = values[first : first + some.size]
        file.write(some.view(np.uint8).data)
    return count
