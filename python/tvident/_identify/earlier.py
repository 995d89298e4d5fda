"""What the settings of an earlier result say: whether they are of one, the form, and the arguments that they stand for."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Any

from tvident import _arguments as arguments
from tvident._clocks import SETTINGS_OF_TIMES
from tvident._equation import COEFFICIENTS, OFFSET, Term, has_kind
from tvident._identify.methods import Form, StrongForm, WeakForm

_FORMS: dict[str, type[Form]] = {"weak": WeakForm, "strong": StrongForm}

_BESIDE_FORM = frozenset(
    (
        *(
            "method",
            "form",
            "chosen",
            "tested",
            "kinds",
            "known",
            "terms",
            "own_terms",
            "inner",
            "needed",
            "expansions",
        ),
        *(
            "width_from",
            "windows_near",
            "lag",
            "lag_stderr",
            "lag_samples",
            "lag_untold",
            "angle_zero",
            "shown_noise",
            "stderr_factors",
            "quantisation",
            "loss",
            "period",
        ),
        *(
            "instrument",
            "weights",
            "sample_rate",
            "step",
            "torque_readings",
        ),
        *SETTINGS_OF_TIMES,
    )
)
"""What settings of results hold beside those of their form."""


_ALWAYS = ("kinds", "known", "terms", "lag", "quantisation", "chosen", "method")
"""What settings of every result hold beside those of its form."""

_COUNTABLE = 1 << 53
"""More samples than any record has."""


def kept(earlier: Mapping[str, Any], given: Mapping[str, Any], *, has_form: bool) -> Sequence[str]:
    """Return what an earlier result chose that neither an argument nor a form replaces."""
    return [name for name in earlier["chosen"] if (name not in given if name == "lag" else not has_form)]


def tested(earlier: Mapping[str, Any], given: Mapping[str, Any]) -> Sequence[str]:
    """Return the coefficients, and the offset, that an earlier result decided upon and no argument gives."""
    kinds = dict(earlier["terms"])
    # Terms that are given have the kinds that they had unless others are given with them.
    pairs = [one for one in given.get("terms", ()) if has_kind(one)]
    terms = {name: kind for name, kind in pairs if isinstance(name, str)} if "terms" in given else kinds
    stand = {name for name, kind in kinds.items() if name == OFFSET and terms.get(name) == kind}
    return [
        name for name in earlier.get("tested") or () if name in stand or (name in COEFFICIENTS and name not in given)
    ]


def of_each(earlier: Mapping[str, Any], name: str) -> Sequence[Any]:
    """Return what an earlier result says of every record."""
    found = earlier.get(name)
    return found if isinstance(found, list | tuple) else [found]


def angle_zero(earlier: Mapping[str, Any]) -> Sequence[float] | None:
    """Return the angle at which the spring of every record was relaxed."""
    found = earlier.get("angle_zero")
    return [found] if isinstance(found, int | float) else found


def form_of_result(earlier: Mapping[str, Any]) -> tuple[str, Form, dict[str, Sequence[Any]]]:
    """Return the method of an earlier result, and what it chose for every record of a batch."""
    kind: Any = _FORMS[earlier["form"]]
    values = {one.name: earlier[one.name] for one in fields(kind)}
    if values.get("averaging") and "regression_window" in earlier["chosen"]:
        # Where windows of all lengths are averaged, which of them predicts best is a matter of the record, as their weights are.
        values["regression_window"] = "auto"
    by_record: dict[str, Sequence[Any]] = {
        key: value for key, value in values.items() if isinstance(value, list | tuple)
    }
    return str(earlier["method"]), kind(**(values | dict.fromkeys(by_record, "auto"))), by_record


def arguments_of_result(earlier: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments beside the form that an earlier result's settings stand for."""
    spoiled = _spoiled(earlier) if isinstance(earlier, Mapping) else "form"
    if spoiled and isinstance(earlier, Mapping) and "masses" in earlier:
        raise TypeError(
            "settings must be those of one record; got those of trials or masses that were merged; give ensemble_axis= or dof_axis= as "
            "there, or leave settings out"
        )
    if spoiled and (not isinstance(earlier, Mapping) or not earlier.keys() & {"form", *_ALWAYS}):
        raise TypeError(
            f"settings must be those of an earlier result; got {arguments.shown(earlier)}; pass result.settings"
        )
    if spoiled:
        got = f"{arguments.shown(earlier[spoiled])} as {spoiled!r}" if spoiled in earlier else f"no {spoiled!r}"
        raise TypeError(f"settings must be those of an earlier result; got {got}; pass result.settings as they are")
    kinds, known = dict(earlier["kinds"]), dict(earlier["known"])
    terms = [(str(name), str(kind)) for name, kind in earlier["terms"]]
    asked = {name: earlier[name] for name in ("lag", "quantisation")}
    asked["period"] = earlier.get("period")
    _check_names(earlier, kinds, known)
    for name in COEFFICIENTS:
        asked[name] = known[name] if kinds[name] == "known" else kinds[name]
        if asked[name] == "expanded" and name not in given:
            raise ValueError(
                f"settings hold no channel, and {name} is an expansion; got none; pass {name}=Expansion(…) again"
            )
        if asked[name] is None and name not in given:
            raise ValueError(
                f"settings hold no {name}, since it was known at every sample; got None; pass {name}= again"
            )
    if "terms" not in given:
        check_no_own_terms(earlier.get("own_terms"), [name for name, _ in terms])
    return asked | {"terms": terms}


def check_no_own_terms(own: Sequence[str] | None, names: Sequence[str]) -> None:
    """Refuse settings with terms of the user's own where no terms are given."""
    if own:
        raise ValueError(
            f"settings hold no functions, and term {own[0]!r} is one of the user's own; got no terms; pass terms= again, "
            f"with all of {', '.join(names)}"
        )


def _check_names(earlier: Mapping[str, Any], kinds: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    """Refuse names that no result has: what is misspelled would be ignored.

    Raises
    ------
    TypeError
        With the name that comes nearest.
    """
    of_form = {form: {one.name for one in fields(kind)} for form, kind in _FORMS.items()}
    names = _BESIDE_FORM | of_form[earlier["form"]]
    unknowns = {*COEFFICIENTS, *(name for name, _ in earlier["terms"]), *(earlier.get("inner") or {})}
    for within, has, may in (("", earlier, names), (" kinds", kinds, unknowns), (" known", known, unknowns)):
        foreign = [name for name in has if name not in may]
        if not foreign:
            continue
        other = next((form for form in of_form if foreign[0] in of_form[form]), None)
        cure = (
            f"it belongs to the {other} form"
            if other and not within
            else arguments.nearest(foreign[0], may) or "leave it out"
        )
        raise TypeError(
            f"settings{within} must hold names that a result of the {earlier['form']} form has; got {arguments.shown(foreign[0])}; {cure}"
        )


def _spoiled(earlier: Mapping[str, Any]) -> str:
    """Return the first entry that is missing or not as results have it, "" where all are: files of settings may be edited, or others."""
    lists, numbers = ("own_terms", "tested"), ("lag_samples", "lag_untold", "shown_noise")
    name = earlier.get("form")
    if not isinstance(name, str) or name not in _FORMS:
        return "form"
    form: Any = _FORMS[name]
    missing = [name for name in (*_ALWAYS, *(one.name for one in fields(form))) if name not in earlier]
    if missing:
        return missing[0]
    checks: dict[str, Callable[[], bool]] = {
        "kinds": lambda: all(isinstance(earlier["kinds"][name], str) for name in COEFFICIENTS),
        "known": lambda: (
            all(earlier["kinds"][name] != "known" or name in dict(earlier["known"]) for name in COEFFICIENTS)
            and isinstance(earlier["known"], Mapping)
        ),
        "terms": lambda: all(isinstance(name, str) and isinstance(kind, str) for name, kind in earlier["terms"]),
        "method": lambda: isinstance(earlier["method"], str),
        "chosen": lambda: _is_of(str, earlier["chosen"]),
        **{name: lambda name=name: _is_of(str, earlier.get(name) or []) for name in lists},  # type: ignore[misc]
        **{name: lambda name=name: all(map(_is_finite, _list(earlier.get(name)))) for name in numbers},  # type: ignore[misc]
        "width_from": lambda: all(one is None or isinstance(one, str) for one in of_each(earlier, "width_from")),
        "windows_near": lambda: all(one is None or _is_count(one) for one in of_each(earlier, "windows_near")),
        "needed": lambda: _is_of(bool | list | tuple, list(dict(earlier.get("needed") or {}).values())),
        "angle_zero": lambda: all(_is_finite(one) for one in angle_zero(earlier) or ()),
        "inner": lambda: all(
            all(map(_is_finite, one)) if isinstance(one, list | tuple) else _is_finite(one)
            for one in dict(earlier.get("inner") or {}).values()
        ),
    }
    return next((name for name, is_right in checks.items() if not _holds(is_right)), "")


def _holds(is_right: Callable[[], bool]) -> bool:
    """Return whether a check holds; what cannot even be looked at does not."""
    try:
        return is_right()
    except (KeyError, TypeError, ValueError):
        return False


def _is_of(kind: Any, values: object) -> bool:
    return isinstance(values, list | tuple) and all(isinstance(one, kind) for one in values)


def _list(values: object) -> Sequence[Any]:
    """Return a list, or nothing for None.

    Raises
    ------
    TypeError
        If it is another thing.
    """
    if not isinstance(values, list | tuple | None):
        raise TypeError
    return values or ()


def _is_finite(number: object) -> bool:
    return isinstance(number, int | float) and math.isfinite(number)


def _is_count(number: object) -> bool:
    return isinstance(number, int) and 0 <= number < _COUNTABLE


def with_earlier_kinds(terms: Sequence[Any], earlier: Mapping[str, Any]) -> Sequence[Any]:
    """Return terms that are given again, those without a kind with that of the earlier result."""
    if isinstance(terms, str | Term):
        return terms  # refused where terms are read
    kinds = dict(earlier["terms"])

    def with_kind(term: Any) -> Any:
        name = term.name if isinstance(term, Term) else term
        return (term, kinds[name]) if isinstance(name, str) and name in kinds else term

    return [with_kind(term) for term in terms]
