"""Reasons and advice of an identification with an instrument, in words."""

from __future__ import annotations

from tvident import _core
from tvident._results import Words
from tvident._status import Status


def words_with_instrument(found: _core.Identification) -> Words:
    """Return what the instrument did in one record, and what to do if it tells too little."""
    probability, strength = found.instrument or (float("nan"), 0.0)
    if Status.RANK_DEFICIENT in Status(found.record_status):
        cure = "it does not move the system in as many ways as there are unknowns, or is no channel of this record"
        return Words((), (f"the instrument does not determine the unknowns: {cure}: excite more frequencies",))
    form = "weak" if found.exponent is not None else "strong"
    how = (
        f"two-stage least squares with the instrument, {form} form, windows of {found.window_length} samples; all unknowns are constant; "
        "standard errors from tapered sums of the residuals' scores"
    )
    reasons = [how]
    chance = f"p = {probability:.2g}, test of exogeneity"
    if probability < _core.NO_CHANCE:
        reasons.append(f"least squares without the instrument are biased: noise reaches the regressors ({chance})")
    else:
        reasons.append(f"least squares without the instrument agree with these estimates ({chance})")
    if strength >= _core.WEAK_INSTRUMENT:
        reasons.append(f"the instrument is strong: F statistic of the first stage {strength:.3g} (10 is enough)")
        return Words(tuple(reasons), ())
    weak = (
        f"the instrument is weak: F statistic of the first stage {strength:.2g}, where 10 is needed; estimates lean towards least squares "
        "and errors are too small: excite more, over a longer record, or take a channel nearer to the excitation"
    )
    return Words(tuple(reasons), (weak,))
