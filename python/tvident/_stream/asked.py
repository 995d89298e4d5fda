"""What is asked of a stream, checked: whatever needs the whole record is refused, with what to do instead."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _core
from tvident._derivatives import SHORTEST_WINDOW, plan
from tvident._equation import COEFFICIENTS, all_terms, parameter
from tvident._identify import Request, StrongForm, WeakForm, requested
from tvident._pieces import Given
from tvident._stream.weak import WeakStream

_CURE: Final = "give settings= of an earlier result"


class StreamWork(Protocol):
    """What a stream is beneath its names."""

    @property
    def delay(self) -> int:
        """Samples from one to its parameters."""

    @property
    def samples(self) -> int:
        """Samples that have come so far."""

    def push(
        self,
        angle: npt.NDArray[np.number],
        torque: npt.NDArray[np.number],
        weights: npt.NDArray[np.float64] | None = None,
    ) -> Any:
        """Take the next samples, with weights if the stream has them, and return the parameters that are due."""

    def finish(self) -> Any:
        """Return the parameters of all samples that are left."""

    def state(self) -> Any:
        """Return what going on needs."""

    def hold(self, hold: bool) -> None:  # noqa: FBT001 - as the core has it
        """Leave constants as they are, or not."""

    def reset(self) -> None:
        """Forget what constants are known from."""


@dataclass(frozen=True)
class Equation:
    """What is known and what is not.

    Parameters
    ----------
    kinds : set of str
        Of what is unknown.
    known : list of (float or None)
        Inertia, damping and stiffness where they are known.
    terms : list of str
    """

    kinds: set[str]
    known: list[float | None]
    terms: list[str]

    @cached_property
    def names(self) -> list[str]:
        """Unknowns in the order of the core."""
        return [name for name, value in zip(COEFFICIENTS, self.known, strict=True) if value is None] + self.terms

    @cached_property
    def held(self) -> list[tuple[str, float]]:
        """Names and values of what is known."""
        return [(name, value) for name, value in zip(COEFFICIENTS, self.known, strict=True) if value is not None]


class Asked(Protocol):
    """A stream's equation and settings."""

    @property
    def equation(self) -> Equation:
        """What is known and what is not."""

    def begun(self, step: int, state: Any, *, weighted: bool = False) -> StreamWork:
        """Return the work that begins, or goes on from a state."""


@dataclass(frozen=True)
class InStrongForm:
    """Windows of the strong form, or constants by recursive least squares.

    Parameters
    ----------
    equation : Equation
    plan : mapping
        What the plan of the polynomials is made of.
    regression_window : int or None
        Samples; None for constants.
    factors : list of float, optional
        What standard errors of least squares are multiplied by, where an earlier result says.
    forgetting : float
    nan_policy : str
        With "omit" missing samples are left out of windows, which otherwise have no number; so are samples without weight but with
        "propagate".
    """

    equation: Equation
    plan: dict[str, Any]
    regression_window: int | None
    factors: list[float] | None
    forgetting: float
    nan_policy: arguments.RowPolicy

    def begun(self, step: int, state: Any, *, weighted: bool = False) -> StreamWork:
        """Return the work that begins, or goes on from a state."""
        return _core.ParameterStream(
            plan(**self.plan),
            self.regression_window,
            self.equation.known,
            self.equation.terms,
            step=step,
            factors=self.factors,
            forgetting=self.forgetting,
            leaves_out=self.nan_policy == "omit" or (weighted and self.nan_policy != "propagate"),
            weighted=weighted,
            state=state,
        )


@dataclass(frozen=True)
class InWeakForm:
    """Blocks of the weak form.

    Parameters
    ----------
    equation : Equation
    given : Given
    half_life : float
        Samples.
    """

    equation: Equation
    given: Given
    half_life: float

    def begun(self, step: int, state: Any, *, weighted: bool = False) -> StreamWork:
        """Return the work that begins, or goes on from a state."""
        given = replace(self.given, weighted=weighted)
        return WeakStream(given, self.equation.names, step, self.half_life, state)


def asked_of(
    given: Given,
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
    request, period = requested(given.method, given.equation, given.settings, 1 / given.period), given.period
    is_weak = isinstance(request.form, WeakForm)
    if is_weak and given.frozen is None:
        got = f"method={given.method!r}" if isinstance(given.method, str) else "a WeakForm"
        raise ValueError(
            f"the weak form chooses from the whole record; got {got} in a stream without settings to go by; {_CURE}, with method='auto', "
            "or a method of the strong form: 'paper' or a StrongForm"
        )
    if (given.settings or {}).get("torque_readings") is True:
        raise ValueError(
            "a stream takes samples as they come; got settings of a recording whose torque holds its readings, with splines between them; "
            "push a torque that is sampled as the angle is, or push both channels once a reading, with settings of such a recording"
        )
    _check_request(request)
    equation = _equation(request)
    if half_life is not None and "constant" not in equation.kinds:
        raise ValueError(
            f"half_life is for constants; got {arguments.shown(half_life)} with windowed parameters, which forget by themselves; "
            "leave it out, or make all unknowns constant"
        )
    half = math.inf if half_life is None else _samples(half_life, period)
    return InWeakForm(equation, given, half) if is_weak else _in_strong_form(request, equation, given, half)


def _in_strong_form(request: Request, equation: Equation, given: Given, half_life: float) -> InStrongForm:
    """Return what is asked for in strong form."""
    form, period = request.form, given.period
    assert isinstance(form, StrongForm)  # noqa: S101 - there are two forms
    length = arguments.window_length("window_length", form.window_length, period, odd=True)
    if length < SHORTEST_WINDOW:
        raise ValueError(
            f"window_length must be at least {SHORTEST_WINDOW} samples; got {length}; use {SHORTEST_WINDOW} or more"
        )
    rows = arguments.window_length("regression_window", form.regression_window, period, odd=False)
    settings = {
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
    constant = equation.kinds == {"constant"}
    factors = dict((given.settings or {}).get("stderr_factors") or {})
    names = equation.names
    is_same = all(isinstance(factors.get(name), int | float) for name in names)
    return InStrongForm(
        equation=equation,
        plan=settings,
        regression_window=None if constant else rows,
        factors=[float(factors[name]) for name in names] if is_same and not constant else None,
        forgetting=0.5 ** (1 / half_life),
        nan_policy=given.nan_policy,
    )


def _check_request(request: Request) -> None:
    """Refuse what needs more of the record than windows hold."""
    form = request.form
    refused = {"period": request.period is not None}
    if isinstance(form, StrongForm):
        refused |= {
            "selection='pooled'": form.selection == "pooled",
            "filter_torque=True": form.filter_torque,
            "variation='linear'": form.variation == "linear",
            "lag": request.lag != 0,
            "search=": bool(request.inner),
        }
    else:
        refused |= {"lag='auto'": arguments.is_word(request.lag, "auto")}
    cures = {
        "period": "unwrap the angle as it comes",
        "lag": "push the torque so many samples later",
        "lag='auto'": "give the lag that an earlier recording shows",
    }
    for name, is_asked in refused.items():
        if is_asked:
            raise ValueError(
                f"a stream holds no more than its windows need; got {name}, which needs more; {cures.get(name, 'leave it out')}"
            )


def _equation(request: Request) -> Equation:
    """Return the kinds of unknowns, what is known, and the names of terms."""
    is_strong = isinstance(request.form, StrongForm)
    found = {name: parameter(name, value, ()) for name, value in request.parameters.items()}
    kinds: set[str] = {value for value in found.values() if isinstance(value, str)}
    asked = all_terms(request.terms, "windowed" if is_strong and kinds == {"windowed"} else "constant")
    for term in asked:
        if term.own is not None or (term.inner and (is_strong or term.name not in request.needed)):
            raise ValueError(
                f"terms of a stream must be built-in, without inner parameters; got {term.name!r}, which needs the whole record; "
                "use 'offset', 'coulomb', 'cubic', 'preload', 'gravity', 'viscous_asymmetric' or 'quadratic_drag'"
            )
        kinds.add(term.kind)
    if not kinds:
        raise ValueError("at least one parameter must be unknown; all are given; use 'windowed' or 'constant' for one")
    if is_strong and (len(kinds) > 1 or not kinds <= {"windowed", "constant"}):
        raise ValueError(
            f"what is unknown in a stream must be all 'windowed' or all 'constant'; got {', '.join(sorted(kinds))}, which needs the whole "
            "record; give what is constant as a number, from constants of an earlier result, or settings= of a result in weak form"
        )
    if "auto" in kinds:
        raise ValueError(
            "what is unknown in a stream must be 'windowed', 'varying' or 'constant'; got auto, which needs the whole record; leave it "
            "out, and settings= says what an earlier recording chose"
        )
    known = [None if isinstance(found[name], str) else float(found[name]) for name in COEFFICIENTS]
    return Equation(kinds, known, [term.name for term in asked])


def _samples(half_life: float | str, period: float) -> float:
    """Return a half-life in samples."""
    if isinstance(half_life, str):
        return arguments.seconds("half_life", half_life) / period
    return arguments.positive_number("half_life", half_life)
