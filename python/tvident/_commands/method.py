"""The method that options stand for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

import click

from tvident._commands.given import length
from tvident._identify import Method, StrongForm, WeakForm

_FORMS: dict[str, Callable[..., WeakForm | StrongForm]] = {"weak": WeakForm, "strong": StrongForm}
_NAMES = {name: tuple(one.name for one in fields(form)) for name, form in (("weak", WeakForm), ("strong", StrongForm))}
NAMES = tuple(dict.fromkeys(name for names in _NAMES.values() for name in names))
"""Settings of either form, each an option of its own."""


def method_of(name: str | None, given: Mapping[str, Any], *, has_settings: bool) -> Method:
    """Return the method that options stand for; refuse settings of another one."""
    options = [f"--{one.replace('_', '-')}" for one in given]
    if has_settings and (name is not None or given):
        raise click.UsageError(
            f"--settings hold a method; got {(options if name is None else ['--method'])[0]} too; drop one of them"
        )
    form = "weak" if name in {None, "auto"} else str(name)
    if form == "paper" and given:
        raise click.UsageError(f"--method paper has all its settings; got {options[0]}; use --method strong")
    foreign = [one for one in given if form in _NAMES and one not in _NAMES[form]]
    if foreign:
        option, other = f"--{foreign[0].replace('_', '-')}", "strong" if form == "weak" else "weak"
        raise click.UsageError(f"{option} belongs to --method {other}; got it with {form}; leave it out, or give that")
    if not given and name in {None, "auto", "paper"}:
        return "paper" if name == "paper" else "auto"
    return _FORMS[form](**{one: _value(one, value) for one, value in given.items()})


def _value(name: str, value: Any) -> Any:
    """Return what an option's text stands for."""
    return length(value) if name in {"window_length", "regression_window", "exponent"} else value
