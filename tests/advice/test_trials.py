"""What is tried beside parameters that change: what may be missing there, and nothing else, since that takes longest."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import tvident
from tvident import Status
from tvident._identify.offered import can_be
from tvident._identify.remedies import Trial

AUTOMATIC = {"inertia": "auto", "damping": "auto", "stiffness": "windowed"}


class LeavingSomething(Trial):
    """A trial in which every equation leaves something to explain, and a machine that can be."""

    def _leaves_nothing(self, *_: object) -> bool:
        return False

    def _feeds_energy(self, *_: object) -> bool:
        return False

    def _is_late(self, *_: object) -> bool:
        return True

    def _worth_it(self, *_: object) -> dict[Any, Any]:
        return {}


def tried(
    suspects: list[str],
    *,
    there: set[str],
    beyond_chance: list[str],
    undoubted: Collection[str] = (),
    left: Mapping[str, float] | None = None,
) -> list[list[str]]:
    """Return what is tried beside constants, and what beside parameters that change.

    Some terms are there beside constants. A first look sees what is left with each, or is not possible.
    """
    stages: dict[str, list[str]] = {"constant": [], "auto": []}

    def identify(*, lag: Any, terms: list[Any], diagnose: bool = False, **given: Any) -> Any:
        names = [one if isinstance(one, str) else one[0] for one in terms[1:]] + ["lag"] * (lag == "auto")
        if not diagnose:
            shares = [1.0 if left is None else left.get(one, 1.0) for one in names]
            spread = np.full(3, np.nan if left is None else np.sqrt(np.prod(shares)))
            return SimpleNamespace(residual_std=spread, value=lambda _: (1.0, 0.1))
        change = "+".join(names)
        stages[given["damping"]].append(change)
        is_there = change in there and given["damping"] == "constant"
        return SimpleNamespace(
            record_status=Status(0) if change in undoubted else Status.TERM_SUSPECTED,
            settings={"lag": 1.0 if is_there else 0.0, "lag_stderr": 0.1},
            value=lambda name: (1.0, 0.1) if name == change and is_there else (0.0, 0.1),
        )

    kinds = {"inertia": "constant", "damping": "varying", "stiffness": "windowed"}
    settings = {"kinds": kinds, "lag": 0.0, "window_length": 21, "exponent": 9}
    result: Any = SimpleNamespace(settings=settings, time=np.arange(4000.0), record_status=Status(0))
    trial = LeavingSomething(identify, result, AUTOMATIC, ["offset"], suspects, beyond_chance=beyond_chance)
    first, again = (list(trial._each_beside_changes()) for _ in range(2))  # noqa: SLF001 - what is tried is the test
    assert first == again
    return list(stages.values())


def test_all_are_tried_beside_constants_and_few_beside_what_changes() -> None:
    suspects = ["cubic", "lag", "coulomb", "preload"]
    assert tried(suspects, there=set(), beyond_chance=["cubic"]) == [suspects, ["lag", "cubic"]]
    assert tried(suspects, there={"coulomb"}, beyond_chance=[]) == [suspects, ["lag", "coulomb"]]
    assert tried(suspects, there={"lag", "preload"}, beyond_chance=["preload"]) == [suspects, ["lag", "preload"]]


def test_a_first_look_tells_what_is_tried_and_together_with_what() -> None:
    """What no look sees is tried where something else suspects it; a lag that is not seen is not tried."""
    suspects = ["cubic", "lag", "coulomb", "preload"]
    assert tried(suspects, there=set(), beyond_chance=["cubic"], left={"coulomb": 0.2}) == [
        ["coulomb", "cubic"],
        ["cubic"],
    ]
    both = {"coulomb": 0.2, "lag": 0.8}
    assert tried(suspects, there=set(), beyond_chance=[], left=both) == [["coulomb", "coulomb+lag", "lag"], ["lag"]]
    assert tried(suspects, there=set(), beyond_chance=[], left={"coulomb": 0.95}) == [[], []]


def test_nothing_is_tried_beside_what_changes_where_nothing_contradicts_an_equation_beside_constants() -> None:
    both = ["coulomb", "lag"]
    assert tried(both, there={"coulomb"}, beyond_chance=["coulomb"], undoubted={"coulomb"}) == [both, []]
    # One that is not there, or that something contradicts, settles nothing.
    assert tried(both, there={"lag"}, beyond_chance=["coulomb"], undoubted={"coulomb"}) == [both, ["lag", "coulomb"]]


def test_friction_that_drives_the_motion_is_none() -> None:
    rig = tvident.simulate_torsional_rig(pattern="constant", seed=1)
    velocity = np.gradient(rig.angle, rig.time)
    for factor in (0.05, -0.05):
        torque = rig.torque + factor * np.sign(velocity)
        found = tvident.identify(rig.angle, torque, sample_rate=1000.0, terms=["offset", "coulomb"], method="auto")
        assert found.value("coulomb").value * factor > 0
        assert can_be("coulomb", found) == (factor > 0)
        assert can_be("offset", found)


def rubbing() -> tuple[Any, Any, Any]:
    """Give angle and torque of a machine with dry friction, and its damping, which drifts."""
    samples, rate = 70_000, 500.0
    rng, t = np.random.default_rng(71402), np.arange(samples) / rate
    waves = [(2 * np.pi * one, rng.uniform(0, 2 * np.pi)) for one in np.linspace(0.5, 12, 24)]
    angle, velocity, acceleration = np.zeros((3, samples))
    for omega, phase in waves:
        angle += 0.01 * np.sin(omega * t + phase)
        velocity += 0.01 * omega * np.cos(omega * t + phase)
        acceleration -= 0.01 * omega**2 * np.sin(omega * t + phase)
    damping = 0.02 * (1 + 0.4 * np.sin(2 * np.pi * t / 280))
    torque = 0.0123 * acceleration + damping * velocity + 13 * angle + 0.01 * np.sign(velocity)
    angle, torque = (one + 1e-3 * one.std() * rng.standard_normal(samples) for one in (angle, torque))
    return angle, torque, damping


def test_what_a_part_finds_elsewhere_is_compared_with_the_whole_record_there() -> None:
    """Beside dry friction a damping that drifts was 16 errors off; a part hardly tells it, as it is nearly constant there."""
    angle, torque, damping = rubbing()
    result = tvident.identify(angle, torque, sample_rate=500)
    off = result.damping - damping
    advice = next(line for line in result.advice if "coulomb" in line)
    # Errors hold what the friction changes.
    assert np.median(np.abs(off) / result.stderr["damping"]) < 1.5
    found = re.search(r"damping becomes ([0-9.]+) ± ([0-9.]+) N m s/rad at ([0-9.]+)-([0-9.]+) s", advice)
    assert found is not None, advice
    value, error, begin, end = map(float, found.groups())
    there = (result.time >= begin) & (result.time <= end)
    assert abs(value - np.median(damping[there])) < max(4 * error, 0.01 * value)
    assert result.summary().startswith("do not trust: another equation explains more, and finds another damping")


@pytest.mark.parametrize("how", ["angle", "mask"])
def test_a_part_of_which_nothing_is_there_is_not_the_busiest(how: str) -> None:
    angle, torque, _ = rubbing()
    torque[16384:32768] *= 1.2
    missing = np.zeros(angle.size, bool)
    missing[16000:33000] = True
    if how == "angle":
        angle = np.where(missing, np.nan, angle)
    mask = ~missing if how == "mask" else None
    result = tvident.identify(angle, torque, sample_rate=500, mask=mask)
    assert any("try terms=['offset', 'coulomb']" in line for line in result.advice)
    assert result.summary().startswith("do not trust: another equation explains more")


@pytest.mark.parametrize("given", [0.0, -1.0, 3.0])
@pytest.mark.parametrize(
    ("left", "error", "is_late"),
    [(0.98, 0.01, True), (0.4, 0.01, False), (-0.1, 0.26, False), (0.4, 0.5, True), (0.0, None, True)],
)
def test_a_lag_most_of_which_is_gone_beside_friction_is_none(
    left: float, error: float | None, is_late: bool, given: float
) -> None:
    """One that is within chance of what it was, or is not determined beside friction, is not shown to be any.

    All lags are told beside the one that is given.
    """
    asked: list[dict[str, Any]] = []

    def identify(**asked_for: Any) -> Any:
        asked.append(asked_for)
        return SimpleNamespace(
            settings={"lag": given + left, "sample_rate": 1.0} | ({} if error is None else {"lag_stderr": error})
        )

    kinds = {"inertia": "constant", "damping": "varying", "stiffness": "windowed", "offset": "windowed"}
    settings = {
        "kinds": kinds,
        "lag": given,
        "window_length": 21,
        "exponent": 9,
        "regression_window": 84,
        "sample_rate": 1.0,
    }
    result: Any = SimpleNamespace(settings=settings)
    found: Any = SimpleNamespace(settings=settings | {"lag": given + 1.0})
    trial = Trial(identify, result, AUTOMATIC, ["offset"], ["lag"])
    assert trial._is_late(found) == is_late  # noqa: SLF001 - what is tried is the test
    terms = [("offset", "windowed"), ("coulomb", "constant"), ("quadratic_drag", "constant")]
    lengths = {name: settings[name] for name in ("window_length", "exponent", "regression_window")}
    expected = {"inertia": "constant", "damping": "auto", "stiffness": "windowed"}
    assert asked == [{**expected, "terms": terms, "lag": "auto", **lengths}]


@pytest.mark.parametrize("moved", ["", ", damping becomes 0.4"])
def test_a_lag_of_next_to_nothing_is_told_where_it_moves_something(moved: str) -> None:
    """What sums over samples leave of integrals looks like a lag of thousandths of a sample: without noise it is beyond chance."""

    class Moving(Trial):
        def _moved(self, *_: object, **__: object) -> str:
            return moved

    def identify(**_: Any) -> Any:
        return SimpleNamespace(settings={"lag": 1e-6, "lag_stderr": 1e-9, "sample_rate": 1000.0})

    kinds = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
    settings = {"kinds": kinds, "lag": 0.0, "window_length": 21, "exponent": 9, "sample_rate": 1000.0}
    result: Any = SimpleNamespace(settings=settings)
    found: Any = SimpleNamespace(settings=settings | {"lag": 1e-6})
    assert Moving(identify, result, AUTOMATIC, [], ["lag"])._is_late(found) == bool(moved)  # noqa: SLF001 - as above
