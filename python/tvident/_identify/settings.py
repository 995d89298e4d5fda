"""Settings of one call: arguments override the settings of an earlier result, which override the defaults of the method."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tvident import _arguments as arguments
from tvident._equation import BUILT_IN, COEFFICIENTS, OFFSET, Kind, Term, has_kind
from tvident._identify.earlier import (
    angle_zero,
    arguments_of_result,
    form_of_result,
    kept,
    of_each,
    tested,
    with_earlier_kinds,
)
from tvident._identify.methods import Form, Method, StrongForm, WeakForm

_OF_METHOD: dict[str, dict[str, Any]] = {
    "paper": {
        "inertia": "windowed",
        "damping": "windowed",
        "stiffness": "windowed",
        "terms": (),
        "lag": 0.0,
        "quantisation": 0.0,
        "period": None,
    },
    "auto": {
        "inertia": "auto",
        "damping": "auto",
        "stiffness": "windowed",
        "terms": (OFFSET,),
        "lag": 0.0,
        "quantisation": None,
        "period": None,
    },
}
"""What is used beside the form where nothing is given; forms of the user's own take the same as "auto"."""


@dataclass(frozen=True)
class Request:
    """What is asked for, settled: every word is known, every number checked.

    Parameters
    ----------
    name : str
        "auto", "paper", "weak" or "strong".
    form : WeakForm or StrongForm
    by_record : mapping of str to sequence
        What an earlier result chose for every record of a batch on its own; wins over the form's value.
    parameters : mapping of str to object
        How inertia, damping and stiffness come about, as given.
    terms : sequence
        Terms, or pairs of a term and its kind.
    lag : float, "auto" or a sequence of float
        Seconds.
    lag_samples : sequence of float, optional
        The same in samples, where an earlier result found it: seconds may round to other samples.
    angle_zero : sequence of float, optional
        The angle at which the spring of every record is relaxed, where an earlier result found it.
    shown_noise : sequence of float, optional
        Variances of the torque's noise that the equations of an earlier result showed.
    quantisation : float, optional
    period : float, optional
        Of a wrapped angle.
    inner : mapping of str to float or sequence
        Inner parameters of terms that an earlier result found.
    needed : mapping of str to bool or sequence
        Whether the terms were needed there.
    chosen : bool
        Nobody asked for this form.
    kept : sequence of str
        What an earlier result chose, and this one takes from it.
    tested : sequence of str
        Coefficients whose kinds it decided upon.
    width_from : sequence of str or None
        Where it took the test function of every record from.
    windows_near : sequence of int or None
        The windows near which it compared lengths.
    lag_stderr : float or sequence of float, optional
        Of a lag that an earlier result found, in seconds.
    lag_untold : sequence of float
        Samples of it that were not told, as the search for it did not settle; none where it did.
    """

    name: str
    form: Form
    by_record: Mapping[str, Sequence[Any]]
    parameters: Mapping[str, Any]
    terms: Sequence[Any]
    lag: Any
    lag_samples: Sequence[float] | None
    angle_zero: Sequence[float] | None
    shown_noise: Sequence[float] | None
    quantisation: float | None
    period: float | None
    inner: Mapping[str, Any]
    needed: Mapping[str, Any]
    chosen: bool
    kept: Sequence[str] = ()
    tested: Sequence[str] = ()
    width_from: Sequence[str | None] = ()
    windows_near: Sequence[int | None] = ()
    lag_stderr: Any = None
    lag_untold: Sequence[float] = ()

    @property
    def has_spring(self) -> bool:
        """Whether a stiffness is unknown, or known and not zero."""
        return _has_spring(self.parameters)

    @property
    def counts_turns(self) -> bool:
        """Whether the equation is another one after a whole period of the angle."""
        names = [term[0] if isinstance(term, tuple | list) else term for term in self.terms]
        built_in = [BUILT_IN.get(name) if isinstance(name, str) else None for name in names]
        return self.has_spring or not all(one and one.repeats_after(self.period or 0.0) for one in built_in)

    def is_kept(self, name: str) -> bool:
        """Whether an earlier result chose this, and its choice stands."""
        is_open = name != "lag" and name not in self.by_record and getattr(self.form, name) == "auto"
        return name in self.kept and not is_open

    def kinds_of_terms(self, kinds: Iterable[Kind], *, has_instrument: bool) -> tuple[Kind, Kind]:
        """Return the kind of terms beside unknowns of these kinds where none is given, and that of an offset."""
        if has_instrument:
            return "constant", "constant"
        if all(kind == "windowed" for kind in kinds):
            return "windowed", "windowed"
        # The weak form finds whether an offset is constant.
        return "constant", "constant" if isinstance(self.form, StrongForm) else "auto"

    def asked(self, kinds: Mapping[str, Any]) -> dict[str, Any]:
        """Return the kinds as they were asked for, where an earlier result decided."""
        return {name: "auto" if name in self.tested else kind for name, kind in kinds.items()}

    def noise_of_equations(self, records: int) -> Sequence[float] | None:
        """Return the variances that an earlier result of as many records showed."""
        shown = self.shown_noise
        return shown if shown is not None and len(shown) == records else None

    def each(self, name: str, records: int) -> Sequence[Any]:
        """Return a setting of every record: the same for all, or what an earlier result chose for each."""
        value = self.by_record.get(name)
        if value is None:
            return [self.lag if name == "lag" else getattr(self.form, name)] * records
        if len(value) != records:
            cure = "one a record" if name == "lag" else "settings of a result with as many records"
            raise ValueError(
                f"{name} must be one number, or one for each of the {records} records; got {len(value)}; give {cure}"
            )
        return value


def resolve(
    method: Method,
    given: Mapping[str, Any],
    earlier: Mapping[str, Any] | None,
    sample_rate: float,
    channels: Sequence[str] = ("angle",),
    *,
    has_instrument: bool = False,
) -> Request:
    """Return what is asked for.

    Raises
    ------
    ValueError
        If a word is unknown, or "auto" stands where nothing chooses.
    TypeError
        If something is of the wrong type, or `earlier` is not of a result.
    """
    name, form = _method(method)
    given = {key: value for key, value in given.items() if value is not None}
    by_record: dict[str, Sequence[Any]] = {}
    before: dict[str, Any] = {}
    if earlier is not None:
        before = arguments_of_result(earlier, given)
        if "terms" in given:
            given["terms"] = with_earlier_kinds(given["terms"], earlier)
        if arguments.is_word(method, "auto"):
            name, form, by_record = form_of_result(earlier)
    asked = _OF_METHOD["paper" if name == "paper" else "auto"] | before | given
    if earlier is not None and earlier.get("instrument") and not has_instrument:
        raise ValueError("settings of a result with an instrument need it again; got none; pass instrument=")
    asked = _as_far_as_measured(asked, {**before, **given}, channels, has_instrument=has_instrument)
    for parameter in COEFFICIENTS if isinstance(form, StrongForm) else ():
        if arguments.is_word(given.get(parameter), "varying"):
            raise ValueError(
                f"{parameter}='varying' needs the weak form; got the strong form; use tvident.WeakForm, or {parameter}='windowed'"
            )
    lag = _lag(asked["lag"], form)
    if isinstance(lag, list):
        by_record["lag"] = lag
    has_form = not arguments.is_word(method, "auto")
    same_lag = earlier is not None and "lag" not in given and earlier.get("sample_rate") == sample_rate
    return Request(
        name=name,
        form=form,
        by_record=by_record,
        parameters={one: asked[one] for one in COEFFICIENTS},
        terms=asked["terms"],
        lag=lag,
        shown_noise=earlier.get("shown_noise") if earlier is not None and isinstance(form, WeakForm) else None,
        lag_samples=earlier.get("lag_samples") if same_lag and earlier is not None else None,
        angle_zero=angle_zero(earlier) if earlier is not None and isinstance(form, WeakForm) else None,
        quantisation=asked["quantisation"],
        period=None if asked["period"] is None else arguments.positive_number("period", asked["period"]),
        inner={} if earlier is None else dict(earlier.get("inner") or {}),
        needed={} if earlier is None else dict(earlier.get("needed") or {}),
        chosen=earlier is None and name == "auto",
        kept=() if earlier is None else kept(earlier, given, has_form=has_form),
        tested=() if earlier is None else tested(earlier, given),
        width_from=of_each(earlier, "width_from") if earlier is not None and not has_form else (),
        windows_near=of_each(earlier, "windows_near") if earlier is not None and not has_form else (),
        lag_stderr=None if earlier is None or "lag" in given else earlier.get("lag_stderr"),
        lag_untold=earlier.get("lag_untold") or () if same_lag and earlier is not None else (),
    )


def _lag(lag: Any, form: Form) -> Any:
    """Return a lag in seconds, one a record, or "auto"."""
    is_weak = isinstance(form, WeakForm)
    lag = lag.tolist() if isinstance(lag, np.ndarray) else lag
    if isinstance(lag, tuple | list) and is_weak:
        if any(arguments.is_word(one, "auto") for one in lag):
            raise ValueError(
                f"lag must be 'auto' for all records of one length, or for none; got {arguments.shown(lag)}; give 'auto', or a time "
                "a record"
            )
        return [arguments.delay("lag", one) for one in lag]
    if not arguments.is_word(lag, "auto"):
        return arguments.delay("lag", lag, word="auto" if is_weak else None)
    if not is_weak:
        raise ValueError(
            "lag='auto' needs the weak form; got the strong form; use WeakForm, or give the lag that it finds, settings['lag']"
        )
    return lag


def _as_far_as_measured(
    asked: dict[str, Any], given: Mapping[str, Any], channels: Sequence[str], *, has_instrument: bool
) -> dict[str, Any]:
    """Return what is asked for of these channels."""
    if has_instrument:
        if list(channels) != ["angle"]:
            raise ValueError(
                f"an instrument needs the angle alone; got {' and '.join(channels)}; leave the instrument or the other channels out"
            )
        return _with_instrument(asked, given)
    return asked if "angle" in channels else _without_angle(asked, given)


def _without_angle(asked: dict[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is asked for where the angle is integrated: beside a spring its zero and its drift are an offset that changes."""
    if asked["period"] is not None:
        raise ValueError(
            f"a period is for an angle; got period={asked['period']} and angle=None; leave one of them out"
        )
    terms = [term if isinstance(term, tuple | list) else (term, None) for term in asked["terms"]]
    for term, _ in terms:
        if isinstance(term, Term) or (isinstance(term, str) and term in BUILT_IN and BUILT_IN[term].is_of_angle):
            raise ValueError(
                f"terms of the angle need the angle; got term {getattr(term, 'name', term)!r} and angle=None; give the angle, or leave the "
                "term out"
            )
    if not _has_spring(asked):
        return asked
    if "terms" not in given:
        return {**asked, "terms": ((OFFSET, "windowed"),)}
    return {
        **asked,
        "terms": [
            (OFFSET, "windowed") if pair == (OFFSET, None) else term
            for term, pair in zip(asked["terms"], terms, strict=True)
        ],
    }


def _has_spring(parameters: Mapping[str, Any]) -> bool:
    """Return whether a stiffness is unknown, or known and not zero."""
    stiffness = parameters["stiffness"]
    return not (isinstance(stiffness, int | float) and stiffness == 0)


def _with_instrument(asked: dict[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is asked for with an instrument, which tells constants only: what was not given is one."""
    asked = dict(asked)
    for name in COEFFICIENTS:
        kind = asked[name]
        if name not in given or arguments.is_word(kind, "auto"):
            asked[name] = "constant"
        elif arguments.is_word(kind, "windowed") or arguments.is_word(kind, "varying"):
            raise ValueError(
                f"with an instrument unknowns must be constant; got {name}={kind!r}; give {name}='constant', or "
                "split the record where it changes"
            )
    if arguments.is_word(asked["lag"], "auto"):
        raise ValueError("with an instrument the lag must be known; got 'auto'; give lag= in seconds")
    terms = asked["terms"]
    for term in () if isinstance(terms, str | Term) else terms:
        own, kind = term if has_kind(term) else (term, "constant")
        if isinstance(own, Term):
            raise ValueError(  # noqa: TRY004 - a term, but not one that will do
                f"with an instrument terms must be built-in; got {own.name!r}, whose samples hold the angle's noise; use 'coulomb', "
                "'cubic' or 'gravity', or leave the instrument out"
            )
        if isinstance(own, str) and own in BUILT_IN and BUILT_IN[own].inner:
            raise ValueError(
                f"with an instrument terms must be linear in what is unknown; got {own!r}, which holds an inner parameter; use 'coulomb', "
                "or leave the instrument out"
            )
        if kind != "constant":
            raise ValueError(f"with an instrument unknowns must be constant; got term {own!r} {kind}; make it constant")
    return asked


def is_strong(method: Method, earlier: Mapping[str, Any] | None) -> bool:
    """Return whether the strong form is asked for, by a method or by the settings of an earlier result."""
    if arguments.is_word(method, "auto") and isinstance(earlier, Mapping):
        return earlier.get("form") == "strong"
    return isinstance(_method(method)[1], StrongForm)


def _method(method: Method) -> tuple[str, Form]:
    """Return the name of a method and its form."""
    if isinstance(method, WeakForm):
        return "weak", method
    if isinstance(method, StrongForm):
        return "strong", method
    if isinstance(method, type) and method in {WeakForm, StrongForm}:
        raise TypeError(f"method must be an object; got the class {method.__name__}; write {method.__name__}()")
    if arguments.is_word(method, "auto"):
        return "auto", WeakForm()
    if arguments.is_word(method, "paper"):
        return "paper", StrongForm()
    raise ValueError(
        f"method must be 'auto', 'paper', a WeakForm or a StrongForm; got {arguments.shown(method)}; use one of these"
    )


def plain(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings as JSON has them: lists, numbers, words."""
    return dict(json.loads(json.dumps(settings)))
