"""Reasons and advice of expanded parameters, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._arguments import listed
from tvident._expansion import Expansion
from tvident._results import ExpandedParameter, WindowsBeside, Words

_DIFFERS = 2.0
"""Windows contradict a schedule where the mean squared difference, over its variance, is above this and chance."""

_STANDARD = 4.0
"""Standard deviations of chance."""

_SHOWN = 5
"""Jumps that are named."""

_LAST = 1 / 8
"""Of the sizes, by which it is seen whether more functions would explain more."""

_CHARGED = 2.0
"""What the criterion charges for a function."""

_EQUIVALENT = 4.0
"""Sizes whose criterion is at most so much higher are told from the best by chance."""


@dataclass(frozen=True)
class FoundExpansion:
    """What was found of an expanded parameter.

    Parameters
    ----------
    name, family : str
    size : int or (int, int)
    sizes : mapping of str to ndarray
        Those that were tried, with their criterion.
    largest : int
        The largest that may be.
    is_of_time : bool
    chosen : bool
        Whether the record chose the size.
    against_windows : (float, int)
        The mean squared difference from windows over its variance, and at how many.
    missed_jumps : sequence of float
        Seconds at which windows jump, and it does not.
    """

    name: str
    family: str
    size: Any
    sizes: Mapping[str, npt.NDArray[Any]]
    largest: int
    is_of_time: bool
    chosen: bool
    against_windows: tuple[float, int]
    missed_jumps: Sequence[float] = ()

    @property
    def is_contradicted(self) -> bool:
        """Whether windows find another parameter, or more functions would."""
        return bool(self.missed_jumps) or self._differs or self.needs_more

    @property
    def needs_more(self) -> bool:
        """Whether the largest sizes still explain so much more that what is left may be larger than noise makes a curve.

        The last eighth of the sizes then lowers the criterion by more than all functions are charged for.
        """
        tried, criterion = np.asarray(self.sizes["size"]), np.asarray(self.sizes["criterion"])
        if not self.chosen or tried.ndim > 1:
            return False
        is_last = tried > (1 - _LAST) * self.largest
        if is_last.all() or not is_last.any():
            return False
        return bool(criterion[~is_last].min() - criterion[is_last].min() > _CHARGED * self.largest)

    @property
    def _differs(self) -> bool:
        squares, count = self.against_windows
        if count < 2 or not np.isfinite(squares):  # noqa: PLR2004 - one window tells nothing
            return False
        # A mean of squares of so many standard normal numbers scatters by this.
        return bool(squares > max(_DIFFERS, 1 + _STANDARD * np.sqrt(2 / count)))

    def compared(self) -> tuple[list[str], list[str]]:
        """Return reasons and advice: whether windows agree, and what to do where they do not."""
        squares, count = self.against_windows
        jumps = _jumps(self)
        if count < 2 or not np.isfinite(squares):  # noqa: PLR2004 - one window tells nothing
            return [] if jumps else [f"{self.name}: not compared with windows"], jumps
        ratio = np.sqrt(squares)
        if self._differs:
            return [], [
                *jumps,
                _contradiction(self, f"it and {count} windows differ by {ratio:.2g} standard errors rms"),
            ]
        agree = f"{self.name}: the expansion and {count} windows agree: they differ by {ratio:.2g} standard errors rms"
        return [f"{agree}, beside the jump" if jumps else agree], jumps


def found_expansion(
    curve: ExpandedParameter,
    expansion: Expansion,
    windows: WindowsBeside | None,
    found: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]],
    time: npt.NDArray[np.float64],
) -> FoundExpansion:
    """Return what was found of an expanded parameter, beside windows in its place.

    Parameters
    ----------
    curve : ExpandedParameter
    expansion : Expansion
        As it was asked for.
    windows : WindowsBeside, optional
    found : (ndarray, ndarray), each of shape (n,)
        Values and errors of the parameter.
    time : ndarray, shape (n,)
        Seconds.
    """
    return FoundExpansion(
        curve.name,
        curve.family,
        curve.size,
        curve.sizes,
        expansion.largest,
        is_of_time=expansion.is_of_time,
        chosen=None in expansion.given_sizes,
        against_windows=(float("nan"), 0) if windows is None else windows.differ(*found),
        missed_jumps=() if windows is None else [float(time[at]) for at in windows.missed_jumps(*found)],
    )


def words_of_expansions(
    found: Sequence[FoundExpansion],
    observations: float,
    ratio: float,
    changing: Sequence[str],
    *,
    doubted: bool = False,
    determined: bool = True,
) -> Words:
    """Return how sizes were chosen, whether windows agree, and what to do where they do not.

    Parameters
    ----------
    found : sequence of FoundExpansion
    observations : float
        Independent equations.
    ratio : float
        What is left of the equations over their noise.
    changing : sequence of str
        Parameters that were to be constant unless a test rejects it, which windows reject.
    doubted : bool
        Whether windows in the place of functions of time find that parts of the record, or widths of the test function, contradict each
        other.
    determined : bool
        Whether the equations determine all factors.
    """
    reasons, advice = [], list[str]()
    if not determined:
        names = listed([one.name for one in found])
        advice.append(
            f"the equations do not determine all functions of {names}, so nothing is known: somewhere on their range no equation is "
            "left, or they follow the motion; take fewer, or use samples from the whole range"
        )
    for one in found:
        reasons.append(_size(one, observations))
        advice += _at_end(one)
        agreement, contradiction = one.compared()
        reasons += agreement
        advice += contradiction
    if doubted and not any(one.missed_jumps for one in found):
        names = listed([one.name for one in found])
        advice.append(
            f"windows in the place of {names} as functions of time leave parts of the record, or widths of the test function, that find "
            "different parameters: something jumps, or changes faster than either follows, and constants may be wrong, too; let it be "
            "windowed, and look at its residuals near the ends"
        )
    if np.isfinite(ratio):
        reasons.append(
            f"weighted by their noise and corrected for that of the angle, the equations leave {ratio:.2f} times what the noise explains"
        )
    if ratio > _core.NOISE_MODEL_FAILS:
        advice.append(
            "the equations leave more than the noise of the channels: a term may be missing, or parameters change in another way; "
            "standard errors follow from what is left"
        )
    if changing:
        advice.append(
            f"windows find changes of {listed(changing)}, taken as constant beside the expansion: expand it in time too, and compare"
        )
    return Words(tuple(reasons), tuple(advice))


def _size(one: FoundExpansion, observations: float) -> str:
    size = " x ".join(str(each) for each in np.atleast_1d(one.size))
    what = f"{one.name}: {size} functions ({one.family}) of {'time' if one.is_of_time else 'the channel'}"
    if not one.chosen:
        return f"{what}, as given"
    criterion = one.sizes["criterion"]
    lowest = float(np.min(criterion))
    others = int(np.sum(criterion <= lowest + _EQUIVALENT)) - 1
    averaged = "; the curve is the mean over sizes, each with its weight" if one.is_of_time and others else ""
    return (
        f"{what}: of {criterion.size} sizes the smallest whose criterion (AICc, {observations:.0f} independent equations) is within "
        f"{_EQUIVALENT:g} of the lowest; {others} larger ones are as good{averaged}"
    )


def _at_end(one: FoundExpansion) -> list[str]:
    """Return what to do where the largest size was taken: more may be better."""
    if one.needs_more:
        words = (
            f"{one.name} needs more than the {one.largest} functions that are tried: the last of them still explain more than chance does "
            "with all, and what is left moves the curve by more than its errors; raise largest=, or let it be windowed"
        )
        return [words]
    largest = int(np.max(np.atleast_1d(one.size)))
    if not one.chosen or 2 * largest <= one.largest:
        return []
    tried = np.asarray(one.sizes["size"])
    if largest < int(tried.max()) * 0.9:
        return []
    return [f"{one.name} takes nearly the largest size of {one.largest}: raise largest=, or let it be windowed"]


def _jumps(one: FoundExpansion) -> list[str]:
    """Return what to do about jumps that windows find and the functions do not follow."""
    if not one.missed_jumps:
        return []
    shown = ", ".join(f"{at:.4g}" for at in one.missed_jumps[:_SHOWN]) + (
        " …" if len(one.missed_jumps) > _SHOWN else ""
    )
    jump = "a jump" if len(one.missed_jumps) == 1 else f"{len(one.missed_jumps)} jumps"
    words = (
        f"windows find {jump} of {one.name} (at {shown} s) that the functions do not follow: other parameters make up for that and are "
        "wrong, too; let it be windowed, or expand it before and after apart"
    )
    return [words]


def _contradiction(one: FoundExpansion, said: str) -> str:
    """Return what to do where windows differ by more than chance."""
    if one.is_of_time:
        return f"the functions do not follow how {one.name} changes: {said}; take more, or another family, or let it be windowed"
    return (
        f"the schedule does not explain how {one.name} changes: {said}; {one.name} depends on something else too (add it as a second "
        "channel of the Expansion), or these functions are too coarse for it (try another family); otherwise let it be windowed"
    )
