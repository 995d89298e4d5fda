"""What is said of a linear axis: positions and forces, where an axis that turns has angles and torques."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import calls
import tvident
from merged.simulated import simulated
from tvident import Channel
from tvident._equation import LINEAR_UNITS, UNITS
from tvident._units import in_words_of

RIG = tvident.simulate_torsional_rig(6.0)
FORMS: dict[str, dict[str, Any]] = {"auto": {}, "paper": calls.paper()}


def on_rails(angle: Any, torque: Any, **call: Any) -> tvident.Identification:
    found: tvident.Identification = tvident.identify(
        Channel(1e3 * angle, "mm"), Channel(torque, "N"), sample_rate=1000, **call
    )
    return found


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("the torque's rate and an angle of the motion", "the force's rate and a position of the motion"),
        ("Torques and angles. The torque, An angle", "Forces and positions. The force, A position"),
        ("give angle_unit='deg', torque=0 or -torque", "give angle_unit='deg', torque=0 or -torque"),
        ("terms 'my torque', \"an angle\"; the masses' torque", "terms 'my torque', \"an angle\"; the masses' force"),
        ("vaf(angle, torque) compares the angle", "vaf(angle, torque) compares the position"),
        ("a rectangle, torque_rms", "a rectangle, torque_rms"),
    ],
)
def test_words_are_those_of_the_axis(written: str, said: str) -> None:
    assert in_words_of(LINEAR_UNITS, written) == said
    assert in_words_of(LINEAR_UNITS, said) == said
    assert in_words_of(UNITS, written) == written


@pytest.mark.first(1)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("lag", [0, 4])
def test_nothing_is_said_of_angles_where_there_are_none(form: str, lag: int, tmp_path: Path) -> None:
    turning = tvident.identify(RIG.angle, np.roll(RIG.torque, lag), sample_rate=1000, **FORMS[form])
    sliding = on_rails(RIG.angle, np.roll(RIG.torque, lag), **FORMS[form])
    words = re.sub(r"\btorque_\w+|-torque\b", "", sliding.summary() + sliding._repr_html_())
    assert not re.search(r"\b(angle|torque)s?\b", words)
    assert "the force" in sliding.summary()
    assert "of the position simulated" in sliding.summary()
    assert "the torque" in turning.summary()
    # The same is said: one equation is the other in other units.
    assert len(sliding.reasons) == len(turning.reasons)
    sliding.report(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "Delay of the force" in page
    assert "Delay of the torque" not in page


def test_trials_of_an_axis_that_slides_have_forces() -> None:
    trials = simulated(3, 2000, lambda times: np.full(times.size, 12.0), seed=1)
    angle, torque = Channel(trials.angle, "m"), Channel(trials.torque, "N")
    words = tvident.identify(angle, torque, sample_rate=1000, ensemble_axis=0).summary()
    assert "of the force" in words
    assert not re.search(r"\b(angle|torque)s?\b", words)
