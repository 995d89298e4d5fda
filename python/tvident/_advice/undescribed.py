"""What seems to act and is none of the known terms, or nothing at all, in words."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from tvident import _core
from tvident._arguments import listed
from tvident._equation import BUILT_IN

UNDESCRIBED = "something seems to act that none of the known terms describes"

_CURE = (
    "give a term of your own (tvident.Term) if you know what it is, as friction that grows less than the velocity does, or mask the "
    "samples at which it acts"
)

LAG_NOT_TOLD = (
    "what is left looks like a lag of the torque, but the record does not tell it from what changes: give lag='auto' to have errors hold "
    "whatever it is; if both channels are sampled at the same time, nothing need be done"
)


def drives(one: _core.Suspect) -> bool:
    """Return whether a suspect is friction with the wrong sign, which would drive the motion."""
    return one.value < 0 and one.name in BUILT_IN and BUILT_IN[one.name].dissipates


def driving(conspicuous: Sequence[_core.Suspect], units: Mapping[str, str]) -> list[str]:
    """Return what to make of friction that would drive the motion, where no other term seems to be missing.

    Parameters
    ----------
    conspicuous : sequence of _core.Suspect
        Those beyond chance, the surest first.
    units : mapping of str to str
        Of terms.
    """
    terms = [one for one in conspicuous if one.name in BUILT_IN]
    if not terms or not all(map(drives, terms)):
        return []
    amount = f"{terms[0].value:.3g} ± {terms[0].stderr:.1g} {units[terms[0].name]}"
    like = f"{_meaning(terms[0].name)}, by {amount}"
    return [f"{UNDESCRIBED}: what is left goes as {like}, which would drive the motion, as no friction does; {_CURE}"]


def in_vain(suspects: Sequence[_core.Suspect], tried: Collection[str]) -> list[str]:
    """Return that there is something, where trials show that all suspects explain nothing.

    Parameters
    ----------
    suspects : sequence of _core.Suspect
        Those beyond chance that can be what they are called.
    tried : collection of str
        Names of those with which nothing more is predicted.
    """
    if not suspects or not all(one.name in tried for one in suspects):
        return []
    alike = listed([_meaning(one.name) for one in suspects])
    return [f"{UNDESCRIBED}: what is left goes as {alike}, but with that nothing more is predicted; {_CURE}"]


def none_there(name: str, amount: str) -> str:
    """Return that a suspect is none, of which so much is found with it in the equation."""
    said = f"what is left looks like {_meaning(name)}, but is none: with it in the equation it is {amount}"
    return f"{said}; errors hold what it would change"


def _meaning(name: str) -> str:
    return BUILT_IN[name].meaning.partition(":")[0] if name in BUILT_IN else "a lag of the torque"
