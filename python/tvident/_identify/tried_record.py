"""A record that is identified again with another equation, and what that leaves unexplained."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from tvident._arguments import with_error
from tvident._equation import BUILT_IN, COEFFICIENTS
from tvident._identify.left_over import Left, Unexplained, unexplained
from tvident._identify.offered import MATTERS, NEARLY_ALL, SUSPECTED, feeds_energy, is_there, moved
from tvident._results import Identification, median_of
from tvident._status import Status

WORTH = 0.9
"""A change is worth it if the residuals' variance falls to this part or below."""

BETTER = 0.8
"""What is advised leaves at most this part of what the model at hand leaves unexplained of parts that are held back."""

_BETTER_BY_FAR = 0.5
"""The same where nothing contradicts the model at hand: then only a simpler one needs no more than that."""

LEFT_OVER = Status.RANK_DEFICIENT | Status.ILL_CONDITIONED | Status.NOISE_MODEL | SUSPECTED | Status.CHANNEL_SUSPECTED
"""Flags of a record whose equations leave something over, or tell nothing apart."""

CONTRADICTED = LEFT_OVER | Status.SCALES_DISAGREE | Status.KIND_CONTRADICTED
"""Flags of a record whose model something contradicts."""

_APART, _KNOWN, _MOSTLY = 4.0, 0.1, 0.9
"""A parameter stays what it is where it is so many errors away, these are at most such a part of it, and both at so many of the samples."""

_LEAST_LAG = 0.02
"""A lag of so few samples is told only where it moves a parameter, as in the core."""

_MOST_OF_LAG = 0.5
"""A lag stays what it is where so much of it is left beside what resists the motion."""

_BY_CHANCE = 2.0
"""Standard errors of what is left by which a lag may differ from what it was."""

Call = dict[str, Any]

Names = tuple[str, ...]
"""Terms, and ``"lag"``, that are tried together."""


@dataclass(frozen=True)
class TriedRecord:
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
    others : sequence of str
        Terms that nothing suspects and that a first look may find.
    whole : Identification, optional
        What was found of the whole record, where a part of it is tried.
    """

    identify: Callable[..., Identification]
    result: Identification
    given: Mapping[str, Any]
    terms: Sequence[Any]
    suspects: Sequence[str]
    is_as_asked: bool = False
    beyond_chance: Sequence[str] = ()
    at_hand: Identification | None = None
    others: Sequence[str] = ()
    whole: Identification | None = None
    _now: dict[int | None, Unexplained] = field(default_factory=dict, init=False, repr=False)
    _beside: dict[int, dict[Names, Identification]] = field(default_factory=dict, init=False, repr=False)

    @property
    def _worth(self) -> float:
        """What a model that is no simpler leaves at most of what the one at hand does not explain, to be advised."""
        return BETTER if self.result.record_status & CONTRADICTED else _BETTER_BY_FAR

    @property
    def _of_constants_alone(self) -> Call:
        """The call that finds everything constant."""
        constant = {name: "constant" if isinstance(kind, str) else kind for name, kind in self.given.items()}
        return constant | {"terms": list(self.terms), "lag": self.result.settings["lag"]}

    def _tried(self, kinds: Mapping[str, Any], call: Call) -> Identification | None:
        """Return what is found with other terms or another lag; None where that cannot be asked of the record."""
        try:
            return self.identify(**kinds, terms=call["terms"], lag=call["lag"], diagnose=True)
        except ValueError:
            return None

    def _leaves_nothing(self, found: Identification, most: float = NEARLY_ALL) -> bool:
        """Return whether nothing that an equation mends contradicts a result, and it leaves at most so much of what was left."""
        contradicted = found.record_status & CONTRADICTED & ~Status.CHANNEL_SUSPECTED
        return not contradicted and self._left_of(found).ratio <= most

    def _may_be(self, names: Names, found: Identification) -> bool:
        """Return whether suspects are beyond chance, can be what they are called, and leave a machine that can be."""
        if not all(is_there(one, found) for one in names) or self._feeds_energy(found):
            return False
        return "lag" not in names or self._is_late(found)

    def _lag_beside(self, found: Identification) -> float:
        """Return by how many samples the torque of a result is late beside the lag that is there already."""
        return float((found.settings["lag"] - self.result.settings["lag"]) * found.settings["sample_rate"])

    def _is_late(self, found: Identification) -> bool:
        """Return whether the lag of a result is worth a word, and about the same beside what resists the motion.

        Sums over samples leave something of integrals, which looks like a lag of next to nothing. Friction that is smooth looks like one:
        most of such a lag is gone beside dry friction and drag, which hardly change a true one.
        """
        if abs(self._lag_beside(found)) < _LEAST_LAG and not self._moved(found, is_more=False):
            return False
        kinds = found.settings["kinds"]
        resisting = [name for name, one in BUILT_IN.items() if one.dissipates and not one.inner and name not in kinds]
        if not resisting:
            return True
        is_constant = {name: isinstance(kind, str) and kinds[name] == "constant" for name, kind in self.given.items()}
        asked = {name: "constant" if is_constant[name] else kind for name, kind in self.given.items()}
        own = {term.name: term for term in self.terms if not isinstance(term, str)}
        terms = [(own.get(name, name), kind) for name, kind in kinds.items() if name not in COEFFICIENTS]
        lengths = {name: found.settings[name] for name in ("window_length", "exponent")}
        if "windowed" in kinds.values():
            lengths["regression_window"] = found.settings["regression_window"]
        try:
            terms += [(name, "constant") for name in resisting]
            beside = self.identify(**asked, terms=terms, lag="auto", **lengths)
        except ValueError:
            return True
        late, left, error = self._lag_beside(found), self._lag_beside(beside), beside.settings.get("lag_stderr")
        if error is None:
            return True
        chance = _BY_CHANCE * error * found.settings["sample_rate"]
        return left * late >= _MOST_OF_LAG * late**2 or abs(late - left) <= chance

    def _feeds_energy(self, found: Identification) -> bool:
        """Return whether a machine has a negative inertia or damping with another equation only."""
        return feeds_energy(found) and not feeds_energy(self.result)

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

    def _stays(self, names: Sequence[str], found: Identification) -> bool:
        """Return whether parameters that are constant in a part of a record are known to be the same elsewhere in it.

        A part tells what is missing, and not what changes beside it.
        """
        if self.whole is None:
            return True
        for name in names:
            values, errors = getattr(self.whole, name), self.whole.stderr[name]
            value, error = median_of(found, name)
            least = MATTERS * abs(value)
            near = np.abs(values - value) <= np.maximum(_APART * np.hypot(errors, error), least)
            if not np.mean(near & (errors <= np.maximum(_KNOWN * abs(value), least))) >= _MOSTLY:
                return False
        return True

    def _with(self, call: Call, *changes: str) -> Call:
        terms = [one for one in changes if one != "lag"]
        return call | {"terms": [*call["terms"], *terms]} | ({"lag": "auto"} if "lag" in changes else {})

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

    def _moved(self, found: Identification, *, is_more: bool = True) -> str:
        """Return which parameters a better equation finds elsewhere, in words; one with more in it may find that they never varied."""
        unknown = [name for name in COEFFICIENTS if isinstance(self.given[name], str)]
        return moved(found, self.result, self.at_hand, unknown, is_more=is_more)

    def _change(self, names: Names, found: Identification) -> str:
        """Return how suspects are given, and what was constant beside them that changes at hand."""
        terms = [one for one in names if one != "lag"]
        shown = [term if isinstance(term, str) else term.name for term in (*self.terms, *terms)]
        changes = [f"terms={shown}"] if terms else []
        changes += [f"lag={found.settings['lag']:.4g}"] if "lag" in names else []
        now, then = self.result.settings["kinds"], found.settings["kinds"]
        settled = [one for one in ("inertia", "damping") if (now[one], then[one]) == ("varying", "constant")]
        return ", ".join([*changes, *(f"{one}='constant'" for one in settled if self._stays([one], found))])

    def _suspicions(self, names: Sequence[str], found: Identification) -> str:
        return ", ".join(self._suspicion(name, found) for name in names)

    def _suspicion(self, name: str, found: Identification) -> str:
        if name == "lag":
            late, rate = found.settings["lag"], found.settings["sample_rate"]
            error = found.settings.get("lag_stderr") or 0.0
            return f"the torque is {'late' if late > 0 else 'early'} by {with_error(abs(late) * rate, error * rate)} samples"
        value, error, *_ = found.value(name)
        return BUILT_IN[name].suspected(value, f"{with_error(value, error)} {found.units.get(name, '')}")
