"""Of which record it is said what half a sample of lag would change: one that may be believed otherwise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tvident._advice.lag import untold_lag
from tvident._status import Status

NAMES = ["inertia", "damping", "coulomb"]


def record(lag_error: float = 0.3, *, status: int = 0, damping_by: float = -0.8, known: bool = False) -> Any:
    """Return a record whose damping is 2 ± 0.1 and changes by so much with every sample of lag, whose friction changes by more."""
    unknown = SimpleNamespace(values=np.full(3, 2.0), stderr=np.full(3, 0.1), factor=1.0)
    lag = SimpleNamespace(name="lag", value=0.1, stderr=lag_error, conspicuous=known)
    return SimpleNamespace(
        record_status=status,
        suspects=[lag],
        unknowns=[unknown] * 3,
        with_lag=[(0, 0.01), (1, damping_by), (2, 5.0)],
    )


def test_what_changes_is_said_with_its_cure() -> None:
    (line,) = untold_lag(record(), NAMES, 1e-3)
    assert "changes damping by 20 %:" in line
    assert "lag=-0.0005 (seconds)" in line


@pytest.mark.parametrize(
    "silent",
    [
        record(lag_error=0.05),
        record(known=True),
        record(damping_by=0.3),  # one and a half standard errors
        record(status=int(Status.SCALES_DISAGREE)),
    ],
)
def test_nothing_is_said_where_the_lag_is_told_or_nothing_can_be_believed(silent: Any) -> None:
    assert untold_lag(silent, NAMES, 1e-3) == []
