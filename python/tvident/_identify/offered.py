"""What may be offered as another equation: what it would need to be, and what no machine is."""

from __future__ import annotations

from dataclasses import dataclass

from tvident._equation import BUILT_IN
from tvident._results import Identification, median_of
from tvident._status import DOUBTFUL_RECORD, Status

BEYOND_CHANCE = 4.0
"""Standard errors that a term must be away from nothing."""

NEXT_TO_NOTHING = 0.01
"""A share of the angle's variance that may stay unexplained whatever else is said."""

NEARLY_ALL = 0.1
"""What explains nearly all that was left leaves at most this part of it."""

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


def holds(share: float, flags: int) -> bool:
    """Return whether what is to be advised predicts next to everything, or nothing says that it cannot be trusted either."""
    if flags & Status.RANK_DEFICIENT:
        return False
    return share <= NEXT_TO_NOTHING or not flags & DOUBTFUL_RECORD
