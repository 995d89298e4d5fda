"""What is worth changing in the equation of motion, found by trying it: advice must lead to the answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tvident._arguments import percent, with_error
from tvident._equation import BUILT_IN, COEFFICIENTS
from tvident._results import TRIED, Identification
from tvident._status import DOUBTFUL_RECORD, Status

_WORTH = 0.9
"""A change is worth it if the residuals' variance falls to this part or below."""

_NOTHING = 1.05
"""Stiffness is none if the residuals' variance without it is at most this many times that with it."""

_BETTER = 0.8
"""What is advised leaves at most this part of what the model at hand leaves unexplained of parts that are held back."""

_AS_GOOD = 1.25
"""Constants are advised where they leave at most so many times what changing parameters leave."""

NEXT_TO_NOTHING = 0.01
"""A share of the angle's variance that may stay unexplained whatever else is said."""

BEYOND_CHANCE = 4.0
"""Standard errors that a term must be away from nothing."""

Call = dict[str, Any]


@dataclass(frozen=True)
class Trial:
    """A record that can be identified again with other terms, and what it was suspected of.

    Parameters
    ----------
    identify : callable
        Takes arguments of ``identify`` and returns a result.
    result : Identification
        What was found so far.
    given : mapping of str to object
        Inertia, damping and stiffness as they were asked for.
    terms : sequence
        Terms that were asked for, without kinds.
    suspects : sequence of str
        Terms that may be missing, and ``"lag"``.
    """

    identify: Callable[..., Identification]
    result: Identification
    given: Mapping[str, Any]
    terms: Sequence[Any]
    suspects: Sequence[str]

    def advice(self) -> str | None:
        """Return what to change, and what that explains; None where nothing that was tried is better by far."""
        constant = {name: "constant" if isinstance(kind, str) else kind for name, kind in self.given.items()}
        if not any(isinstance(kind, str) for kind in constant.values()):
            return None
        call: Call = constant | {"terms": list(self.terms), "lag": self.result.settings["lag"]}
        chosen, best = [], self._left(call)
        while rest := [one for one in self.suspects if one not in chosen]:
            left = {one: self._left(self._with(call, one)) for one in rest}
            next_one = min(rest, key=left.__getitem__)
            if not (np.isfinite(left[next_one]) and left[next_one] <= _WORTH * best):
                break
            chosen.append(next_one)
            call, best = self._with(call, next_one), left[next_one]
        without = call | {"stiffness": 0.0}
        # What explains nothing with parameters that change is not explained by one term more either.
        if not chosen and not self._explains_nothing and "windowed" in self.result.settings["kinds"].values():
            # Where a parameter changes constants explain too little to tell what is missing.
            advice = self._beside_changes(call)
            if advice is not None:
                return advice
        is_none = isinstance(self.given["stiffness"], str) and bool(self._left(without) <= _NOTHING * best < np.inf)
        if self._explains_nothing and not chosen and not is_none:
            return None
        return self._compared(call, without if is_none else call, chosen)

    def _beside_changes(self, call: Call) -> str | None:
        """Return which one suspect explains more of what is held back, with parameters as they were asked for."""
        found, changed_by = {}, dict[str, Call]()
        # Inertia and damping that may change take the place of what is missing.
        kinds = {name: call[name] if name != "stiffness" else kind for name, kind in self.given.items()}
        for one in self.suspects:
            changed = self._with(call, one)
            changed_by[one] = {"terms": changed["terms"], "lag": changed["lag"]}
            # Which one is found with the lengths that were chosen, what it is worth with its own: choosing takes most of the time.
            result = self.identify(**kinds, **changed_by[one], **self._lengths)
            found[one] = unexplained(result) if _is_there(one, result) else np.inf
        best = min(found, key=found.__getitem__)
        now = unexplained(self.result)
        if not found[best] <= _WORTH * now:
            return None
        result = self.identify(**kinds, **changed_by[best], diagnose=True)
        least = unexplained(result)
        if not (_is_there(best, result) and least <= _BETTER * now and _holds(least, lambda: result)):
            return None
        terms = [term if isinstance(term, str) else term.name for term in self._with(call, best)["terms"]]
        change = f"lag={result.settings['lag']:.4g}" if best == "lag" else f"terms={terms}"
        return f"{self._suspicion(best, result)}: try {change}; {_gain(least, now)}"

    def useless(self) -> tuple[list[str], list[str]]:
        """Return suspects that explain nothing, and constants that were given and predict as well as when they may change.

        What is tried has constants only, so it says nothing of suspects where the result has parameters that change.
        """
        kinds = self.result.settings["kinds"]
        changing = [name for name in COEFFICIENTS if kinds[name] in {"windowed", "varying"}]
        call: Call = dict(self.given) | {"terms": list(self.terms), "lag": self.result.settings["lag"]}
        suspects = []
        if not changing and self.suspects:
            best = self._left(call)
            suspects = [one for one in self.suspects if not self._left(self._with(call, one)) <= _WORTH * best]
        given = [name for name in COEFFICIENTS if isinstance(self.given[name], str) and self.given[name] == "constant"]
        if given and self.result.record_status & Status.KIND_CONTRADICTED:
            free = self.identify(**(call | dict.fromkeys(given, "auto")))
            if not unexplained(free) <= _BETTER * unexplained(self.result):
                return suspects, given
        return suspects, []

    def _with(self, call: Call, change: str) -> Call:
        return call | ({"lag": "auto"} if change == "lag" else {"terms": [*call["terms"], change]})

    @property
    def _explains_nothing(self) -> bool:
        is_lost = bool(self.result.record_status & Status.RANK_DEFICIENT)
        return is_lost and not any(np.isfinite(getattr(self.result, name)).any() for name in COEFFICIENTS)

    @property
    def _lengths(self) -> Call:
        """Lengths of the test function and of windows, as they were chosen."""
        return {name: self.result.settings[name] for name in ("window_length", "exponent", "regression_window")}

    def _identified(self, call: Call, *, diagnose: bool = False) -> Identification:
        window = {name: self.result.settings[name] for name in ("window_length", "exponent")}
        return self.identify(
            **(call | {"terms": [(term, "constant") for term in call["terms"]]}), **window, diagnose=diagnose
        )

    def _left(self, call: Call) -> float:
        """Return the variance of the residuals where everything is constant."""
        try:
            found = self._identified(call)
        except ValueError:
            return np.inf
        if not all(_is_there(one, found) for one in self.suspects if one in found.terms):
            return np.inf
        spread = found.residual_std[np.isfinite(found.residual_std)]
        return float(np.median(spread)) ** 2 if spread.size else np.inf

    def _compared(self, before: Call, call: Call, chosen: Sequence[str]) -> str | None:
        """Return the advice in words, if it explains more of what is held back than the model at hand."""
        found, now = self._identified(call), unexplained(self.result)
        if call["lag"] == "auto":
            call = call | {"lag": float(f"{found.settings['lag']:.4g}")}
        kept = {
            name: call[name] if name == "stiffness" and call[name] == 0 else kind for name, kind in self.given.items()
        }
        free = self.identify(**kept, terms=call["terms"], lag=call["lag"])
        left, left_free = unexplained(found), unexplained(free)
        changing = [name for name in COEFFICIENTS if free.settings["kinds"][name] in {"windowed", "varying"}]
        is_simple = bool(changing) and left <= _AS_GOOD * left_free
        least = left if is_simple else left_free
        if not (is_simple or chosen or call["stiffness"] != before["stiffness"]):
            return None
        if not least <= _BETTER * now or not _holds(least, lambda: self._identified(call, diagnose=True)):
            return None
        words = []
        if call["stiffness"] != before["stiffness"]:
            value = self._identified(before).value("stiffness")
            words.append(
                f"stiffness is none ({with_error(value.value, value.stderr)} {self.result.units['stiffness']}, all constant)"
            )
        words += [self._suspicion(name, found) for name in chosen]
        words = words or [f"{' and '.join(changing)} need not change"]
        changes = [f"stiffness={call['stiffness']:g}"] if call["stiffness"] != before["stiffness"] else []
        if len(call["terms"]) > len(self.terms):
            shown = [term if isinstance(term, str) else term.name for term in call["terms"]]
            changes.append(f"terms={shown}")
        if "lag" in chosen:
            changes.append(f"lag={call['lag']:.4g}")
        changes += [f"{name}='constant'" for name in changing if is_simple and call[name] == "constant"]
        return f"{', '.join(words)}: try {', '.join(changes)}; {_gain(least, now)}"

    def _suspicion(self, name: str, found: Identification) -> str:
        if name == "lag":
            late, rate = found.settings["lag"], found.settings["sample_rate"]
            error = found.settings.get("lag_stderr") or 0.0
            return f"the torque is {'late' if late > 0 else 'early'} by {with_error(abs(late) * rate, error * rate)} samples"
        value, error, *_ = found.value(name)
        return BUILT_IN[name].suspicion.format(amount=f"{with_error(value, error)} {found.units.get(name, '')}")


def _gain(least: float, now: float) -> str:
    before = f", not {percent(1 - now)}" if now < 1 else ""
    return f"then {percent(1 - least)} {TRIED}{before}"


def _is_there(name: str, found: Identification) -> bool:
    """Return whether a term or a lag is beyond chance; friction that drives the motion is no friction."""
    if name == "lag":
        value, error = found.settings["lag"], found.settings.get("lag_stderr") or 0.0
    else:
        value, error, *_ = found.value(name)
    drives = value <= 0 and name in BUILT_IN and BUILT_IN[name].dissipates
    return bool(abs(value) > BEYOND_CHANCE * error and not drives)


def _holds(share: float, again: Callable[[], Identification]) -> bool:
    """Return whether what is to be advised predicts next to everything, or nothing says that it cannot be trusted either."""
    flags = again().record_status
    if flags & Status.RANK_DEFICIENT:
        return False
    return share <= NEXT_TO_NOTHING or not flags & DOUBTFUL_RECORD


def unexplained(result: Identification) -> float:
    """Return the share of the angle's variance that is not predicted one test function ahead; infinite where that is not known."""
    predicted = float(np.max(result.held_back().predicted))
    return 1 - predicted / 100 if np.isfinite(predicted) else np.inf
