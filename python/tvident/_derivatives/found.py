"""Estimates of the core, before they are put into the shape of the samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core


@dataclass(frozen=True)
class Found:
    """What is known of some records, with the axis of time last."""

    derivatives: npt.NDArray[np.float64]
    order: npt.NDArray[np.uint8]
    status: npt.NDArray[np.uint16]
    sigma: npt.NDArray[np.float64]
    window_length: int | str | npt.NDArray[np.intp]
    settings: dict[str, Any]
    errors: Callable[[], npt.NDArray[np.float64]]
    """Gives the standard errors, in the shape of the derivatives."""
    plan_of: Callable[[tuple[int, ...]], _core.LocalPolynomials | _core.WindowFit]
    """Gives the plan of a record's windows."""
