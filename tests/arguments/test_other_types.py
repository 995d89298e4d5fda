"""What is of another type is refused in words wherever it is given: with the rule, the value and the cure."""

from __future__ import annotations

import io
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
NONE: Any = None
PAIR: Any = np.array([0, 1])
MAPPING: Any = {}
OPEN: Any = io.StringIO("t,x")


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
    "path of a recording": lambda: tvident.read_recording(NONE),
    "path of an open file": lambda: tvident.recordings.read(OPEN),
    "path of a result": lambda: tvident.load(FIVE),
    "path to save": lambda: result().save(NONE),
    "path of a report": lambda: result().report(NONE),
    "path of a long recording": lambda: tvident.identify_file(NONE, "x.npy", angle="a", torque="b"),
    "output": lambda: tvident.identify_file("x.csv", NONE, angle="a", torque="b"),
    "axis": lambda: tvident.fit_local_polynomials(np.zeros((2, 40)), 11, axis=PAIR),
    "axis of a filter": lambda: tvident.savgol_filter(np.zeros((2, 40)), 11, 3, axis=LIST),
    "dof_axis": lambda: tvident.identify(FEW, FEW, sample_rate=1000, dof_axis=MAPPING),
    "ensemble_axis": lambda: tvident.identify(FEW, FEW, sample_rate=1000, ensemble_axis=PAIR),
    "size": lambda: tvident.Expansion("legendre", size=MAPPING),
    "size that is no whole number": lambda: tvident.Expansion("legendre", size=1.5),  # type: ignore[arg-type] # refused
    "size of functions of one's own": lambda: tvident.Expansion(lambda x, size: np.ones((x.size, size)), size=WORD),
    "loss": lambda: tvident.identify(FEW, FEW, sample_rate=1000, loss=FEW),
}


@pytest.mark.parametrize("name", CALLS)
def test_another_type_is_refused_in_words(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They ended in "unhashable type: 'dict'", "has no attribute 'items'", "the truth value of an array is ambiguous"."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises((TypeError, ValueError), match=r" must be .*; got .*; ") as refused:
        CALLS[name]()
    assert name.split(maxsplit=1)[0] in str(refused.value)
    assert list(tmp_path.iterdir()) == []


def test_no_value_has_an_array_for_a_name() -> None:
    with pytest.raises(KeyError, match="there are inertia, damping"):
        result().value(FEW)
