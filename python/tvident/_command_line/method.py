"""Options of ``tvident identify`` for the method, and the method that they stand for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, get_args

import click

from tvident._command_line.options import CRITERION, Decorated, length, options_of
from tvident._derivatives import Selection
from tvident._identify import Method, StrongForm, Variation, WeakForm

METHODS = ("auto", "paper", "weak", "strong")
_FORMS: dict[str, Callable[..., WeakForm | StrongForm]] = {"weak": WeakForm, "strong": StrongForm}
_NAMES = {name: tuple(one.name for one in fields(form)) for name, form in (("weak", WeakForm), ("strong", StrongForm))}
NAMES = tuple(dict.fromkeys(name for names in _NAMES.values() for name in names))
"""Settings of either form, each an option of its own."""

METHOD: Callable[[Decorated], Decorated] = options_of(
    click.option(
        "--method",
        type=click.Choice(METHODS),
        help="auto (the default): all settings chosen from the recording; paper: as in the paper; weak: test functions, strong: "
        "derivatives, with the following settings.",
    ),
    click.option(
        "--window-length",
        metavar="LENGTH",
        help="Test function, or window of the polynomials: samples, odd, or '0.2 s'.",
    ),
    click.option("--exponent", metavar="NUMBER", help="Weak form: exponent of the test function, 3 to 20, or auto."),
    click.option("--regression-window", metavar="LENGTH", help="Samples solved together: a number, '0.2 s', or auto."),
    click.option(
        "--averaging/--no-averaging",
        default=None,
        help="Weak form: windows of many lengths, or one window around each sample (the default with --regression-window).",
    ),
    click.option(
        "--variation",
        type=click.Choice(("auto", *get_args(Variation))),
        help="How windowed parameters may change within a window.",
    ),
    click.option("--max-order", type=int, help="Strong form: highest candidate order."),
    CRITERION,
    click.option("--selection", type=click.Choice(get_args(Selection)), help="Strong form: how orders are chosen."),
    click.option(
        "--filter-torque/--no-filter-torque",
        default=None,
        help="Strong form: smooth the torque with the orders of the angle.",
    ),
)
"""Options of the method."""


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
