"""A suspect that is tried and not found is said to be none; one that is found, or was not tried, is advised."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from tvident._advice.undescribed import LAG_NOT_TOLD
from tvident._identify.remedies import Trial

GIVEN = {"inertia": "auto", "damping": "auto", "stiffness": "windowed"}
CONSTANT = {"inertia": "constant", "damping": "constant", "stiffness": "windowed"}
RATE = 1000.0


def denied(
    name: str, seemed: float, tried: tuple[float, float | None] | None, *, varies: bool = False, lag: float = 0.0
) -> str | None:
    """Return what is said of a suspect that seemed to be so much, where so much was found with it, if it was tried, beside a lag."""
    kinds: Any = CONSTANT | ({"damping": "varying"} if varies else {})
    result: Any = SimpleNamespace(settings={"kinds": kinds, "lag": lag / RATE})
    identify: Any = None
    trial = Trial(identify, result, GIVEN, ["offset"], [name])
    if tried is not None:
        value, error = tried
        settings: dict[str, Any] = {"lag": value / RATE, "sample_rate": RATE}
        settings |= {} if error is None else {"lag_stderr": error / RATE}
        found: Any = SimpleNamespace(settings=settings, value=lambda _: tried, units={"cubic": "N m/rad^3"})
        trial._beside[0] = {(name,): found}  # noqa: SLF001 - what was tried
    suspect: Any = SimpleNamespace(name=name, value=seemed)
    return trial.denied([suspect]).get(name)


@pytest.mark.parametrize("name", ["lag", "cubic"])
def test_what_is_not_found_is_none(name: str) -> None:
    """Less than half of what it seemed to be, by two errors."""
    words = denied(name, -0.69, (0.0, 0.002))
    assert words is not None
    assert "is none" in words
    assert ("samples" if name == "lag" else "N m/rad^3") in words
    assert denied(name, -0.69, (-0.33, 0.002)) is not None
    assert denied(name, -0.69, (-0.33, 0.01)) is None
    assert denied(name, -0.69, (-0.7, 0.1)) is None


def test_a_lag_that_is_not_determined_is_not_told() -> None:
    """What changes takes its place: no amount of it is to be given."""
    assert denied("lag", 0.13, (0.0, None)) == LAG_NOT_TOLD


def test_only_what_is_tried_with_all_else_as_it_was_asked_for_is_denied() -> None:
    """Beside constants alone a record in which damping varies tells nothing of a suspect."""
    assert denied("lag", 0.13, None) is None
    assert denied("lag", 0.13, (0.0, 0.001), varies=True) is None


def test_a_lag_is_one_beside_the_lag_that_is_given() -> None:
    """A torque that is not late, with a lag of -2 given: what is left is a lag of 2, and none in all."""
    assert denied("lag", 2.0, (-0.02, 0.04), lag=-2.0) is None
    words = denied("lag", 0.6, (2.0, 0.04), lag=2.0)
    assert words is not None
    assert "0.000 ± 0.040 samples" in words
