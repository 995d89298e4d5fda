"""A call that lacks what it needs says what that is, what there was, and how it is called."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import tvident

CALLED: list[Callable[..., Any]] = [
    tvident.Chain,
    tvident.Expansion,
    tvident.FileRecording,
    tvident.LocalPolynomialStream,
    tvident.Mechanism,
    tvident.RollingStream,
    tvident.Term,
    tvident.compare_models,
    tvident.fit_local_polynomials,
    tvident.identify,
    tvident.identify_file,
    tvident.load,
    tvident.read_recording,
    tvident.rolling_least_squares,
    tvident.savgol_filter,
]


@pytest.mark.parametrize("called", CALLED, ids=lambda one: one.__name__)
def test_a_call_of_nothing_says_what_it_needs(called: Callable[..., Any]) -> None:
    """Python's own words were "__init__() missing 1 required positional argument", and no more."""
    with pytest.raises(TypeError, match=rf"^{called.__name__} needs .+; got none; write {called.__name__}\(.+\), say$"):
        called()


def test_what_is_lacking_beside_what_is_given_is_named() -> None:
    with pytest.raises(
        TypeError, match=r"^Expansion needs family; got none; write Expansion\('bspline', of=position\)"
    ):
        tvident.Expansion(of=np.zeros(3))  # type: ignore[call-arg] # what is asked here
    with pytest.raises(TypeError, match=r"^rolling_least_squares needs window_length; got A and b alone; write "):
        tvident.rolling_least_squares(np.zeros((9, 1)), b=np.zeros(9))  # type: ignore[call-arg] # what is asked here
    with pytest.raises(TypeError, match=r"^identify_file needs angle and torque; got path and output alone; write "):
        tvident.identify_file("in.npy", "out.npy")  # type: ignore[call-arg] # what is asked here


def test_calls_that_lack_nothing_are_what_they_were() -> None:
    expansion = tvident.Expansion("bspline", degree=2)
    assert pickle.loads(pickle.dumps(expansion)) == expansion  # noqa: S301 - its own
    assert next(iter(inspect.signature(tvident.Expansion).parameters)) == "family"
    with pytest.raises(TypeError, match="unexpected keyword argument 'knots'"):
        tvident.Expansion("bspline", knots=3)  # type: ignore[call-arg] # what is asked here
