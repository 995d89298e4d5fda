"""What is of another type is refused in words wherever it is given: with the rule, the value and the cure."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident

FEW: Any = np.zeros(3)
FIVE: Any = 5
WORD: Any = "x"
LIST: Any = [[1, 2]]


@cache
def result() -> tvident.Identification:
    rig = tvident.simulate_torsional_rig(duration=1.0)
    return tvident.identify(rig.angle, rig.torque, sample_rate=1000, stiffness="constant")


CALLS: dict[str, Callable[[], Any]] = {
    "record": lambda: result().value("inertia", record=1),
    "record of another type": lambda: result().value("inertia", record=FEW),
    "channels of a recording": lambda: tvident.FileRecording(FEW),
    "channels of a report": lambda: result().report("x.html", channels=FEW),
    "title": lambda: result().report("x.html", title=FEW),
    "tied": lambda: tvident.Matrix(tied=FIVE),
    "tied entries": lambda: tvident.Matrix(tied=LIST),
    "entries": lambda: tvident.Matrix(entries=LIST),
    "springs": lambda: tvident.Chain(2, springs=FIVE),
    "result": lambda: tvident.plan_experiment(result=WORD),
    "quantisation": lambda: tvident.LocalPolynomialStream(51, sample_rate=1000, quantisation=FEW),
    "loss": lambda: tvident.identify(FEW, FEW, sample_rate=1000, loss=FEW),
}


@pytest.mark.parametrize("name", CALLS)
def test_another_type_is_refused_in_words(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They ended in "'int' object is not iterable", "has no attribute 'items'", "the truth value of an array is ambiguous"."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises((TypeError, ValueError), match=r" must be .*; got .*; ") as refused:
        CALLS[name]()
    assert name.split(maxsplit=1)[0] in str(refused.value)
    assert list(tmp_path.iterdir()) == []


def test_no_value_has_an_array_for_a_name() -> None:
    with pytest.raises(KeyError, match="there are inertia, damping"):
        result().value(FEW)
