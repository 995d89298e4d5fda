"""Which unknowns of a record cannot be distinguished, and why: in words."""

from __future__ import annotations

from collections.abc import Sequence

from tvident import _core
from tvident._arguments import listed
from tvident._equation import BUILT_IN
from tvident._status import Status

NOT_DISTINGUISHED = "cannot be distinguished"
"""Stands in the sentence: what else looks wrong may follow from it."""

_BOTH_SIGNS = (
    "an inertia that changes has both signs, or the stiffness beside it does: where windows hold one frequency the two trade places; make "
    "constant what need not change, give one of them as known, or excite two frequencies at once"
)
"""What to do where signs alone tell that unknowns were not distinguished."""

_TAKES_PART = 0.3
"""A constant that has at least this share in the worst determined combination is named."""


def collinear(found: _core.Identification, names: Sequence[str]) -> list[str]:
    """Return which constants are nearly collinear, or that signs contradict each other, and what would separate them.

    Parameters
    ----------
    found : _core.Identification
        In weak form.
    names : sequence of str
        What its unknowns are called.
    """
    if not found.record_status & Status.ILL_CONDITIONED or found.unexplained:
        return []
    if not found.mostly_noise and found.constants_condition <= _core.HARDLY_TOLD_APART:
        return [_BOTH_SIGNS]
    kinds = {name: one.kind for name, one in zip(names, found.unknowns, strict=True)}
    constants = [name for name, kind in kinds.items() if kind == "constant"]
    # Varying parameters come first among the shares.
    shares = found.weakest[len(found.weakest) - len(constants) :]
    parts = [name for name, part in zip(constants, shares, strict=True) if abs(part) > _TAKES_PART]
    if len(parts) == 1 and kinds.get("stiffness", "constant") != "constant":
        parts.append("stiffness")
    told = listed(parts) if len(parts) > 1 else "the parameters"
    noise = ", and what separates them is mostly noise of the angle" if found.mostly_noise else ""
    of_angle = [name for name in parts if name in BUILT_IN and BUILT_IN[name].is_of_angle]
    if of_angle and len({*of_angle, *parts} & {*of_angle, "stiffness"}) > 1:
        cure = (
            "as far as the angle moves they are nearly the same function of it: leave one of them out, give one as known, or record larger "
            "angles"
        )
    else:
        cure = "a single frequency does not separate them; excite two or more, or give one of them as known"
    return [
        f"{told} {NOT_DISTINGUISHED}: they are nearly collinear{noise} (condition {found.constants_condition:.0f}): {cure}"
    ]
