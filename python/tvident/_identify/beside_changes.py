"""What is worth changing in the equation of motion beside parameters that change."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from tvident import _core
from tvident._advice import LAG_NOT_TOLD, none_there
from tvident._arguments import percent, with_error
from tvident._equation import COEFFICIENTS
from tvident._identify.first_look import FirstLook
from tvident._identify.left_over import AS_GOOD, Left
from tvident._identify.offered import Remedy, are_distinguished, can_be, holds, is_there
from tvident._identify.tried_record import BETTER, CONTRADICTED, LEFT_OVER, Call, Names, TriedRecord
from tvident._results import Identification
from tvident._status import Status

_ENOUGH = 0.2
"""So much may be left by what nothing contradicts for no other suspect to be tried: each takes as long as to identify a part."""

_WINDOWS = 4
"""Lengths of a test function in the windows of a first look."""

_LEAST = 4
"""Windows that a first look has at least."""

_UNEXPLAINED = Status.NOISE_MODEL | Status.WINDOW_LIMIT
"""Flags of a record that is predicted badly: the shortest windows may follow what is missing, and next to nothing is left within them."""

_NARROWER = (4, 2)
"""Parts of the test function at hand that looks beside windows are taken with."""

_SHORTEST = 9
"""Samples that a test function has at least."""

_BY_CHANCE = 2.0
_LEAST_PART = 0.5
"""A suspect is none where it is less than such a part of what it seemed to be, by so many errors."""

_FAR_SMALLER = 1 / 3
"""What predicts as much is advised where an error falls to this part or below."""


class BesideChanges(TriedRecord):
    """A record in which parameters change, tried with other equations."""

    def _beside_changes(self) -> Remedy | None:
        """Return which suspect explains more of what is held back, or which together, with parameters as they were asked for.

        Each gets lengths of its own: those that were chosen follow what is missing.
        """
        for found in self._each_beside_changes():
            left_of = self._worth_it(found)
            if not left_of:
                continue
            least = min(left.ratio for left in left_of.values())
            as_good = [names for names, left in left_of.items() if left.ratio <= AS_GOOD * least]
            best = min(as_good, key=lambda names: (len(names), left_of[names].ratio))
            left, result = left_of[best], found[best]
            if holds(left.least.share, result.record_status) and left.least.share < 1:
                words = (
                    f"{self._suspicions(best, result)}: try {self._change(best, result)}; {left}{self._moved(result)}"
                )
                return Remedy(left.ratio, words, are_distinguished(result.record_status), share=left.least.share)
        return None

    def _worth_it(self, found: Mapping[Names, Identification]) -> dict[Names, Left]:
        """Return what suspects leave that may be and are worth it."""
        left_of = {names: self._left_of(one) for names, one in found.items() if self._may_be(names, one)}
        return {names: left for names, left in left_of.items() if left.ratio <= self._worth}

    def undoubted(self, suspects: Sequence[str]) -> tuple[Names, str] | None:
        """Return the first suspects with which nothing else is suspected, if parameters are elsewhere then, and what to do in words.

        For where prediction tells nothing: of a short record so little is left beside what is held back that any model predicts it badly.
        """
        if self._explains_nothing or not (suspects and any(isinstance(kind, str) for kind in self.given.values())):
            return None
        allowed = {*suspects, *(self._seen if self.result.record_status & CONTRADICTED else ())}
        for found in self._each_beside_changes():
            for names, result in found.items():
                if not allowed.issuperset(names) or result.record_status & LEFT_OVER or not self._may_be(names, result):
                    continue
                moved = self._moved(result)
                if moved or self._explains_noise(names, result):
                    change = self._change(names, result)
                    return (
                        names,
                        f"{self._suspicions(names, result)}: give {change}; then nothing else is suspected{moved}",
                    )
        return None

    def _explains_noise(self, names: Names, result: Identification) -> bool:
        """Return whether a term that a look sees beside windows explains what the noise does not, and nothing else is contradicted."""
        is_explained = self.result.record_status & _UNEXPLAINED and not result.record_status & (
            CONTRADICTED | _UNEXPLAINED
        )
        return bool(is_explained) and names == tuple(self._seen_beside_changes)

    def denied(self, suspects: Sequence[_core.Suspect]) -> dict[str, str]:
        """Return suspects that are not there where they are tried with all else as it was asked for, each with what is to be said.

        What the core suspects is told by equations at hand, whose windows and curves follow what else is wrong with them.
        """
        tried = self._beside.get(1 if self._may_change else 0, {})
        words = {}
        for one in suspects:
            found = tried.get((one.name,))
            if found is None:
                continue
            value, error = self._amount(one.name, found)
            if error is None:
                words[one.name] = LAG_NOT_TOLD
            elif abs(value) + _BY_CHANCE * error < _LEAST_PART * abs(one.value):
                unit = "samples" if one.name == "lag" else found.units.get(one.name, "")
                words[one.name] = none_there(one.name, f"{with_error(value, error)} {unit}")
        return words

    def _amount(self, name: str, found: Identification) -> tuple[float, float | None]:
        """Return what was found of a term or of a lag, in samples beside what is there, and its error: None where nothing tells it."""
        if name != "lag":
            value, error, *_ = found.value(name)
            return value, error
        rate, of_lag = found.settings["sample_rate"], found.settings.get("lag_stderr")
        return self._lag_beside(found), None if of_lag is None else of_lag * rate

    @property
    def _may_change(self) -> bool:
        """Whether inertia or damping was found to vary, and might have been constant."""
        found, constant = self.result.settings["kinds"], self._beside_constants
        return any(found[name] == "varying" and constant[name] != self.given[name] for name in COEFFICIENTS)

    def _each_beside_changes(self) -> Iterator[dict[Names, Identification]]:
        """Yield what suspects make of the record: beside constants and stiffness as it was asked for, then as all was asked for.

        Inertia and damping that may change take the place of what is missing, so they change beside it only where they were found to,
        and where that explains more. Then a term is tried only if the result says so, which changes as much, or if it is there beside
        constants: that takes longest of all. A lag is followed by whatever changes, so it is tried where a first look sees it. Where
        nothing contradicts an equation beside constants, nothing changes beside it.
        """
        call = self._of_constants_alone
        constant = self._beside_constants
        for place, kinds in enumerate([constant, self.given] if self._may_change else [constant]):
            if place and self._needs_no_changes:
                return
            if place not in self._beside:
                names = self._worth_a_trial if place == 0 else self._worth_a_trial_beside_changes
                tried = self._tried_until_settled(kinds, call, names)
                if place == 0 and not self._worth_it(tried):
                    # What lengths of a look do not see may be there where they are chosen.
                    unseen: list[Names] = [(one,) for one in self.beyond_chance if (one,) not in tried]
                    tried |= self._tried_until_settled(kinds, call, unseen)
                self._beside[place] = tried
            yield self._beside[place]

    @property
    def _beside_constants(self) -> Call:
        """Kinds as they were asked for, without inertia and damping that may change."""
        constant = self._of_constants_alone
        return {name: constant[name] if name != "stiffness" else kind for name, kind in self.given.items()}

    @cached_property
    def _seen(self) -> list[str]:
        """What a first look sees, the likeliest first; all suspects where no look is possible."""
        return self._look.seen(self._sought) if self._look.tells else list(self.suspects)

    @property
    def _sought(self) -> list[str]:
        """What a first look looks for."""
        return list(dict.fromkeys([*self.suspects, *self.others]))

    @property
    def _worth_a_trial(self) -> list[Names]:
        """What is tried beside constants: the likeliest, those that explain a part each beside each other, then one by one."""
        together = self._look.together(self._sought) if self._look.tells else ()
        likeliest: list[Names] = [(self._seen[0],), together] if len(together) > 1 else []
        each: list[Names] = [(one,) for one in self._seen]
        return list(dict.fromkeys([*likeliest, *each]))

    @property
    def _worth_a_trial_beside_changes(self) -> list[Names]:
        """What is tried where all may change."""
        there = [
            names for names, result in self._beside.get(0, {}).items() if all(is_there(one, result) for one in names)
        ]
        lag: list[Names] = [("lag",)] if "lag" in self._seen else []
        suspected: list[Names] = [(one,) for one in self.suspects if one in self.beyond_chance]
        seen: list[Names] = [(one,) for one in self._seen_beside_changes]
        return list(dict.fromkeys([*seen, *lag, *suspected, *there]))

    @cached_property
    def _seen_beside_changes(self) -> list[str]:
        """What looks see where windows follow what changes: beside constants a weak friction is drowned in what a damping does that varies.

        What is missing has made the test function at hand wide, as slow changes are told best by; kinks are told by narrow ones.
        """
        if not self.result.record_status & (CONTRADICTED | _UNEXPLAINED):
            return []
        sought = [one for one in self._sought if one != "lag"]
        for part in _NARROWER:
            look = FirstLook(
                partial(self._left_in_windows, max(_SHORTEST, self.result.settings["window_length"] // part | 1))
            )
            if look.tells and (seen := look.seen(sought)):
                return seen[:1]
        return []

    def _left_in_windows(self, length: int, names: Names) -> float:
        """Return the mean square of what equations with these terms leave where windows follow all that changes."""
        found = self.result.settings["kinds"]
        given = {
            name: "windowed" if isinstance(kind, str) and found[name] == "varying" else kind
            for name, kind in self._beside_constants.items()
        }
        return self._left_with(given, names, self._lengths(length))

    @cached_property
    def _look(self) -> FirstLook:
        return FirstLook(self._left_at_given_lengths)

    def _left_at_given_lengths(self, names: Names) -> float:
        """Return the mean square of what equations of given lengths leave with these terms, beside constants."""
        return self._left_with(
            self._beside_constants, names, self._lengths(2 * self.result.settings["window_length"] + 1)
        )

    def _left_with(self, kinds: Mapping[str, Any], names: Names, lengths: dict[str, Any]) -> float:
        call = self._with(self._of_constants_alone, *names)
        if not any(isinstance(kind, str) and kind == "windowed" for kind in kinds.values()):
            del lengths["regression_window"]
        terms = [(term, "constant") for term in call["terms"]]
        try:
            found = self.identify(**kinds, terms=terms, lag=call["lag"], **lengths)
        except ValueError:
            return np.inf
        if not all(can_be(one, found) for one in names):
            return np.inf
        left = found.residual_std[np.isfinite(found.residual_std)]
        return float(np.mean(left**2)) if left.size else np.inf

    def _lengths(self, length: int) -> dict[str, Any]:
        """Lengths that follow little: those at hand may follow what is missing."""
        window = max(length, min(_WINDOWS * length, self.result.time.size // _LEAST))
        return {"window_length": length, "exponent": self.result.settings["exponent"], "regression_window": window}

    def _tried_until_settled(
        self, kinds: Mapping[str, Any], call: Call, suspects: Sequence[Names]
    ) -> dict[Names, Identification]:
        """Return what is found with one suspect after the other, up to the first that leaves nothing to explain."""
        tried = {}
        for names in suspects:
            found = self._tried(kinds, self._with(call, *names))
            if found is not None:
                tried[names] = found
                if self._leaves_nothing(found, _ENOUGH) and self._may_be(names, found):
                    break
        return tried

    @property
    def _needs_no_changes(self) -> bool:
        """Whether nothing contradicts an equation that was tried beside constants, with suspects that can be."""
        tried = self._beside.get(0, {})
        return any(
            not found.record_status & CONTRADICTED and self._may_be(names, found) for names, found in tried.items()
        )

    def _beside_constant_stiffness(self) -> Remedy | None:
        """Return that the stiffness need not change beside what does, where that predicts more, or as much with far smaller errors.

        Where the motion is fast windows tell little of a stiffness: along a sweep they may tell it from an inertia nowhere.
        """
        if "varying" not in (self.result.settings["kinds"][name] for name in ("inertia", "damping")):
            return None
        found = self._tried({**self.given, "stiffness": "constant"}, self._of_constants_alone)
        if found is None or found.record_status & CONTRADICTED or not self._stays(["stiffness"], found):
            return None
        left, known = self._left_of(found), self._better_known(found)
        is_worth_it = left.ratio <= BETTER or (left.is_as_much and known)
        if not is_worth_it or self._feeds_energy(found):
            return None
        words = f"stiffness need not change: try stiffness='constant'; {left}{known}{self._moved(found, is_more=False)}"
        ratio = min(left.ratio, AS_GOOD)
        return Remedy(ratio, words, distinguishes=False, is_settled=True, share=left.least.share)

    def _better_known(self, found: Identification) -> str:
        """Return which constant another result knows far better, in words."""
        errors = {}
        for name in ("inertia", "damping"):
            results = (self.result, found)
            if all(one.settings["kinds"][name] == "constant" for one in results):
                errors[name] = [one.value(name).stderr / abs(one.value(name).value) for one in results]
        best = max(errors, key=lambda one: errors[one][0] / errors[one][1], default=None)
        if best is None or not errors[best][1] <= _FAR_SMALLER * errors[best][0]:
            return ""
        before, after = errors[best]
        return f", and the error of {best} falls from {percent(before)} to {percent(after)}"
