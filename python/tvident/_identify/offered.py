"""What may be offered as another equation: what it would need to be, and what no machine is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tvident._arguments import with_error
from tvident._equation import BUILT_IN, COEFFICIENTS
from tvident._results import BECOMES, OF_WEAK_FORM, Identification, median_of
from tvident._status import DOUBTFUL_RECORD, Status

BEYOND_CHANCE = 4.0
"""Standard errors that a term must be away from nothing."""

NEXT_TO_NOTHING = 0.01
"""A share of the angle's variance that may stay unexplained whatever else is said."""

NEARLY_ALL = 0.1
"""What explains nearly all that was left leaves at most this part of it."""

_TOLD = 2.0
"""Standard errors that a term must be away from nothing to be named: they may hold what else is suspected."""

MATTERS = 0.01
"""A share of a parameter by which it must move to be told."""

_ELSEWHERE = 3.0
"""Standard errors from which on a better equation finds a parameter elsewhere."""

SUSPECTED = Status.TERM_SUSPECTED | Status.LAG_SUSPECTED
"""Flags of what may be missing."""

_CONTRADICTS, _BY_WEAK_FORM = 4.0, 0.02
"""Standard errors of both forms, and a share of the parameter, from which on the weak form contradicts the strong one.

Of records whose parameters change smoothly the strong form is off by less than that, beside its standard errors.
"""

_SCAN = "find out with result.scan() whether shorter windows agree"

_AGAINST = 0.1
"""A share of a weight that a negative stiffness beside it may have: with more the two are distinguished by nothing."""


@dataclass(frozen=True)
class Remedy:
    """What to change, in words.

    Parameters
    ----------
    ratio : float
        What it leaves unexplained, beside what the model at hand does.
    words : str
    distinguishes : bool
        All unknowns that there were, and one more, can be distinguished.
    is_settled : bool
        Nothing contradicts it.
    share : float
        Of what is held back, which it does not predict.
    """

    ratio: float
    words: str
    distinguishes: bool
    is_settled: bool = False
    share: float = 0.0

    @property
    def separates(self) -> bool:
        """Whether unknowns that cannot be distinguished follow from what is missing: with it they can, and next to nothing is left."""
        return self.distinguishes and self.ratio <= NEARLY_ALL


def are_distinguished(flags: int) -> bool:
    """Return whether unknowns can be distinguished."""
    return not flags & (Status.ILL_CONDITIONED | Status.RANK_DEFICIENT)


def is_there(name: str, found: Identification) -> bool:
    """Return whether a term or a lag is beyond chance, and can be what it is called."""
    if name == "lag":
        value, error = found.settings["lag"], found.settings.get("lag_stderr") or 0.0
    else:
        value, error, *_ = found.value(name)
    return bool(abs(value) > BEYOND_CHANCE * error) and can_be(name, found)


def is_told(name: str, found: Identification) -> bool:
    """Return whether a term that constants alone needed is more than its error beside what changes."""
    value, error, *_ = found.value(name)
    return bool(abs(value) > _TOLD * error)


def can_be(name: str, found: Identification) -> bool:
    """Return whether friction resists the motion, and a weight pulls without a negative spring beside it."""
    term = BUILT_IN.get(name)
    if term is None:
        return True
    value, *_ = found.value(name)
    if term.spring == "instead":
        return value > 0 and found.value("stiffness").value >= -_AGAINST * value
    return value > 0 or not term.dissipates


def feeds_energy(found: Identification) -> bool:
    """Return whether inertia or damping is negative beyond chance: a stiffness may be, as about an unstable position."""
    for name in ("inertia", "damping"):
        if found.settings["kinds"][name] == "known":
            continue
        value, error = median_of(found, name)
        if value < -BEYOND_CHANCE * error:
            return True
    return False


def is_right(found: Identification) -> bool:
    """Return whether inertia, damping and stiffness are positive beyond chance."""
    return all(one.value > BEYOND_CHANCE * one.stderr for one in map(found.value, COEFFICIENTS))


def holds(share: float, flags: int) -> bool:
    """Return whether what is to be advised predicts next to everything, or nothing says that it cannot be trusted either."""
    if flags & Status.RANK_DEFICIENT:
        return False
    return share <= NEXT_TO_NOTHING or not flags & DOUBTFUL_RECORD


def moved(
    found: Identification,
    before: Identification,
    at_hand: Identification | None,
    unknown: Sequence[str],
    *,
    is_more: bool,
) -> str:
    """Return which parameters a better equation finds elsewhere, in words.

    Parameters
    ----------
    found : Identification
        With the better equation.
    before : Identification
        Of the same samples, with the equation at hand.
    at_hand : Identification, optional
        What the whole record tells of them, where they are a part of it.
    unknown : sequence of str
        What was not given.
    is_more : bool
        Whether the better equation has more in it: then it may find that parameters never varied.
    """
    kinds, now, words = found.settings["kinds"], at_hand or before, []
    # What changes has that median there, and another elsewhere.
    begin, end = found.time[[0, -1]].tolist()
    digits = max(0, 2 - math.floor(math.log10(end - begin))) if end > begin else 0
    place = "" if at_hand is None else f" at {begin:.{digits}f}-{end:.{digits}f} s"
    for name in unknown:
        if kinds[name] == "known":
            continue
        (was, error), (is_now, least) = median_of(now, name), median_of(found, name)
        if kinds[name] == now.settings["kinds"][name] and now.record_status & SUSPECTED:
            # Errors beside something that is suspected hold what it changes, which is asked here.
            error = least
        is_moved = abs(is_now - was) > max(_ELSEWHERE * np.hypot(error, least), MATTERS * abs(is_now))
        is_settled = is_more and before.settings["kinds"][name] == "varying" and kinds[name] == "constant"
        if is_moved or is_settled:
            where = " and constant" + place if is_settled else place if kinds[name] != "constant" else ""
            words.append(f", {name}{BECOMES}{with_error(is_now, least)} {found.units[name]}{where}")
    return "".join(words)


def contradicted(
    weak: Identification, strong: Mapping[str, tuple[float, float]], begin: float = 0.0, cure: str = _SCAN
) -> str | None:
    """Return which parameters the weak form finds elsewhere with the same equation, in words; None where it finds the same.

    Spikes, clipped samples and places at which parts are joined spoil every polynomial that holds one, and polynomials that are too smooth
    take from the acceleration: the strong form shows none of that in its errors.

    Parameters
    ----------
    weak : Identification
        Of a part of a record; nothing contradicts it.
    strong : mapping of str to (float, float)
        What the strong form finds of the same samples, with errors, of what was not given.
    begin : float, optional
        Time of the first sample of a record whose times are not those of the part.
    cure : str, optional
        What else can be done about it.
    """
    words = []
    for name, (was, error) in strong.items():
        value, least = median_of(weak, name)
        if abs(value - was) > max(_CONTRADICTS * np.hypot(error, least), _BY_WEAK_FORM * abs(value)):
            words.append(f"{name}{BECOMES}{with_error(value, least)} {weak.units[name]}")
    if not words:
        return None
    first, end = (begin + weak.time[[0, -1]]).tolist()
    return f"{OF_WEAK_FORM} at {first:.4g}-{end:.4g} s, and nothing contradicts them: {', '.join(words)}: use method='auto', or {cure}"
