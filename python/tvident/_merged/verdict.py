"""The first line of the summary of trials or masses: how well the elements are known, or why not to trust them."""

from __future__ import annotations

from typing import Any

import numpy as np

from tvident._equation import COEFFICIENTS
from tvident._merged.merging import Merging
from tvident._results import (
    CHANGING,
    found_marked,
    known_to,
    mostly_flagged,
    negative,
    relative_error,
    share_of,
    two_digits,
    unflagged,
    verdict_of_distrusted,
    verdict_of_trusted,
    why_not,
)

_SYMBOLS = {"inertia": "I", "damping": "C", "stiffness": "K"}
"""Of one mass."""

_MOST = 6
"""Elements that are told one by one."""


def verdict_of(result: Any, merging: Merging) -> str:
    """Return the verdict on what trials or masses share."""
    if not result.status.size:
        return "no verdict: there are no samples"
    lost = [name for name, verdict in result.identifiable.items() if not verdict]
    asked = [one.name for one in merging.elements if not one.is_known]
    if len(lost) == len(asked):
        return verdict_of_distrusted(result, "nothing can be known of what was asked")
    share: float | None = result._share  # noqa: SLF001 - of this room
    reason = result._distrusted or mostly_flagged(result)  # noqa: SLF001 - likewise
    if reason:
        return verdict_of_distrusted(result, reason)
    known = _known(result, merging)
    if lost:
        known += (
            f"{', ' if known else ''}{lost[0]}{f' and {len(lost) - 1} more' if len(lost) > 1 else ''} cannot be known"
        )
    return verdict_of_trusted(result, known, share)


def distrusted(result: Any, merging: Merging) -> str | None:
    """Return why no sample is to be trusted, in words; None where nothing says so."""
    if not result.status.size:
        return None
    return found_marked(result.advice) or why_not(result, lambda: _sign(result, merging), lambda: result._share)  # noqa: SLF001 - of this room


def _known(result: Any, merging: Merging) -> str:
    """Return how well elements are known; terms beside the equation are left to the table."""
    of_masses = merging.masses > 0
    found, lost = [], []
    for one in merging.elements:
        # Factors of a mechanism have names of their own, a term of a mass is called after both.
        if one.is_known or not (one.of in COEFFICIENTS or (of_masses and one.of == one.name)):
            continue
        relative = relative_error(result.elements[one.name], result.stderr[one.name], unflagged(result))
        if of_masses and relative is not None and relative >= 1:
            # Most entries of full matrices are zero.
            lost.append(one.name)
        elif relative is not None:
            name = one.name if of_masses else _SYMBOLS[one.of]
            found.append((f"{name}(t)" if result.kinds[one.name] in CHANGING else name, relative))
    if len(found) <= _MOST:
        words = known_to(found)
    else:
        found.sort(key=lambda one: one[1])
        ends = " to ".join(two_digits(100 * relative) for _, relative in (found[0], found[-1]))
        words = f"{len(found)} elements known to ± {ends} %, worst {found[-1][0]}"
    more = f" and {len(lost) - 1} more" if len(lost) > 1 else ""
    return ", ".join(filter(None, (words, f"{lost[0]}{more} not told from zero" if lost else "")))


def explained(result: Any, merging: Merging) -> float | None:
    """Return the least share of a torque's variance that the equations predict; None where the record is not there.

    See Also
    --------
    verdict_of : says it.
    """
    if not merging.parts:
        return None
    both = [[np.atleast_2d(one) for one in result.predicted_torque(trial)[1:]] for trial in range(merging.trials)]
    recorded, predicted = (np.concatenate([one[which] for one in both], axis=1) for which in range(2))
    shares = [share_of(*rows) for rows in zip(recorded, predicted, strict=True)]
    return min((share for share in shares if share is not None), default=None)


def _sign(result: Any, merging: Merging) -> str | None:
    """Return what is wrong with a sign: moving a mass takes energy, in whatever direction."""
    words = wrong_inertia(result, merging)
    if words or merging.masses or result.kinds["damping"] == "known":
        return words
    words = negative(result.damping, result.stderr["damping"])
    return f"damping {words}" if words else None


def wrong_inertia(result: Any, merging: Merging) -> str | None:
    """Return which inertia is negative, of trials or of a mass, and how often; None where that may be chance, or was given.

    See Also
    --------
    verdict_of : says it first.
    """
    if not merging.masses:
        words = negative(result.inertia, result.stderr["inertia"]) if result.kinds["inertia"] != "known" else None
        return f"inertia {words}" if words else None
    for mass in range(merging.masses):
        words = negative(result.inertia[mass, mass], result.stderr["inertia"][mass, mass])
        if words:
            return f"the inertia of mass {mass} {words}"
    return None
