"""What is used where nothing is given, and how an earlier choice is used again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, TypeAlias, get_args

from tvident import arguments
from tvident.derivatives import Criterion

Preset: TypeAlias = Literal["auto", "paper"]
Form: TypeAlias = Literal["auto", "weak", "strong"]
Variation: TypeAlias = Literal["constant", "linear"]
Averaging: TypeAlias = Literal["auto", "window", "average"]

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
        "inertia": "windowed",
        "damping": "windowed",
        "stiffness": "windowed",
        "terms": (),
    },
    "auto": {
        "form": "weak",
        "window_length": "auto",
        "exponent": "auto",
        "max_order": 15,
        "criterion": "aicc",
        "selection": "average",
        "equations": "auto",
        "variation": "linear",
        "filter_torque": False,
        "lag": 0.0,
        "inertia": "auto",
        "damping": "auto",
        "stiffness": "windowed",
        "terms": (("offset", "constant"),),
    },
}
"""Every setting by preset."""

_COEFFICIENTS = ("inertia", "damping", "stiffness")


def resolve(preset: str, given: Mapping[str, Any], earlier: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return all settings: what is given wins over an earlier result's settings, those over the preset's."""
    if earlier is not None:
        earlier = _of_result(earlier)
        preset = earlier.pop("preset")
    arguments.one_of("preset", preset, get_args(Preset))
    settings = PRESETS[preset] | dict(earlier or {}) | {name: value for name, value in given.items() if value is not None}
    settings["preset"] = preset
    if given.get("equations") not in {None, "auto"} and given.get("selection") is None:
        # Whoever gives a length means windows of that length.
        settings["selection"] = "window"
    choices = {"form": Form, "selection": Averaging, "variation": Variation, "criterion": Criterion}
    for name, literal in choices.items():
        arguments.one_of(name, settings[name], get_args(literal))
    if settings["form"] == "auto":
        settings["form"] = "weak"
    fallback = PRESETS["paper" if settings["form"] == "strong" else preset]
    for name in ("selection", "window_length", "equations"):
        # In strong form nothing chooses them.
        if settings[name] == "auto" or (settings["form"] == "strong" and name == "selection"):
            settings[name] = fallback[name]
    settings["lag"] = arguments.finite_number("lag", settings["lag"])
    if not isinstance(settings["filter_torque"], bool):
        raise TypeError(f"filter_torque must be True or False; got {settings['filter_torque']!r}; pass one of them")
    return settings


def _of_result(earlier: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments that an earlier result's settings stand for."""
    try:
        kinds = dict(earlier["kinds"])
        settings = {name: earlier[name] for name in (*PRESETS["paper"], "preset") if name in earlier}
    except (KeyError, TypeError):
        raise TypeError(
            f"settings must be those of an earlier result; got {earlier!r}; pass result.settings"
        ) from None
    for name in _COEFFICIENTS:
        settings[name] = earlier["known"][name] if kinds[name] == "known" else kinds[name]
        if settings[name] is None:
            raise ValueError(
                f"settings hold no {name}, since it was known at every sample; got None; pass {name}= again"
            )
    settings["terms"] = tuple((name, kind) for name, kind in kinds.items() if name not in _COEFFICIENTS)
    return settings
