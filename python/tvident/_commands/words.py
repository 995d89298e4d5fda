"""Says with options what messages say with arguments of Python: whoever typed a command can type the cure."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Mapping

import click

from tvident._arguments import listed
from tvident._units import QUOTED

_OTHER_NAMES = {"terms": "--term", "models": "--model", "t": "--time"}

_CURE = re.compile(
    rf"(?P<quoted>{QUOTED})"
    r"|(?P<clocks>\bt=\(t, t\))"
    r"|(?P<reaction>\bpass -torque\b)"
    r"|(?<![\w.-])(?<!\w\()(?P<name>[a-z_]+)="
    r"(?P<value>'[^']*'|\"[^\"]*\"|\[[^\[\]]*\]|[+-]?\d[\w.+-]*(?<!\.)|[a-z]+\b(?![.(]))?(?![=\w(\[]|\.\w)"
)
"""What is said otherwise with options: an argument, without its value where whoever calls is to find it. What stands in quotes, and is
no value, is a name that somebody gave, whatever it looks like."""


def in_options(text: str) -> str:
    """Return text in which arguments that the command at work has an option for are written as the option.

    Parameters
    ----------
    text : str
        Such as ``give angle_unit='deg', or terms=['offset', ('coulomb', 'windowed')]``.

    Returns
    -------
    str
        ``give --angle-unit deg, or --term offset --term coulomb:windowed``.
    """
    context = click.get_current_context(silent=True)
    if context is None:
        return text
    options = {option for one in context.command.params for option in one.opts}

    def said(found: re.Match[str]) -> str:
        if found["quoted"]:
            return found[0]
        if found["clocks"]:
            of_which = "" if "--torque-time" in options else " of tvident identify"
            return f"--torque-time{of_which} with the channel of --time"
        if found["reaction"]:
            return "give --torque-scale -1" if "--torque-scale" in options else found[0]
        return _option(found, options)

    return _CURE.sub(said, text)


def units_assumed(units: Mapping[str, str]) -> str:
    """Return what to say of channels whose units nobody said.

    Parameters
    ----------
    units : mapping of str to str
        What they were taken for: those of ``angle``, ``torque`` and ``time``.
    """
    cures = [f"--{name}-unit" for name in units]
    return f"Units: none said of {listed([*units])}, taken as {listed([*units.values()])}; if they are others, give {listed(cures)}"


def _option(found: re.Match[str], options: set[str]) -> str:
    """Return the option that stands for an argument; the argument where there is none."""
    name = _OTHER_NAMES.get(found["name"], f"--{found['name'].replace('_', '-')}")
    if name not in options:
        return found[0]
    if found["value"] is None:
        return name
    values = _values(found["value"])
    return found[0] if values is None else " ".join(f"{name} {shlex.quote(one)}" for one in values)


def _values(text: str) -> list[str] | None:
    """Return what the options say for the value of an argument; None where they cannot say it."""
    try:
        value = ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return [text] if text.isidentifier() else None
    if not isinstance(value, list):
        return [str(value)]
    each = [":".join(map(str, one)) if isinstance(one, tuple) else str(one) for one in value]
    return each or ["none"]
