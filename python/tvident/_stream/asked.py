"""What is asked of a stream, checked: whatever needs the whole record is refused, with what to do instead."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from tvident import _arguments as arguments
from tvident._derivatives import SHORTEST_WINDOW
from tvident._equation import COEFFICIENTS, all_terms, parameter
from tvident._identify import Method, Request, StrongForm, resolve

_CURE: Final = "give settings= of an earlier result with a method of the strong form, method='paper' or a StrongForm"


@dataclass(frozen=True)
class Asked:
    """A stream's equation and settings.

    Parameters
    ----------
    plan : mapping
        What the plan of the polynomials is made of.
    regression_window : int or None
        Samples; None for constants.
    known : sequence of (float or None)
        Inertia, damping and stiffness where they are known.
    terms : list of str
    names : list of str
        Unknowns in the order of the core.
    factors : list of float, optional
        What standard errors of least squares are multiplied by, where an earlier result says.
    forgetting : float
    """

    plan: dict[str, Any]
    regression_window: int | None
    known: list[float | None]
    terms: list[str]
    names: list[str]
    factors: list[float] | None
    forgetting: float


def asked_of(
    method: Method,
    given: Mapping[str, Any],
    settings: Mapping[str, Any] | None,
    period: float,
    half_life: float | str | None,
) -> Asked:
    """Return what is asked for.

    Raises
    ------
    ValueError
        If something needs the whole record, or nothing is unknown.
    TypeError
        If something is of the wrong type.
    """
    request = resolve(method, given, settings, 1 / period)
    form = request.form
    if not isinstance(form, StrongForm):
        raise ValueError(  # noqa: TRY004 - a form, but not one that will do
            f"the weak form needs the whole record: its noise, its averages and its constants; got method={arguments.shown(method)} in a "
            f"stream; {_CURE}"
        )
    _check_form(form, request)
    kinds, known, terms = _equation(request)
    constant = kinds == {"constant"}
    if half_life is not None and not constant:
        raise ValueError(
            f"half_life is for constants; got {arguments.shown(half_life)} with windowed parameters, which forget by themselves; "
            "leave it out, or make all unknowns constant"
        )
    names = [name for name, value in zip(COEFFICIENTS, known, strict=True) if value is None] + terms
    length = arguments.window_length("window_length", form.window_length, period, odd=True)
    if length < SHORTEST_WINDOW:
        raise ValueError(
            f"window_length must be at least {SHORTEST_WINDOW} samples; got {length}; use {SHORTEST_WINDOW} or more"
        )
    rows = arguments.window_length("regression_window", form.regression_window, period, odd=False)
    plan = {
        "window_length": length,
        "order": None,
        "max_order": form.max_order,
        "criterion": form.criterion,
        "selection": form.selection,
        "derivatives": (0, 1, 2),
        "delta": period,
        "noise": True,
        "quantisation": request.quantisation or 0.0,
    }
    factors = dict((settings or {}).get("stderr_factors") or {})
    is_same = all(isinstance(factors.get(name), int | float) for name in names)
    return Asked(
        plan=plan,
        regression_window=None if constant else rows,
        known=known,
        terms=terms,
        names=names,
        factors=[float(factors[name]) for name in names] if is_same and not constant else None,
        forgetting=1.0 if half_life is None else 0.5 ** (1 / _samples(half_life, period)),
    )


def _check_form(form: StrongForm, request: Request) -> None:
    """Refuse what needs more of the record than windows hold."""
    refused = {
        "selection='pooled'": form.selection == "pooled",
        "filter_torque=True": form.filter_torque,
        "variation='linear'": form.variation == "linear",
        "period": request.period is not None,
        "lag": request.lag != 0,
        "search=": bool(request.inner),
    }
    cures = {
        "period": "unwrap the angle as it comes",
        "lag": "push the torque so many samples later",
    }
    for name, is_asked in refused.items():
        if is_asked:
            raise ValueError(
                f"a stream holds no more than its windows need; got {name}, which needs more; {cures.get(name, 'leave it out')}"
            )


def _equation(request: Request) -> tuple[set[str], list[float | None], list[str]]:
    """Return the kinds of unknowns, what is known, and the names of terms."""
    found = {name: parameter(name, value, ()) for name, value in request.parameters.items()}
    kinds: set[str] = {value for value in found.values() if isinstance(value, str)}
    asked = all_terms(request.terms, "windowed" if kinds == {"windowed"} else "constant")
    for term in asked:
        if term.own is not None or term.inner:
            raise ValueError(
                f"terms of a stream must be built-in, without inner parameters; got {term.name!r}, which needs the whole record; "
                "use 'offset', 'coulomb', 'cubic', 'gravity' or 'viscous_asymmetric'"
            )
        kinds.add(term.kind)
    if not kinds:
        raise ValueError("at least one parameter must be unknown; all are given; use 'windowed' or 'constant' for one")
    if len(kinds) > 1 or not kinds <= {"windowed", "constant"}:
        raise ValueError(
            f"what is unknown in a stream must be all 'windowed' or all 'constant'; got {', '.join(sorted(kinds))}, which needs the whole "
            "record; give what is constant as a number, from constants of an earlier result"
        )
    known = [None if isinstance(found[name], str) else float(found[name]) for name in COEFFICIENTS]
    return kinds, known, [term.name for term in asked]


def _samples(half_life: float | str, period: float) -> float:
    """Return a half-life in samples."""
    if isinstance(half_life, str):
        return arguments.seconds("half_life", half_life) / period
    return arguments.positive_number("half_life", half_life)
