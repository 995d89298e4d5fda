"""The first line of a summary: how well the parameters are known, or why not to trust them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._arguments import explained_in_words, percent, percentiles, to_digits_of, told_once
from tvident._results.measured import number_of
from tvident._results.torque import noise_of_compared
from tvident._results.words import BECOMES, CONDITIONS, MARKED, OF_WEAK_FORM, OTHER_UNIT, STAYS, TRIED, UNFOLLOWED
from tvident._status import Status
from tvident._units import in_words_of

SYMBOLS = {"stiffness": "K", "inertia": "I", "damping": "C"}
"""In the order in which they are told."""

CHANGING = frozenset({"windowed", "varying", "expanded"})
"""Kinds of parameters that have a value for every sample."""

_LITTLE = 0.5
"""A share of the torque that a model must explain to be one."""

_AS_NOISE, _MORE = 1.5, 0.1
"""What is left of a torque is its noise up to so many times its variance, and what is predicted is at least this part of it."""

_DISTRUST = {
    Status.RANK_DEFICIENT: "the record does not determine the parameters",
    Status.ILL_CONDITIONED: "the record hardly tells the parameters apart",
}

_DOUBTS = (
    Status.NOISE_MODEL
    | Status.KIND_CONTRADICTED
    | Status.WINDOW_LIMIT
    | Status.LAG_SUSPECTED
    | Status.TERM_SUSPECTED
    | Status.CHANNEL_SUSPECTED
)
"""Flags of a record with which errors hold only if the model does."""

_CONTRADICTED = _DOUBTS & ~Status.WINDOW_LIMIT | Status.COLOURED | Status.SCALES_DISAGREE | Status.ILL_CONDITIONED
"""Flags of a record that contradict its equations."""

_CARRIED = Status.GAP | Status.ILL_CONDITIONED
"""Flags of a sample in a gap that is farther from any equation than a window tells."""

RECORDS = 100
"""Of a batch that are looked at."""


@dataclass(frozen=True)
class ExplainedTorque:
    """How much of the torque of a record its model explains, kept where the recording is not.

    Parameters
    ----------
    share : float or None
        Of the variance; None where that is not known.
    is_rest_noise : bool
        Whether the rest is no more than the torque's noise.
    """

    share: float | None
    is_rest_noise: bool


def explained_of(result: Any) -> ExplainedTorque:
    """Return how much of the torque of one record is explained, as the verdict asks."""
    return ExplainedTorque(explained(result), _is_rest_noise(result))


def verdict(result: Any, share: float | None = None) -> str:
    """Return the verdict on a result of one record or of several; `share` of the torque that is explained, where that is known already."""
    return in_words_of(result.units, _verdict(result, share))


def _verdict(result: Any, share: float | None) -> str:
    if not result.status.size:
        return "no verdict: there are no samples"
    if result.inertia.ndim == 1:
        return _of_one(result, share)
    shape = result.inertia.shape[:-1]
    count = int(np.prod(shape, dtype=int))
    places = list(np.ndindex(shape))[:RECORDS]
    each = zip(places, result._distrusted, strict=False)  # noqa: SLF001 - of this room
    reasons = {
        place: words
        for place, reason in each
        if (words := reason or mostly_flagged(result[place if len(place) > 1 else place[0]]))
    }
    known = how_well_known(result)
    words = f"{count} records: {known}" if known else f"{count} records"
    if len(places) < count:
        words += f"; the first {len(places)} were looked at"
    if not reasons:
        return f"{words}; no reason to distrust any"
    first = next(iter(reasons))
    where = first[0] if len(first) == 1 else first
    return f"{words}; do not trust {len(reasons)} of them, such as record {where}: {reasons[first]}"


def _of_one(result: Any, known: float | None) -> str:
    if known is not None:
        result._share = (known,)  # noqa: SLF001 - of this room
    reason = result._distrusted[0] or mostly_flagged(result)  # noqa: SLF001 - likewise
    if reason:
        return verdict_of_distrusted(result, reason)
    return verdict_of_trusted(result, how_well_known(result), explained(result))


def found_marked(advice: Sequence[str]) -> str | None:
    """Return that numbers may never have been measured, in words, where advice asks about them."""
    if any(MARKED in line for line in advice):
        return "numbers that may mark missing values count as measured"
    return None


def found_elsewhere(advice: Sequence[str]) -> str | None:
    """Return which parameters an equation that explains more, or the weak form, finds elsewhere, in words."""
    names = [name for name in SYMBOLS if any(f" {name}{BECOMES}" in line for line in advice)]
    if not names:
        return None
    others = f"finds another {' and another '.join(names)}"
    if any(line.startswith(OF_WEAK_FORM) for line in advice):
        return f"the weak form {others}"
    return f"another equation explains more, and {others}"


def unfollowed(advice: Sequence[str]) -> str | None:
    """Return which parameters that were to vary if they do differ between parts of a record that nothing explains, in words."""
    names = [name for name in SYMBOLS if any(f"{name}{UNFOLLOWED}" in line for line in advice)]
    return (
        f"{' and '.join(names)} {'differs' if len(names) == 1 else 'differ'} between parts of the record for another reason"
        if names
        else None
    )


def verdict_of_distrusted(result: Any, reason: str) -> str:
    """Return the verdict on a result that something says to distrust."""
    return f"do not trust: {reason}{'; see what to do' if result.advice else ''}"


def verdict_of_trusted(result: Any, known: str, share: float | None) -> str:
    """Return the verdict on a result that nothing says to distrust, by how well it is known and by how much of the torque it explains."""
    parts = [known] if known else []
    if share is not None:
        rest = ", the rest is its noise" if share < _LITTLE else ""
        parts.append(f"model explains {percent(share)} of the torque{rest}")
    words = ", ".join(parts) or "nothing was unknown"
    is_doubtful = result.record_status & _DOUBTS and result.advice
    if is_doubtful or any(one in line for line in result.advice for one in (TRIED, *CONDITIONS)):
        return f"{words}; errors hold if the model does: see what to do"
    if any(asked in line for asked in OTHER_UNIT for line in result.advice):
        return f"{words}; all in other units if a channel is: see what to do"
    return words


def explained(result: Any) -> float | None:
    """Return the share of the torque's variance that a record's model predicts; None where the record is not there."""
    before: ExplainedTorque | None = result._explained_before  # noqa: SLF001 - of this room
    if before is not None:
        return before.share
    if result._share is None:  # noqa: SLF001 - of this room
        try:
            _, recorded, predicted = result.predicted_torque()
        except ValueError:
            return None
        result._share = (share_of(recorded, without_carried(result, predicted)),)  # noqa: SLF001 - likewise
    share: float | None = result._share[0]  # noqa: SLF001 - likewise
    return share


def without_carried(result: Any, predicted: Any) -> Any:
    """Return a prediction without samples in a gap, as of a mask, into which values are carried from beside it: nobody knows them there."""
    carried = result.status & _CARRIED == _CARRIED
    if not carried.any():
        return predicted
    places = np.minimum(np.arange(predicted.size) // result.settings["step"], carried.size - 1)
    return np.where(carried[places], np.nan, predicted)


def _is_rest_noise(result: Any) -> bool:
    """Return whether a record's torque is more than its own noise, and what constants do not predict is no more than that.

    What changes follows noise as well.
    """
    before: ExplainedTorque | None = result._explained_before  # noqa: SLF001 - of this room
    if before is not None:
        return before.is_rest_noise
    if CHANGING & set(result.settings["kinds"].values()):
        return False
    kept = result._recorded  # noqa: SLF001 - the channel itself, beside what is compared
    try:
        _, recorded, predicted = result.predicted_torque()
    except ValueError:
        return False
    there = np.isfinite(recorded) & np.isfinite(predicted)
    noise = noise_of_compared(kept.torques, result.settings)
    left, whole = (float(np.var(one[there])) for one in (recorded - predicted, recorded))
    return left <= _AS_NOISE * noise and whole - left >= _MORE * noise


def share_of(recorded: Any, predicted: Any) -> float | None:
    """Return the share of a torque's variance that is predicted."""
    there = np.isfinite(recorded) & np.isfinite(predicted)
    spread = float(np.var(recorded[there])) if there.any() else 0.0
    return 1 - float(np.var((recorded - predicted)[there])) / spread if spread > 0 else None


def distrusted(result: Any) -> tuple[str | None, ...]:
    """Return why no sample of a record is to be trusted, in words, None where nothing says so; of a batch, of its first hundred records."""
    if not result.status.size:
        return (None,)
    if result.inertia.ndim == 1:
        return (_distrusted(result, result.advice),)
    places = list(np.ndindex(result.inertia.shape[:-1]))[:RECORDS]
    return tuple(_distrusted_in_batch(result[place if len(place) > 1 else place[0]]) for place in places)


def _distrusted_in_batch(result: Any) -> str | None:
    # Without what is tried of a record alone, which takes as long as to identify it, but where something is seen that spoils it.
    advice = result._chosen.advice  # noqa: SLF001 - of this room
    return _distrusted(result, result.advice if any(STAYS in line for line in advice) else advice)


def _distrusted(result: Any, advice: Sequence[str]) -> str | None:
    # What was never measured is what else looks wrong.
    return (
        found_marked(advice)
        or why_not(result, lambda: wrong_sign(result), lambda: explained(result), lambda: _is_rest_noise(result))
        or found_elsewhere(advice)
        or unfollowed(advice)
        or ("its arrays were written over before it was looked at" if _is_written_over(result) else None)
    )


def distrusted_at_once(result: Any) -> str | None:
    """Return why no sample of a record is to be trusted by flags and signs, which tell it without a look at the recording."""
    return why_not(result, lambda: wrong_sign(result), lambda: None)


def wrong_sign(result: Any) -> str | None:
    """Return which parameter has a sign that no machine has, in words, of a result or of rows of one; None where none has."""
    signs = (_sign(result, name) for name in ("inertia", "damping", "stiffness"))
    return next(filter(None, signs), None)


def _is_written_over(result: Any) -> bool:
    recorded = result._recorded  # noqa: SLF001 - of this room
    return recorded is not None and not recorded.is_unchanged


def why_not(
    result: Any,
    sign: Callable[[], str | None],
    share: Callable[[], float | None],
    is_noise: Callable[[], bool] = lambda: False,
) -> str | None:
    """Return why no number is to be trusted, by flags, by what is wrong with a sign, and by the share of the torque explained.

    A little of the torque is enough where the rest is its noise.
    """
    valid = result.status & Status.INVALID == 0
    if not valid.any():
        return "nothing could be identified"
    # A sign that no machine has tells more than the flag that goes with it.
    reason = sign() or next((words for flag, words in _DISTRUST.items() if result.record_status & flag), None)
    if reason:
        return reason
    if result.record_status & Status.SCALES_DISAGREE:
        return "test functions or windows of other lengths do not find these parameters"
    explains = share()
    if explains is not None and explains < _LITTLE and not is_noise():
        return f"the model explains {explained_in_words(explains)} of the torque"
    return None


def mostly_flagged(result: Any) -> str | None:
    """Return how much of a record is flagged, in words, where that is most of it: the rest may be trusted, and the record is not."""
    share = float(np.mean(unflagged(result)))
    return f"{1 - share:.0%} of the samples are flagged" if share < _LITTLE else None


def unflagged(result: Any) -> npt.NDArray[np.bool_]:
    """Return which samples have numbers, and flags that do not forbid to trust them, whatever the verdict says of the record."""
    there: npt.NDArray[np.bool_] = result._unflagged  # noqa: SLF001 - of results
    return there


def negative(value: Any, error: Any) -> str | None:
    """Return how often something is negative that never is, in words; None where that may be chance."""
    value, error = told_once(value), told_once(error)
    there = np.isfinite(value) & np.isfinite(error)
    count = int(np.count_nonzero(there))
    below = np.count_nonzero(there & (value < -_core.NEGATIVE_BEYOND * error)) / count if count else 0.0
    if below <= _core.OFTEN:
        return None
    return "is negative" + ("" if below > 1 - _core.OFTEN else f" in {below:.0%} of the record")


def _sign(result: Any, name: str) -> str | None:
    """Return what is wrong with a parameter's sign: mass is never negative, and stiffness that has both signs may be none.

    A magnet, gravity or muscles make a stiffness that has both: it is believed where equations were tested and nothing contradicts them.
    """
    if result.settings["kinds"][name] == "known":
        return None
    value, error = _believed(result, getattr(result, name)), _believed(result, result.stderr[name])
    if name != "stiffness":
        words = negative(value, error)
        return f"{name} {words}" if words else None
    is_contradicted = result.settings["form"] == "strong" or result.record_status & _CONTRADICTED
    if is_contradicted and negative(value, error) and negative(-value, error):
        kind, unit = result.settings["kinds"][name], result.units[name]
        one = number_of(getattr(result, name), result.stderr[name], kind, unit, unflagged(result))
        ends = " to ".join(to_digits_of(end, one.stderr) for end in (one.least, one.greatest))
        return f"stiffness has both signs ({ends} {one.unit})"
    return None


def _believed(result: Any, values: Any) -> Any:
    """Return what is known at samples that flags let trust, where there are some and values change: signs of others tell nothing."""
    good = unflagged(result)
    return values[good] if good.any() and told_once(values).shape[-1] > 1 else values


def how_well_known(result: Any) -> str:
    """Return how well every unknown parameter is known, relative to itself, of a result or of rows of one."""
    found, trusted = [], unflagged(result)
    for name, symbol in SYMBOLS.items():
        kind = result.settings["kinds"][name]
        if kind == "known":
            continue
        relative = relative_error(getattr(result, name), result.stderr[name], trusted)
        if relative is not None:
            found.append((f"{symbol}(t)" if kind in CHANGING else symbol, relative))
    return known_to(found)


def relative_error(value: Any, error: Any, trusted: Any) -> float | None:
    """Return the median error of something over its median size, of several records the median of that; None where nothing is trusted."""
    once = told_once(value), told_once(error)
    if all(one.shape[-1:] == (1,) for one in once):
        value, error, trusted = *once, trusted.any(axis=-1, keepdims=True)
    there = np.isfinite(value) & np.isfinite(error) & trusted
    if not there.any():
        return None
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a record of which nothing can be trusted has no median
        if there.ndim == 1:
            some = slice(None) if there.all() else there
            one, size = (percentiles(of[some], 50)[0] for of in (error, np.abs(value)))
            return float(np.divide(one, size))
        middles = (np.nanmedian(np.where(there, of, np.nan), axis=-1) for of in (error, np.abs(value)))
        return float(np.nanmedian(np.divide(*middles)))


def known_to(found: Sequence[tuple[str, float]]) -> str:
    """Return how well each of some parameters is known, in words."""
    shown = [
        f"{symbol} known to ± {two_digits(100 * relative)} %"
        if relative < 1
        else f"{symbol} not known (± {100 * relative:.0f} %)"
        for symbol, relative in found
        if np.isfinite(relative)
    ]
    return ", ".join([*shown[:1], *(one.replace(" known to", "") for one in shown[1:])])


def two_digits(value: float) -> str:
    """Return a number with the digits that an error deserves."""
    return f"{value:.2g}" if value < 10 else f"{value:.0f}"  # noqa: PLR2004 - two digits before the point
