"""What is used where nothing is given, and how an earlier choice is used again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, TypeAlias, get_args

from tvident import _arguments as arguments
from tvident._derivatives import Criterion

Preset: TypeAlias = Literal["auto", "paper"]

Form: TypeAlias = Literal["auto", "weak", "strong"]

Variation: TypeAlias = Literal["constant", "linear"]

Selection: TypeAlias = Literal["auto", "window", "pooled", "average"]

PRESETS: dict[str, dict[str, Any]] = {
    "paper": {
        "form": "strong",
        "window_length": 201,
        "exponent": 8,
        "max_order": 15,
        "criterion": "aicc",
        "selection": "window",
        "equations": 200,
        "variation": "constant",
        "filter_torque": False,
        "lag": 0.0,
        "quantisation": 0.0,
        "inertia": "windowed",
        "damping": "windowed",
        "stiffness": "windowed",
        "terms": (),
    },
    "auto": {
        "form": "auto",
        "window_length": "auto",
        "exponent": "auto",
        "max_order": 15,
        "criterion": "aicc",
        "selection": "auto",
        "equations": "auto",
        "variation": "linear",
        "filter_torque": False,
        "lag": 0.0,
        "quantisation": None,
        "inertia": "auto",
        "damping": "auto",
        "stiffness": "windowed",
        "terms": (("offset", "constant"),),
    },
}
"""Every setting by preset."""

_COEFFICIENTS = ("inertia", "damping", "stiffness")

_OF_ONE_FORM = {"exponent": "weak", "max_order": "strong", "criterion": "strong", "filter_torque": "strong"}
"""Settings that only one of the forms has."""

_OF_BOTH = {"filter_torque": False}
"""Values of these that are true of both forms: the weak form never filters the torque."""


def resolve(preset: str, given: Mapping[str, Any], earlier: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return all settings: what is given wins over an earlier result's settings, those over the preset's.

    Raises
    ------
    ValueError
        If a word is unknown, a setting belongs to the other form, or "auto" stands where nothing chooses.
    TypeError
        If a setting is of the wrong type, or `earlier` is not of a result.
    """
    given = {name: value for name, value in given.items() if value is not None}
    earlier = {} if earlier is None else _of_result(earlier, given)
    preset = earlier.pop("preset", preset)
    arguments.one_of("preset", preset, get_args(Preset))
    settings = PRESETS[preset] | earlier | given
    settings["preset"] = preset
    if given.get("equations", "auto") != "auto" and "selection" not in given:
        # Whoever gives a length means windows of that length.
        settings["selection"] = "window" if settings["form"] != "strong" else settings["selection"]
    choices = {"form": Form, "selection": Selection, "variation": Variation, "criterion": Criterion}
    for name, literal in choices.items():
        arguments.one_of(name, settings[name], get_args(literal))
    settings["lag"] = _lag(settings)
    if not isinstance(settings["filter_torque"], bool):
        raise TypeError(f"filter_torque must be True or False; got {settings['filter_torque']!r}; pass one of them")
    settings["form_chosen"] = settings["form"] == "auto"
    settings["form"] = "strong" if settings["form"] == "strong" else "weak"
    if settings["form"] == "weak" and not {"quantisation"} & (given.keys() | earlier.keys()):
        settings["quantisation"] = None
    _check_form(settings, given)
    if settings["form"] == "strong":
        _settle_strong(settings, given)
    elif settings["selection"] == "auto":
        settings["selection"] = "average"
    elif settings["selection"] == "pooled":
        raise ValueError(
            "selection must be 'window' or 'average' in weak form, which fits no polynomials whose order could be pooled; "
            "got 'pooled'; use one of these, or form='strong'"
        )
    return settings


def _lag(settings: Mapping[str, Any]) -> float | str | tuple[float, ...]:
    """Check the lag of the torque: a number, one for every record, or "auto"."""
    lag = settings["lag"]
    if lag == "auto":
        if settings["form"] == "strong":
            raise ValueError(
                "lag='auto' needs the weak form; got form='strong'; use form='weak', or give the lag that it finds, settings['lag']"
            )
        return "auto"
    if isinstance(lag, tuple | list) and settings["form"] != "strong":
        return tuple(arguments.finite_number("lag", one) for one in lag)
    return arguments.finite_number("lag", lag)


def _check_form(settings: Mapping[str, Any], given: Mapping[str, Any]) -> None:
    """Refuse what would change nothing: a setting of the other form.

    Where the form itself was not given, whatever the preset says anyway may be said again.
    """
    said_again = PRESETS[settings["preset"]] if given.get("form", "auto") == "auto" else {}
    for name, form in _OF_ONE_FORM.items():
        harmless = [values[name] for values in (_OF_BOTH, said_again) if name in values]
        if name in given and settings["form"] != form and given[name] not in harmless:
            raise ValueError(
                f"{name} belongs to the {form} form; got {given[name]!r} with form={settings['form']!r}; "
                f"leave it out, or give form={form!r}"
            )


def _settle_strong(settings: dict[str, Any], given: Mapping[str, Any]) -> None:
    """Put the paper's numbers where nothing chooses."""
    for name in ("window_length", "equations"):
        if given.get(name) == "auto":
            paper = PRESETS["paper"][name]
            raise ValueError(
                f"{name} must be a number of samples or a duration in strong form, where nothing chooses it; got 'auto'; "
                f"give a length ({paper} in the paper), or form='weak'"
            )
        if settings[name] == "auto":
            settings[name] = PRESETS["paper"][name]
    if settings["selection"] == "auto":
        settings["selection"] = "pooled"


def _of_result(earlier: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments that an earlier result's settings stand for."""
    try:
        kinds = dict(earlier["kinds"])
        settings = {name: earlier[name] for name in (*PRESETS["paper"], "preset") if earlier.get(name) is not None}
        known = dict(earlier["known"])
    except (KeyError, TypeError):
        raise TypeError(f"settings must be those of an earlier result; got {earlier!r}; pass result.settings") from None
    for name in _COEFFICIENTS:
        settings[name] = known[name] if kinds[name] == "known" else kinds[name]
        if settings[name] is None and name not in given:
            raise ValueError(
                f"settings hold no {name}, since it was known at every sample; got None; pass {name}= again"
            )
    settings["terms"] = tuple(tuple(term) for term in settings["terms"])
    if settings["selection"] == "average" and "equations" in earlier.get("chosen", ()):
        # Where windows of all lengths are averaged, which of them predicts best is a matter of the record, as their weights are.
        settings["equations"] = "auto"
    return settings
