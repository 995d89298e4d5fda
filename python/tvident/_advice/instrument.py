"""Reasons and advice of an identification with an instrument, in words, and where one is missing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._arguments import listed
from tvident._results import FED_BACK, Words
from tvident._status import Status


def words_with_instrument(found: _core.Identification, names: Sequence[str]) -> Words:
    """Return what the instrument did in one record, and what to do if it tells too little, or unknowns change."""
    test = found.instrument
    probability, strength = (float("nan"), 0.0) if test is None else (test.exogeneity, test.strength)
    if Status.RANK_DEFICIENT in Status(found.record_status):
        cure = "it does not move the system in as many ways as there are unknowns, or is no channel of this record"
        return Words((), (f"the instrument does not determine the unknowns: {cure}: excite more frequencies",))
    windows = f"windows of {found.window_length} samples"
    form = (
        f"weak form, {windows}"
        if found.exponent is not None
        else f"strong form, {windows}, in which polynomials follow the motion"
    )
    how = (
        f"two-stage least squares with the instrument, {form}; all unknowns are constant; "
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
        constant, changing = _constancy(found, names)
        return Words((*reasons, *constant), tuple(changing))
    weak = (
        f"the instrument is weak: F statistic of the first stage {strength:.2g}, where 10 is needed; estimates are biased towards least "
        "squares and errors are too small: excite more, over a longer record, or take a channel nearer to the excitation"
    )
    return Words(tuple(reasons), (weak,))


def _constancy(found: _core.Identification, names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return what parts of the record say of the unknowns: which are constant, and what to do about those that are not."""
    tests = {name: one.test for name, one in zip(names, found.unknowns, strict=True)}
    chances = {name: test.probability for name, test in tests.items() if test is not None}
    constant = {name: chance for name, chance in chances.items() if chance >= _core.NO_CHANCE}
    reasons = []
    if constant:
        probabilities = ", ".join(f"{chance:.2g}" for chance in constant.values())
        who = listed(list(constant))
        reasons.append(
            f"{who} constant: noise explains the differences between parts of the record (p = {probabilities})"
        )
    untested = [name for name in tests if name not in chances]
    if untested:
        reasons.append(f"{listed(untested)} constant: not tested, since single parts of the record tell too little")
    # What changes makes estimates of the others change, too: the one that does so by the least chance comes first.
    differing = sorted((name for name in chances if name not in constant), key=chances.__getitem__)
    if not differing:
        return reasons, []
    many = "differs" if len(differing) == 1 else "differ"
    cure = (
        "with an instrument all unknowns are constant, and none of them is right where one changes: identify parts of the record within "
        "which they stay the same, each with its part of the instrument, or give what changes as known"
    )
    return reasons, [f"{listed(differing)} {many} between parts of the record by more than chance: {cure}"]


def fed_back(coherence: float | None) -> list[str]:
    """Return what to do where the noise of angle and torque is coherent above the motion."""
    if coherence is None or coherence < _core.CORRELATED_NOISE:
        return []
    words = (
        f"{FED_BACK} (coherence {coherence:.2f} above the motion): a controller feeds it back, and "
        "estimates are biased: give the reference or another channel that moves the system as instrument="
    )
    return [words]


def fed_back_in_records(
    angles: npt.NDArray[np.number], torques: npt.NDArray[np.number], inertias: list[float], lags: list[float]
) -> list[tuple[int, str]]:
    """Return the same by record, where nothing is known of the noise yet."""
    variances = [one.sigma**2 for one in _core.noise(angles)]
    coherences = _core.noise_coherence(angles, torques, variances, inertias, lags)
    return [(record, line) for record, coherence in enumerate(coherences) for line in fed_back(coherence)]
