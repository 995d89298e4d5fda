"""What is said of an option that ``identify`` or a form does not have: whose it is, what it is called, or what may be meant."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, TypeVar

from tvident import _arguments as arguments

_Function = TypeVar("_Function", bound=Callable[..., Any])
_Form = TypeVar("_Form", bound=type)

_CHANNELS = frozenset(("angle", "torque"))

_MOST_NAMES = 6
"""Channels that a message lists."""

_FORMS: dict[str, frozenset[str]] = {}
"""The settings of each form, by its name."""

_CALLED = {
    "form": "method=tvident.WeakForm() or tvident.StrongForm()",
    "preset": "method='auto' or method='paper'",
    "equations": "regression_window= of a form: method=tvident.StrongForm(regression_window=200)",
    "fs": "sample_rate= in Hz",
    "rate": "sample_rate= in Hz",
    "dt": "delta= in seconds",
    "data": "channels of it: identify(data['angle'], data['torque'], …)",
    "time": "t= in seconds",
    "times": "t= in seconds",
}
"""What options are called that other libraries, and earlier versions, have under these names."""


def explained_form(form: _Form) -> _Form:
    """Return a form; a setting that it does not have is an error that says what would be right."""
    _FORMS[form.__name__] = frozenset(signature(form).parameters)
    form.__init__ = explained(form.__init__, form.__name__)  # type: ignore[misc] # a form is made by nothing else
    return form


def explained(function: _Function, called: str = "identify") -> _Function:
    """Return the function; an option that it does not have is an error that says what would be right."""
    parameters = signature(function).parameters
    known = frozenset(parameters) - {"self"}
    in_order = [
        name for name, one in parameters.items() if one.kind in {one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD}
    ]

    @wraps(function)
    def call(*args: Any, **options: Any) -> Any:
        # Forms take settings in order; nothing but the data of a record has one.
        if len(args) > len(in_order) and "sample_rate" in known:
            nameless = args[len(in_order)]
            raise TypeError(
                f"{called} takes everything but {' and '.join(in_order)} by name; got {arguments.shown(nameless)} without one; "
                f"write {_name_of(nameless)}= in front of it"
            )
        if not known.issuperset(options):
            name = next(name for name in options if name not in known)
            raise TypeError(f"{called} has no option {arguments.shown(name)}; {_right(name, known)}")
        lacking = [name for name in in_order[len(args) :] if name in _CHANNELS and name not in options]
        if lacking:
            raise TypeError(_both_channels(called, args[0] if args else None))
        return function(*args, **options)

    return call  # type: ignore[return-value]  # takes what the function takes


def _both_channels(called: str, given: Any) -> str:
    """Return what to write where angle or torque is not given: of a table or a recording two of its channels."""
    wanted = f"{called} needs angle and torque"
    names = [str(name) for name in given] if hasattr(given, "keys") or arguments.is_table(given) else []
    if not names:
        return f"{wanted}; got {'one channel' if given is not None else 'none'}; write {called}(angle, torque, sample_rate=1000), say"
    some = ", ".join(names[:_MOST_NAMES]) + (" …" if len(names) > _MOST_NAMES else "")
    return f"{wanted}, two channels; got what holds {some}; write {called}(data['angle'], data['torque'], sample_rate=1000), say"


def _name_of(value: Any) -> str:
    """Return the name that a value without one most likely needs: many numbers are times, a word or a form is a method."""
    if isinstance(value, str) or type(value).__name__ in _FORMS:
        return "method"
    return "t" if hasattr(value, "__len__") else "sample_rate"


def _right(name: str, known: frozenset[str]) -> str:
    """Return what would be right in place of an option that there is not."""
    if name in _CALLED:
        return f"use {_CALLED[name]}"
    forms = [form for form, settings in _FORMS.items() if name in settings]
    if forms:
        return "it belongs to a form: use " + " or ".join(f"method=tvident.{form}({name}=…)" for form in forms)
    return arguments.nearest(name, known) or f"it has {', '.join(sorted(known))}"
