"""A second of the rig, what plain arrays of it give, and dates for its samples: for tests of the containers that samples come in."""

from __future__ import annotations

from typing import Any

import pytest

import tvident

pd = pytest.importorskip("pandas")

RIG = tvident.simulate_torsional_rig(duration=1.0)
ANGLE, TORQUE, N = RIG.angle, RIG.torque, RIG.angle.size
GIVEN: dict[str, Any] = {"inertia": 0.0123, "method": tvident.WeakForm(window_length=33, exponent=9)}
PLAIN = tvident.identify(ANGLE, TORQUE, sample_rate=1000, **GIVEN)
DATES = pd.date_range("2024-03-31 01:59:59.5", periods=N, freq="1ms", tz="Europe/Paris", name="when")
"""Summer time begins in between."""


def identified(angle: Any, torque: Any, **options: Any) -> tvident.Identification:
    found: tvident.Identification = tvident.identify(angle, torque, **({"sample_rate": 1000} | GIVEN | options))
    return found
