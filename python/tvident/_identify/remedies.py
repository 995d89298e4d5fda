"""What is worth changing in the equation of motion, found by trying it: advice must lead to the answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tvident._arguments import listed, with_error
from tvident._equation import COEFFICIENTS
from tvident._identify.beside_changes import BesideChanges
from tvident._identify.growths import GROWTHS
from tvident._identify.left_over import AS_GOOD
from tvident._identify.offered import BEYOND_CHANCE, MATTERS, Remedy, are_distinguished, can_be, holds, is_told
from tvident._identify.tried_record import BETTER, CONTRADICTED, WORTH, Call
from tvident._status import DOUBTFUL_RECORD, Status

_NOTHING = 1.05
"""Stiffness is none if the residuals' variance without it is at most this many times that with it."""


class Trial(BesideChanges):
    """A record that is tried with all that may be worth changing."""

    def remedy(self) -> Remedy | None:
        """Return what to change, and what that explains; None where nothing that was tried is better by far."""
        if not any(isinstance(kind, str) for kind in self.given.values()):
            return None
        call = self._of_constants_alone
        of_constants = self._of_constants(call)
        # What explains nothing with parameters that change is not explained by one term more either.
        is_changing = "windowed" in self.result.settings["kinds"].values() and not self._explains_nothing
        # Where a parameter changes constants explain too little to tell what is missing: they take what lets them follow the change.
        # What constants explain down to the noise needs nothing that changes, and an equation that leaves nothing no other.
        is_settled = of_constants is not None and of_constants.is_settled
        beside = steady = None
        if is_changing and not is_settled:
            beside = self._beside_changes()
            steady = None if self._needs_no_changes else self._beside_constant_stiffness()
        # The simpler ones come first.
        tried = [one for one in (steady, of_constants, beside) if one is not None]
        least = min((one.ratio for one in tried), default=np.inf)
        return next((one for one in tried if one.ratio <= AS_GOOD * least), None)

    def set_free(self, remedy: Remedy | None) -> Remedy | None:
        """Return to let change what was given as constant and is not, where that explains more than what else would; None elsewhere.

        Whatever is missing takes a part of what such a parameter does: a preload that of a stiffness that steps.
        """
        names = [name for name in COEFFICIENTS if isinstance(self.given[name], str) and self.given[name] == "constant"]
        names_a_term = remedy is None or "terms=" in remedy.words
        if not (names and names_a_term and self.result.record_status & Status.KIND_CONTRADICTED):
            return None
        kinds = {name: "windowed" if name == "stiffness" else "auto" for name in names}
        free = self._tried({**self.given, **kinds}, {"terms": self.terms, "lag": self.result.settings["lag"]})
        if free is None or free.record_status & CONTRADICTED or self._feeds_energy(free):
            return None
        left = self._left_of(free)
        changing = [name for name in names if free.settings["kinds"][name] != "constant"]
        if not (changing and left.ratio <= BETTER * (1 if remedy is None else remedy.ratio)):
            return None
        was, change = "was" if len(changing) == 1 else "were", ", ".join(f"{name}={kinds[name]!r}" for name in changing)
        said = (
            f"{listed(changing)} {was} given as constant, but what changes explains more than any term that may be missing: try "
            f"{change}; {left}{self._moved(free, is_more=False)}"
        )
        return Remedy(left.ratio, said, distinguishes=False, share=left.least.share)

    def _of_constants(self, call: Call) -> Remedy | None:
        """Return which suspects, or which stiffness of none, explain more where everything is constant."""
        chosen, best = [], self._spread(call)
        while rest := [one for one in self.suspects if one not in chosen]:
            left = {one: self._spread(self._with(call, one)) for one in rest}
            next_one = min(rest, key=left.__getitem__)
            if not (np.isfinite(left[next_one]) and left[next_one] <= WORTH * best):
                break
            chosen.append(next_one)
            call, best = self._with(call, next_one), left[next_one]
        without = call | {"stiffness": 0.0}
        is_none = isinstance(self.given["stiffness"], str) and bool(self._spread(without) <= _NOTHING * best < np.inf)
        if self._explains_nothing and not chosen and not is_none:
            return None
        return self._compared(call, without if is_none else call, chosen)

    def useless(self) -> tuple[list[str], list[str]]:
        """Return suspects that explain nothing, and constants that were given and predict as well as when they may change.

        What is tried has constants only, so it says nothing of suspects where the result has parameters that change.
        """
        kinds = self.result.settings["kinds"]
        changing = [name for name in COEFFICIENTS if kinds[name] in {"windowed", "varying"}]
        call: Call = dict(self.given) | {"terms": list(self.terms), "lag": self.result.settings["lag"]}
        suspects = []
        if not changing and self.suspects:
            best = self._spread(call)
            suspects = [one for one in self.suspects if not self._spread(self._with(call, one)) <= WORTH * best]
        given = [name for name in COEFFICIENTS if isinstance(self.given[name], str) and self.given[name] == "constant"]
        if given and self.result.record_status & Status.KIND_CONTRADICTED:
            free = self.identify(**(call | dict.fromkeys(given, "auto")))
            if not self._left_of(free).ratio <= BETTER:
                return suspects, given
        return suspects, []

    def _compared(self, before: Call, call: Call, chosen: Sequence[str]) -> Remedy | None:
        """Return the advice in words, if it explains more of what is held back than the model at hand."""
        found, asked = self._identified(call), call
        if call["lag"] == "auto":
            call = call | {"lag": float(f"{found.settings['lag']:.4g}")}
        is_none = not np.array_equal(call["stiffness"], before["stiffness"])  # which may be arrays without NaN
        kept = {name: call[name] if name == "stiffness" and is_none else kind for name, kind in self.given.items()}
        is_at_hand = self.is_as_asked and not (chosen or is_none)
        free = self.result if is_at_hand else self.identify(**kept, terms=call["terms"], lag=call["lag"], diagnose=True)
        left, left_free = self._left_of(found), self._left_of(free)
        changing = [name for name in COEFFICIENTS if free.settings["kinds"][name] in {"windowed", "varying"}]
        is_as_good = bool(changing) and left.ratio <= AS_GOOD * left_free.ratio
        is_simple = is_as_good and self._stays(changing, found) and not self._follows_time(call, changing)
        best, of_best = (left, found) if is_simple else (left_free, free)
        if not (is_simple or chosen or is_none):
            return None
        untold = [one for one in chosen if not (self._is_late(found) if one == "lag" else is_told(one, of_best))]
        if untold:
            # Beside what changes it may be nothing, and so may a lag beside friction.
            without, call = (self._without(one, untold) for one in (before, asked))
            return self._compared(without, call, [one for one in chosen if one not in untold])
        is_worth_it = best.least.share < 1 and best.ratio <= (BETTER if is_simple else self._worth)
        if not is_worth_it or self._feeds_energy(of_best) or not all(can_be(one, of_best) for one in chosen):
            return None
        flags = self._identified(call, diagnose=True).record_status
        if not holds(best.least.share, flags):
            return None
        words = []
        if is_none:
            value = self._identified(before).value("stiffness")
            words.append(
                f"stiffness is none ({with_error(value.value, value.stderr)} {self.result.units['stiffness']}, all constant)"
            )
        words += [self._suspicion(name, found if name == "lag" else of_best) for name in chosen]
        words = words or [f"{' and '.join(changing)} need not change"]
        changes = [f"stiffness={call['stiffness']:g}"] if is_none else []
        if len(call["terms"]) > len(self.terms):
            shown = [term if isinstance(term, str) else term.name for term in call["terms"]]
            changes.append(f"terms={shown}")
        if "lag" in chosen:
            changes.append(f"lag={call['lag']:.4g}")
        if is_simple:
            changes += [f"{name}='constant'" for name in self._made_constant(changing, kept, call)]
        said = f"{', '.join(words)}: try {', '.join(changes)}; {best}{self._moved(of_best, is_more=bool(chosen))}"
        is_settled = not flags & DOUBTFUL_RECORD if is_simple else self._leaves_nothing(free)
        # With an unknown less the others are told apart whatever the truth is.
        is_more = bool(chosen) and not is_none
        distinguishes = is_more and are_distinguished(flags if is_simple else free.record_status)
        return Remedy(best.ratio, said, distinguishes, is_settled=is_settled, share=best.least.share)

    def _without(self, call: Call, names: Sequence[str]) -> Call:
        """Return a call without some of what was chosen."""
        lag = self.result.settings["lag"] if "lag" in names else call["lag"]
        return call | {"terms": [term for term in call["terms"] if term not in names], "lag": lag}

    def _made_constant(self, changing: Sequence[str], kept: Mapping[str, Any], call: Call) -> list[str]:
        """Return what must be given as constant for the parameters that are told: what changes, and what changes once that may not.

        Of the positioning system EMPS without a stiffness damping takes over what the inertia no longer follows.
        """
        names = [name for name in changing if call[name] == "constant"]
        if not {"inertia", "damping"}.intersection(names):
            return names
        advised = self._tried({**kept, **dict.fromkeys(names, "constant")}, call)
        kinds = {} if advised is None else advised.settings["kinds"]
        then = [
            name for name, kind in kinds.items() if kind in {"windowed", "varying"} and call.get(name) == "constant"
        ]
        return [name for name in COEFFICIENTS if name in names or name in then]

    def _follows_time(self, call: Call, names: Sequence[str]) -> bool:
        """Return whether coefficients that were found to change grow with time beyond chance, along a cubic, where all else is constant.

        What is held back may be predicted as well without: windows may be too short for what they hold, as where a sweep passes a
        resonance, and then constants are not right because windows are worse.
        """
        growing = {name: GROWTHS[name] for name in names if name in GROWTHS and call[name] == "constant"}
        if not growing:
            return False
        try:
            found = self._identified(
                call | {"terms": [*call["terms"], *(one for each in growing.values() for one in each)]}
            )
        except ValueError:
            return False
        return any(
            abs(growth.value) > max(BEYOND_CHANCE * growth.stderr, MATTERS * abs(found.value(name).value))
            for name, terms in growing.items()
            for growth in (found.value(term.name) for term in terms)
        )
