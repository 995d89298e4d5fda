"""Lags and offsets of clocks as on the command line: seconds, or a text with a unit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tvident

RIG = tvident.simulate_torsional_rig(duration=2.0)


@pytest.mark.parametrize(
    ("given", "seconds"),
    [
        ("2 ms", 0.002),
        ("-0.5ms", -0.0005),
        ("0 s", 0.0),
        ("1e-3 s", 0.001),
        (["2 ms"], [0.002]),
        ("- 2 ms", -0.002),
        ("2 \u03bcs", 2e-6),
    ],
)
def test_a_lag_may_have_a_unit(given: Any, seconds: Any) -> None:
    call: dict[str, Any] = {"sample_rate": 1000, "step": 100}
    found, same = (tvident.identify(RIG.angle[None], RIG.torque[None], lag=lag, **call) for lag in (given, seconds))
    assert np.array_equal(found.stiffness, same.stiffness)
    assert found.settings["lag"] == same.settings["lag"]


@pytest.mark.parametrize("lag", ["x", "2", "2 V", "inf s", ""])
def test_a_lag_that_is_no_time_hears_what_is(lag: str) -> None:
    with pytest.raises(ValueError, match=r"lag must be ('auto', seconds, or a time such as '2 ms'|finite)"):
        tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, lag=lag)


def test_an_offset_of_clocks_may_have_a_unit() -> None:
    t = np.asarray(RIG.time)
    found, same = (tvident.identify(RIG.angle, RIG.torque, t=(t, t), align=align) for align in ("1 ms", 0.001))
    assert np.array_equal(found.stiffness, same.stiffness, equal_nan=True)
    with pytest.raises(
        ValueError, match="align must be 'offset' or 'drift', seconds, or a time such as '2 ms'; got 'x'"
    ):
        tvident.identify(RIG.angle, RIG.torque, t=(t, t), align="x")
    for several in ([0.1, 0.2], np.array([0.1, 0.2]), np.array("offset")):
        wrong: Any = several
        with pytest.raises(TypeError, match="align must be a number; got"):
            tvident.identify(RIG.angle, RIG.torque, t=(t, t), align=wrong)
