"""What is worth changing in the equation of motion, found by trying it: advice must lead to the answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from tvident._arguments import percent, with_error
from tvident._equation import BUILT_IN, COEFFICIENTS
from tvident._identify.growths import GROWTHS
from tvident._identify.left_over import AS_GOOD, Left, Unexplained, unexplained
from tvident._identify.offered import (
    BEYOND_CHANCE,
    MATTERS,
    NEARLY_ALL,
    SUSPECTED,
    Remedy,
    are_distinguished,
    can_be,
    feeds_energy,
    holds,
    is_there,
    is_told,
    moved,
)
from tvident._results import Identification
from tvident._status import DOUBTFUL_RECORD, Status

_WORTH = 0.9
"""A change is worth it if the residuals' variance falls to this part or below."""

_NOTHING = 1.05
"""Stiffness is none if the residuals' variance without it is at most this many times that with it."""

_BETTER = 0.8
"""What is advised leaves at most this part of what the model at hand leaves unexplained of parts that are held back."""

_BETTER_BY_FAR = 0.5
"""The same where nothing contradicts the model at hand: then only a simpler one needs no more than that."""

_ENOUGH = 0.2
"""So much may be left by what nothing contradicts for no other suspect to be tried: each takes as long as to identify a part."""

_FAR_SMALLER = 1 / 3
"""What predicts as much is advised where an error falls to this part or below."""

_LEFT_OVER = Status.RANK_DEFICIENT | Status.ILL_CONDITIONED | Status.NOISE_MODEL | SUSPECTED | Status.CHANNEL_SUSPECTED
"""Flags of a record whose equations leave something over, or tell nothing apart."""

_CONTRADICTED = _LEFT_OVER | Status.SCALES_DISAGREE | Status.KIND_CONTRADICTED
"""Flags of a record whose model something contradicts."""

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
    is_as_asked : bool
        Whether the result is what ``identify`` gives for what was asked for.
    beyond_chance : sequence of str
        Those of them that explain a part of what the result leaves, beside all that it found to change.
    at_hand : Identification, optional
        What was found of these samples where they are a part of a record, which is what advice is about.
    """

    identify: Callable[..., Identification]
    result: Identification
    given: Mapping[str, Any]
    terms: Sequence[Any]
    suspects: Sequence[str]
    is_as_asked: bool = False
    beyond_chance: Sequence[str] = ()
    at_hand: Identification | None = None
    _now: dict[int | None, Unexplained] = field(default_factory=dict, init=False, repr=False)
    _beside: dict[int, dict[str, Identification]] = field(default_factory=dict, init=False, repr=False)

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

    @property
    def _worth(self) -> float:
        """What a model that is no simpler leaves at most of what the one at hand does not explain, to be advised."""
        return _BETTER if self.result.record_status & _CONTRADICTED else _BETTER_BY_FAR

    @property
    def _of_constants_alone(self) -> Call:
        """The call that finds everything constant."""
        constant = {name: "constant" if isinstance(kind, str) else kind for name, kind in self.given.items()}
        return constant | {"terms": list(self.terms), "lag": self.result.settings["lag"]}

    def _of_constants(self, call: Call) -> Remedy | None:
        """Return which suspects, or which stiffness of none, explain more where everything is constant."""
        chosen, best = [], self._spread(call)
        while rest := [one for one in self.suspects if one not in chosen]:
            left = {one: self._spread(self._with(call, one)) for one in rest}
            next_one = min(rest, key=left.__getitem__)
            if not (np.isfinite(left[next_one]) and left[next_one] <= _WORTH * best):
                break
            chosen.append(next_one)
            call, best = self._with(call, next_one), left[next_one]
        without = call | {"stiffness": 0.0}
        is_none = isinstance(self.given["stiffness"], str) and bool(self._spread(without) <= _NOTHING * best < np.inf)
        if self._explains_nothing and not chosen and not is_none:
            return None
        return self._compared(call, without if is_none else call, chosen)

    def _beside_changes(self) -> Remedy | None:
        """Return which one suspect explains more of what is held back, with parameters as they were asked for.

        Each gets lengths of its own: those that were chosen follow what is missing.
        """
        for found in self._each_beside_changes():
            left_of = {one: self._left_of(result) for one, result in found.items() if self._may_be(one, result)}
            best = min(left_of, key=lambda one: left_of[one].ratio, default=None)
            if best is not None and left_of[best].ratio <= self._worth:
                break
        else:
            return None
        left, result = left_of[best], found[best]
        if not (holds(left.least.share, result.record_status) and left.least.share < 1):
            return None
        words = f"{self._suspicion(best, result)}: try {self._change(best, result)}; {left}{self._moved(result)}"
        return Remedy(left.ratio, words, are_distinguished(result.record_status), share=left.least.share)

    def _beside_constant_stiffness(self) -> Remedy | None:
        """Return that the stiffness need not change beside what does, where that predicts more, or as much with far smaller errors.

        Where the motion is fast windows tell little of a stiffness: along a sweep they may tell it from an inertia nowhere.
        """
        if "varying" not in (self.result.settings["kinds"][name] for name in ("inertia", "damping")):
            return None
        found = self._tried({**self.given, "stiffness": "constant"}, self._of_constants_alone)
        if found is None or found.record_status & _CONTRADICTED:
            return None
        left, known = self._left_of(found), self._better_known(found)
        is_worth_it = left.ratio <= _BETTER or (left.is_as_much and known)
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

    def undoubted(self, suspects: Sequence[str]) -> tuple[str, str] | None:
        """Return the first suspect with which nothing else is suspected, if parameters are elsewhere then, and what to do in words.

        For where prediction tells nothing: of a short record so little is left beside what is held back that any model predicts it badly.
        """
        if self._explains_nothing or not (suspects and any(isinstance(kind, str) for kind in self.given.values())):
            return None
        for found in self._each_beside_changes():
            for one in suspects:
                result = found.get(one)
                if result is None or result.record_status & _LEFT_OVER or not self._may_be(one, result):
                    continue
                moved = self._moved(result)
                if moved:
                    change = self._change(one, result)
                    return (
                        one,
                        f"{self._suspicion(one, result)}: give {change}; then nothing else is suspected{moved}",
                    )
        return None

    def _each_beside_changes(self) -> Iterator[dict[str, Identification]]:
        """Yield what each suspect makes of the record: beside constants and stiffness as it was asked for, then as all was asked for.

        Inertia and damping that may change take the place of what is missing, so they change beside it only where they were found to,
        and where that explains more. Then a term is tried only if the result says so, which changes as much, or if it is there beside
        constants: that takes longest of all. A lag is followed by whatever changes, so it always is. Where nothing contradicts an
        equation beside constants, nothing changes beside it.
        """
        call = self._of_constants_alone
        constant = {name: call[name] if name != "stiffness" else kind for name, kind in self.given.items()}
        found = self.result.settings["kinds"]
        may_change = any(found[name] == "varying" and constant[name] != self.given[name] for name in COEFFICIENTS)
        for place, kinds in enumerate([constant, self.given] if may_change else [constant]):
            if place and self._needs_no_changes:
                return
            if place not in self._beside:
                there = [one for one, result in self._beside.get(0, {}).items() if is_there(one, result)]
                worth = {"lag", *self.beyond_chance, *there}
                suspects = [one for one in self.suspects if place == 0 or one in worth]
                self._beside[place] = self._tried_until_settled(kinds, call, suspects)
            yield self._beside[place]

    def _tried_until_settled(
        self, kinds: Mapping[str, Any], call: Call, suspects: Sequence[str]
    ) -> dict[str, Identification]:
        """Return what is found with one suspect after the other, up to the first that leaves nothing to explain."""
        tried = {}
        for one in suspects:
            found = self._tried(kinds, self._with(call, one))
            if found is not None:
                tried[one] = found
                if self._leaves_nothing(found, _ENOUGH) and self._may_be(one, found):
                    break
        return tried

    @property
    def _needs_no_changes(self) -> bool:
        """Whether nothing contradicts an equation that was tried beside constants, with a suspect that can be."""
        tried = self._beside.get(0, {})
        return any(not found.record_status & _CONTRADICTED and self._may_be(one, found) for one, found in tried.items())

    def _leaves_nothing(self, found: Identification, most: float = NEARLY_ALL) -> bool:
        """Return whether nothing that an equation mends contradicts a result, and it leaves at most so much of what was left."""
        contradicted = found.record_status & _CONTRADICTED & ~Status.CHANNEL_SUSPECTED
        return not contradicted and self._left_of(found).ratio <= most

    def _tried(self, kinds: Mapping[str, Any], call: Call) -> Identification | None:
        """Return what is found with other terms or another lag; None where that cannot be asked of the record."""
        try:
            return self.identify(**kinds, terms=call["terms"], lag=call["lag"], diagnose=True)
        except ValueError:
            return None

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
            suspects = [one for one in self.suspects if not self._spread(self._with(call, one)) <= _WORTH * best]
        given = [name for name in COEFFICIENTS if isinstance(self.given[name], str) and self.given[name] == "constant"]
        if given and self.result.record_status & Status.KIND_CONTRADICTED:
            free = self.identify(**(call | dict.fromkeys(given, "auto")))
            if not self._left_of(free).ratio <= _BETTER:
                return suspects, given
        return suspects, []

    def _may_be(self, one: str, found: Identification) -> bool:
        """Return whether a suspect is beyond chance, can be what it is called, and leaves a machine that can be."""
        return is_there(one, found) and not self._feeds_energy(found)

    def _feeds_energy(self, found: Identification) -> bool:
        """Return whether a machine has a negative inertia or damping with another equation only."""
        return feeds_energy(found) and not feeds_energy(self.result)

    def _with(self, call: Call, change: str) -> Call:
        return call | ({"lag": "auto"} if change == "lag" else {"terms": [*call["terms"], change]})

    @property
    def _explains_nothing(self) -> bool:
        is_lost = bool(self.result.record_status & Status.RANK_DEFICIENT)
        return is_lost and not any(np.isfinite(getattr(self.result, name)).any() for name in COEFFICIENTS)

    def _identified(self, call: Call, *, diagnose: bool = False) -> Identification:
        return self.identify(
            **(call | {"terms": [(term, "constant") for term in call["terms"]]}), **self._function, diagnose=diagnose
        )

    @cached_property
    def _function(self) -> dict[str, Any]:
        """Return the test function of trials: the one at hand, or, where that hears mostly noise, the widest that agrees."""
        settings = self.result.settings
        function = {name: settings[name] for name in ("window_length", "exponent")}
        scans = self.result._found.scans  # noqa: SLF001 - what was compared while it was identified
        if self.result.record_status & Status.ILL_CONDITIONED and scans and scans[0].plateau is not None:
            function["window_length"] = max(function["window_length"], scans[0].plateau[1])
        return function

    def _spread(self, call: Call) -> float:
        """Return the variance of the residuals where everything is constant."""
        try:
            found = self._identified(call)
        except ValueError:
            return np.inf
        if not all(is_there(one, found) for one in self.suspects if one in found.terms):
            return np.inf
        spread = found.residual_std[np.isfinite(found.residual_std)]
        return float(np.median(spread)) ** 2 if spread.size else np.inf

    def _left_of(self, found: Identification) -> Left:
        """Return what a result leaves unexplained, as far ahead as the longer of both test functions.

        One test function ahead is another distance for each, and what is near is predicted by anything.
        """
        lengths = [one.settings["window_length"] for one in (found, self.result)]
        ahead = max((length for length in lengths if isinstance(length, int)), default=None)
        if ahead not in self._now:
            self._now[ahead] = unexplained(self.result, ahead)
        now = self._now[ahead]
        return Left(now if found is self.result else unexplained(found, ahead), now)

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
        is_simple = is_as_good and not self._follows_time(call, changing)
        best, of_best = (left, found) if is_simple else (left_free, free)
        if not (is_simple or chosen or is_none):
            return None
        untold = [one for one in chosen if not is_told(one, of_best)]
        if untold:
            # Beside what changes it may be nothing.
            without, call = (
                one | {"terms": [term for term in one["terms"] if term not in untold]} for one in (before, asked)
            )
            return self._compared(without, call, [one for one in chosen if one not in untold])
        is_worth_it = best.least.share < 1 and best.ratio <= (_BETTER if is_simple else self._worth)
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

    def _moved(self, found: Identification, *, is_more: bool = True) -> str:
        """Return which parameters a better equation finds elsewhere, in words; one with more in it may find that they never varied."""
        unknown = [name for name in COEFFICIENTS if isinstance(self.given[name], str)]
        return moved(found, self.result, self.at_hand, unknown, is_more=is_more)

    def _change(self, one: str, found: Identification) -> str:
        """Return how a suspect is given."""
        if one == "lag":
            return f"lag={found.settings['lag']:.4g}"
        return f"terms={[term if isinstance(term, str) else term.name for term in (*self.terms, one)]}"

    def _suspicion(self, name: str, found: Identification) -> str:
        if name == "lag":
            late, rate = found.settings["lag"], found.settings["sample_rate"]
            error = found.settings.get("lag_stderr") or 0.0
            return f"the torque is {'late' if late > 0 else 'early'} by {with_error(abs(late) * rate, error * rate)} samples"
        value, error, *_ = found.value(name)
        return BUILT_IN[name].suspected(value, f"{with_error(value, error)} {found.units.get(name, '')}")
