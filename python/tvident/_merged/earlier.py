"""Settings of an earlier result of trials or masses: what they stand for in another call, and what they must be."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from tvident import _arguments as arguments
from tvident._clocks import SETTINGS_OF_TIMES
from tvident._merged.elements import Element, kind_or_number
from tvident._merged.merging import Merging

_LENGTHS = ("window_length", "exponent", "regression_window")
_OTHERS = ("form", "sample_rate", "trials", "masses", "kinds", "known", "terms", "own_terms", "chosen", "step")
_FOUND = ("noise", "prediction_error", "expansions", *SETTINGS_OF_TIMES)
"""Found, not chosen: nothing of it is used again."""
_UNKNOWN, _EXPANDED = "unknown", "expanded"


@dataclass(frozen=True)
class Earlier:
    """What an earlier result chose.

    Parameters
    ----------
    values : mapping of str to str or float
        By element: its kind, "expanded" among them, or what was known of it. Those that could not be known are left out.
    terms : sequence of str
        Names of the terms that elements belong to.
    own_terms : sequence of str
        Those of the user's own.
    forms : sequence of mapping of str to int or None
        Lengths of every part of the equations that shares no unknown with others; None where they are chosen again.
    """

    values: Mapping[str, Any]
    terms: Sequence[str]
    own_terms: Sequence[str]
    forms: Sequence[Mapping[str, int | None]]

    @classmethod
    def of(cls, settings: Any) -> Earlier:
        """Return what settings stand for.

        Raises
        ------
        TypeError
            If they are not those of a result of trials or masses.
        """
        try:
            return cls._read(settings)
        except (KeyError, TypeError, ValueError, AttributeError):
            raise TypeError(
                "settings must be those of an earlier result with ensemble_axis= or dof_axis= beside these; got "
                f"{arguments.shown(settings)}; pass result.settings"
            ) from None

    @classmethod
    def _read(cls, settings: Mapping[str, Any]) -> Earlier:
        # What is misspelled would be ignored.
        if not {*_LENGTHS, *_OTHERS} <= set(settings) <= {*_LENGTHS, *_OTHERS, *_FOUND}:
            raise KeyError
        known = {str(name): _number(value) for name, value in settings["known"].items()}
        values: dict[str, Any] = {}
        for name, kind in settings["kinds"].items():
            if kind == _EXPANDED:
                values[str(name)] = _EXPANDED
            elif kind != _UNKNOWN:
                values[str(name)] = known[name] if kind == "known" else kind_or_number(str(name), str(kind))
        lengths = {name: [_length(one) for one in settings[name]] for name in _LENGTHS}
        # Where windows of all lengths are averaged, which of them predicts best is a matter of the record.
        chosen_again = "regression_window" in settings["chosen"]
        forms = []
        for length, exponent, window in zip(*lengths.values(), strict=True):
            wanted = None if chosen_again or window == 0 else window
            forms.append({"window_length": length, "exponent": exponent, "regression_window": wanted})
        terms, own = (tuple(map(str, settings[name])) for name in ("terms", "own_terms"))
        return cls(values, terms, own, forms)

    def as_before(self, elements: Sequence[Element], given: frozenset[str]) -> list[Element]:
        """Return elements as they were found, but for those of which something is given.

        Parameters
        ----------
        elements : sequence of Element
        given : frozenset of str
            Inertia, damping, stiffness and terms whose kinds this call says.

        Raises
        ------
        ValueError
            If the earlier result had other elements.
        """
        rest = [one for one in elements if one.of not in given]
        foreign = sorted(set(self.values) - {one.name for one in elements})
        if foreign:
            raise ValueError(
                f"settings must be of a result with the same elements; got {foreign[0]!r}, which there is not here; give the same "
                "structure and terms"
            )
        names = {one.name for one in rest}
        return [self._before(one) if one.name in names & set(self.values) else one for one in elements]

    def _before(self, element: Element) -> Element:
        """Return an element as it was found; its functions must be given again."""
        value = self.values[element.name]
        if value == _EXPANDED:
            raise ValueError(
                f"settings hold no functions, and {element.name} is an expansion; got none; pass its Expansion(…) again"
            )
        return replace(element, value=value)

    def check_parts(self, parts: int) -> None:
        """Refuse settings of equations that fell into another number of parts."""
        if parts != len(self.forms) and self.forms:
            raise ValueError(
                f"settings must be of a result whose equations share unknowns as these do; got {len(self.forms)} parts beside {parts}; "
                "give the same structure, or leave settings= out"
            )


def stored(merging: Merging, kinds: Mapping[str, str]) -> dict[str, Any]:
    """Return what settings keep beside lengths, so that they can be given to another call."""
    return {
        "kinds": dict(kinds),
        "known": {one.name: one.number for one in merging.elements if one.is_known},
        "terms": list(merging.terms),
        "own_terms": [] if merging.recorded is None else list(merging.recorded.own),
        "chosen": list(merging.parts[0].chosen) if merging.parts else [],
    }


def _number(value: object) -> float:
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError
    return float(value)


def _length(value: object) -> int:
    if not isinstance(value, int) or value < 0:
        raise ValueError
    return value
