"""The table of built-in terms: functions, and what else is known of each. No other place names one."""

from __future__ import annotations

import ast
import math
from pathlib import Path

import numpy as np

from built_in_functions import FUNCTIONS
from tvident import _core
from tvident._choices import BUILT_IN, FRICTION, OFFSET

PACKAGE = Path(__file__).parents[2] / "python" / "tvident"
TABLE = PACKAGE / "_choices" / "built_in.py"
OTHERS = {
    "_compare/call.py": "candidate equations of motion are made of them",
    "_identify/aligned.py": "an offset of clocks",
    "_identify/own_clocks.py": "an offset of clocks",
    "_commands/identification.py": "an offset of clocks",
    "_files/headers.py": "what a scope calls the zero of a channel",
}
"""Files that name a term, or mean something else by the word."""


def test_the_table_here_holds_the_functions() -> None:
    angle, velocity = np.random.default_rng(3).standard_normal((2, 50))
    for name, function in FUNCTIONS.items():
        known = velocity if BUILT_IN[name].needs_velocity else None
        np.testing.assert_array_equal(BUILT_IN[name].function(np, angle, known), function(0.0, angle, velocity))


def test_a_spring_that_softens_may_be_a_pendulum() -> None:
    # On angles below 1 rad a record hardly tells the cube from the sine.
    assert BUILT_IN["cubic"].suspected(-1.0, "-1.0 ± 0.1 N m/rad^3") == (
        "the spring seems to soften: -1.0 ± 0.1 N m/rad^3 (so does a pendulum's: then it is 'gravity')"
    )
    assert "pendulum" not in BUILT_IN["cubic"].suspected(1.0, "1.0 ± 0.1 N m/rad^3")


def test_there_is_one_table_here_and_one_in_the_core() -> None:
    linear = [name for name, term in BUILT_IN.items() if not term.inner]
    assert linear == _core.built_in_terms()
    assert linear == list(FUNCTIONS)
    for term in BUILT_IN.values():
        assert "{amount}" in term.suspicion
        assert term.unit
        assert term.meaning


def test_the_table_knows_what_depends_on_the_angle_and_when_it_repeats_itself() -> None:
    angle, velocity = np.random.default_rng(4).standard_normal((2, 50))
    for name, function in FUNCTIONS.items():
        term, values = BUILT_IN[name], function(0.0, angle, velocity)
        assert term.is_of_angle == bool((function(0.0, angle + 0.1, velocity) != values).any())
        for turn in (0.5, math.pi, 2 * math.pi, 4 * math.pi):
            again = bool(np.allclose(function(0.0, angle + turn, velocity), values, rtol=1e-12, atol=1e-12))
            assert term.repeats_after(turn) == again
        assert term.repeats_after(0.0) == (not term.is_of_angle)


def test_the_two_that_are_spoken_of_are_in_the_table() -> None:
    assert list(BUILT_IN)[:2] == [OFFSET, FRICTION]
    assert [name for name, term in BUILT_IN.items() if term.dissipates] == [FRICTION, "quadratic_drag"]


def test_no_other_file_names_a_term() -> None:
    named = {
        str(path.relative_to(PACKAGE))
        for path in PACKAGE.rglob("*.py")
        if path != TABLE
        and any(
            isinstance(one, ast.Constant) and one.value in BUILT_IN
            for one in ast.walk(ast.parse(path.read_text("utf-8")))
        )
    }
    assert named == set(OTHERS)
