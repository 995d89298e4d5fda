"""Arguments of `identify` for tests: the paper's method and the weak form with some settings changed."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import tvident

_PAPER: dict[str, Any] = {
    "inertia": "windowed",
    "damping": "windowed",
    "stiffness": "windowed",
    "terms": (),
    "quantisation": 0.0,
}
"""What `method="paper"` takes beside its form."""


def _call(form: Any, defaults: dict[str, Any], beside: dict[str, Any], changed: dict[str, Any]) -> dict[str, Any]:
    names = {one.name for one in fields(form)}
    settings = {name: value for name, value in changed.items() if name in names}
    rest = {name: value for name, value in changed.items() if name not in names}
    return {"method": form(**(defaults | settings)), **beside, **rest}


def paper(**changed: Any) -> dict[str, Any]:
    """Give the arguments of the paper's method with some changed, its form's settings among them."""
    return _call(tvident.StrongForm, {}, _PAPER, changed)


def strong(**changed: Any) -> dict[str, Any]:
    """Give the arguments of the strong form with some changed."""
    return _call(tvident.StrongForm, {}, {}, changed)


def weak(**changed: Any) -> dict[str, Any]:
    """Give the arguments of the weak form with some changed."""
    return _call(tvident.WeakForm, {}, {}, changed)


def plain_weak(**changed: Any) -> dict[str, Any]:
    """Give the arguments of the weak form with one window of one length around each sample, everything windowed, nothing chosen."""
    form = {"window_length": 201, "exponent": 8, "regression_window": 200, "averaging": False, "variation": "constant"}
    return _call(tvident.WeakForm, form, _PAPER | {"quantisation": None}, changed)
