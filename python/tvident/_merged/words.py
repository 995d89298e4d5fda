"""What a result of trials or masses says in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tvident import _core
from tvident._advice import held, spoilt
from tvident._equation import BUILT_IN
from tvident._files import aligned
from tvident._merged.expanded import FoundExpanded
from tvident._merged.merging import Merging, Part
from tvident._merged.structure import Link
from tvident._results import COLUMNS, Words, row_of, sentences_of
from tvident._status import Status, describe
from tvident._units import in_words_of

_DOUBTS = {
    Status.SCALES_DISAGREE: "test functions of different widths disagree: the equations do not hold at all frequencies, so do not trust "
    "the numbers; look at scan(), for a term that is missing, a lag or noise that one channel gets from the other",
    Status.NOISE_MODEL: "the equations leave more than the noise of the channels explains: a term may be missing, a channel may be late "
    "or coupled in another way",
}

_OTHER_CAUSES = Status.LAG_SUSPECTED | Status.TERM_SUSPECTED | Status.CHANNEL_SUSPECTED

_SILENT = (
    "the equation of a mass on which no force acts leaves more than noise explains, and where no force holds them parameters are drawn "
    "towards zero: do not trust the numbers; look for a spring that changes ('windowed', or an Expansion), or let a force that is measured "
    "act on every mass"
)


def words_of(result: Any, merging: Merging, scatter: Mapping[str, float]) -> Words:
    """Return reasons and advice."""
    sampling = merging.sampling
    reasons, advice = ([one] if one else [] for one in (sampling.words, sampling.doubt))
    reasons += sampling.said
    advice += sampling.questions
    for part in merging.parts:
        one = part.found
        reasons += _reasons_of(one)
        if isinstance(one, FoundExpanded):
            reasons += one.words.reasons
            advice += one.words.advice
        else:
            advice += [words for flag, words in _DOUBTS.items() if one.record_status & flag]
            # What is missing or late acts alike in trials that move alike.
            advice += _unfollowed(result) if one.changes_in_common and not one.record_status & _OTHER_CAUSES else []
        advice += [_SILENT] if one.misfit > 1 else []
        advice += _channels_of(part, merging.masses, sampling.period)
        advice += _lacking_terms(part, merging)
    advice += _lacking_between(merging)
    advice += _changing(result)
    reasons += _tested(result)
    reasons += _slow(merging)
    for name, factor in scatter.items():
        if factor > 1:
            differences = result.trial_spread[name][0]
            spread = float(np.nanstd(differences))
            advice.append(
                f"trials do not share {name}: it scatters by {spread:.3g} from trial to trial, {factor**0.5:.1f} times what noise "
                "explains, and its standard errors are larger by as much; look at trial_spread"
            )
    advice += _without_equations(result.trial_spread)
    advice += _unknown(result)
    return Words(tuple(dict.fromkeys(reasons)), tuple(dict.fromkeys(advice)))


def _unfollowed(result: Any) -> list[str]:
    """Return what to do where windows leave what all trials have in common."""
    names = [name for name, kind in result.kinds.items() if kind == "windowed"]
    what = f"{' or '.join(names)} changes faster than they follow, or something acts in every trial then"
    cure = f"functions of time have no windows: {names[0]}=tvident.Expansion('bspline')"
    size = "with a size of three for every cycle if it finds none"
    return [f"windows leave what is the same in all trials at one time: {what}; {cure}, {size}"]


def _unknown(result: Any) -> list[str]:
    """Return which elements cannot be known, those together that have one reason."""
    reasons: dict[str, list[str]] = {}
    for name, verdict in result.identifiable.items():
        if not verdict:
            reasons.setdefault(verdict.reason, []).append(name)
    return [f"{', '.join(names)} cannot be known: {reason}" for reason, names in reasons.items()]


def _slow(merging: Merging) -> list[str]:
    """Return how elements are followed that were said to vary slowly."""
    names = [one.name for one in merging.elements if one.value == "varying"]
    words = "varies slowly and is" if len(names) == 1 else "vary slowly and are"
    other = "an Expansion of time, beside constants and other expansions, knows it better"
    return [f"{' and '.join(names)} {words} followed in windows: {other}"] if names else []


def _without_equations(spread: Mapping[str, tuple[Any, Any]]) -> list[str]:
    """Return which trials tell nothing."""
    if not spread:
        return []
    tells = np.any([np.isfinite(differences) for differences, _ in spread.values()], axis=0)
    silent = [str(trial) for trial in np.flatnonzero(~tells)]
    if not silent or len(silent) == tells.size:
        return []
    one = len(silent) == 1
    what = f"trial {silent[0]} tells" if one else f"trials {', '.join(silent)} tell"
    theirs, them = ("its", "it") if one else ("their", "them")
    return [
        f"{what} nothing: {theirs} samples are missing, or nothing moves there; check the channels, or leave {them} out"
    ]


def _tested(result: Any) -> list[str]:
    """Return what parts of the record say of every element."""
    words = []
    for name, probability in result.tests.items():
        kind = result.kinds[name]
        if kind == "constant" and probability < _core.NO_CHANCE:
            words.append(f"{name} is taken as constant, though parts of the record differ (p = {probability:.2g})")
        elif kind == "constant":
            words.append(f"{name} is constant: parts of the record differ as chance allows (p = {probability:.2g})")
        elif kind == "windowed" and probability >= _core.NO_CHANCE:
            words.append(f"{name} is followed in windows, since equations leave much less so")
        elif kind == "windowed":
            words.append(f"{name} is followed in windows, since parts of the record differ (p = {probability:.2g})")
    return words


def _channels_of(part: Part, masses: int, period: float) -> list[str]:
    """Return what to do about channels that a recorder spoilt, that are late, or whose gain is wrong."""
    numbers, found, angles = part.equations.numbers, part.found, angles_of(part)
    words = []
    for one in found.defects:
        cure = held(one.amount, "all") if one.name == "held" else spoilt(one.name, one.amount, alone=False)
        words.append(f"{_named(one.channel, angles, numbers, masses)} {cure}")
    for channel, late in found.late:
        by = f"{abs(late.value):.3g} ± {late.stderr:.1g} samples ({abs(late.value) * period:.3g} s)"
        comes = "late" if late.value > 0 else "early"
        with_what = "the other channels, without a filter" if channel < len(angles) else "the angles"
        words.append(
            f"{_named(channel, angles, numbers, masses)} seems to be {comes} by {by}: shift it by as much, or record it with {with_what}"
        )
    for channel, lacking in found.lacking:
        times = 1 / (1 + lacking.value)
        by = f"{times:.4g} ± {lacking.stderr * times**2:.1g} times what the other channels say"
        words.append(
            f"{_named(channel, angles, numbers, masses)} seems to be {by}: divide it by as much, or look for another unit or a filter"
        )
    return words


def _lacking_terms(part: Part, merging: Merging) -> list[str]:
    """Return which terms equations seem to lack, and how they are asked for."""
    words = []
    suspected = part.found.terms
    terms = dict.fromkeys([*merging.terms, *(name for _, against, name, _ in suspected if against is None)])
    kinds = merging.kinds_of_terms
    of_masses = [(term, kinds[term]) if term in kinds else term for term in terms]
    links = [link_of(angles_of(part), mass, against, merging.masses) for mass, against, _, _ in suspected]
    of_joints = [(name, link) for (_, _, name, _), link in zip(suspected, links, strict=True) if link is not None]
    given = [] if merging.recorded is None else list(getattr(merging.recorded.structure, "terms", ()))
    for (mass, _, name, found), link in zip(suspected, links, strict=True):
        amount = f"{found.value:.3g} ± {found.stderr:.1g} {merging.units[name]}"
        says = BUILT_IN[name].suspected(found.value, amount)
        if link is None:
            whose = f"of mass {part.equations.numbers[mass]}: " if merging.masses else ""
            words.append(f"{whose}{says}: give terms={of_masses}")
        else:
            words.append(
                f"between {_ends(link)}: {says}: give structure=tvident.Chain(…, terms={[*given, *of_joints]})"
            )
    return words


def _lacking_between(merging: Merging) -> list[str]:
    """Return which terms were found to be missing by trying them."""
    if merging.lacking is None:
        return []
    given = [] if merging.recorded is None else list(merging.recorded.structure.terms)
    terms = [*given, *((one.name, one.link) for one in merging.lacking.terms)]
    words = []
    for one in merging.lacking.terms:
        says = BUILT_IN[one.name].suspected(one.value, f"{one.value:.3g} ± {one.stderr:.1g} {merging.units[one.name]}")
        words.append(f"between {_ends(one.link)}: {says}: give structure=tvident.Chain(…, terms={terms})")
    return words


def angles_of(part: Part) -> list[int]:
    """Return whose angles a part counts: those of its equations first, then all others."""
    numbers = part.equations.numbers
    return [*numbers, *(one for one in range(len(part.found.noise[0])) if one not in numbers)]


def link_of(channels: Sequence[int], mass: int, against: int | None, masses: int) -> Link | None:
    """Return what a term acts between, as a chain has it; None for a mass on its own."""
    if against is None:
        return None
    one, other = channels[against], channels[mass]
    if one >= masses:
        return "base", other
    return min(one, other), max(one, other)


def _ends(link: Link) -> str:
    """Return what a term acts between, in words."""
    one, other = link
    return f"the base and mass {other}" if one == "base" else f"masses {one} and {other}"


def _named(channel: int, angles: Sequence[int], torques: Sequence[int], masses: int) -> str:
    """Return which channel it is, angles before torques, in words."""
    is_angle = channel < len(angles)
    number = angles[channel] if is_angle else torques[channel - len(angles)]
    return f"the {'angle' if is_angle else 'torque'}{_of(number, masses)}"


def _of(number: int, masses: int) -> str:
    """Return whose channel it is, in words."""
    if masses == 0:
        return ""
    return " of the base" if number >= masses else f" of mass {number}"


def _changing(result: Any) -> list[str]:
    """Return what to do about elements that are taken as constant and differ between parts of the record."""
    names = [name for name, p in result.tests.items() if p < _core.NO_CHANCE and result.kinds[name] == "constant"]
    if not names:
        return []
    differ = "differs" if len(names) == 1 else "differ"
    words = f"{' and '.join(names)} {differ} between parts of the record, though taken as constant"
    return [f"{words}: ask for the kind 'windowed', or look for a term that is missing"]


def _reasons_of(one: _core.MergedIdentification | FoundExpanded) -> list[str]:
    """Return what was chosen for equations that share unknowns."""
    function = f"the test function has {one.window_length} samples and exponent {one.exponent}"
    times = f"rows are predicted with {one.prediction_error:.2f} times the variance of the channels' noise"
    # What sums of functions leave stands in their own words.
    reasons = [function if isinstance(one, FoundExpanded) else f"{function}; {times}"]
    angles = len(one.noise[0])
    for channel, colours in (("an angle", one.colours[:angles]), ("a torque", one.colours[angles:])):
        if (colour := max(colours, default=1.0)) > 1:
            corrected = "products are corrected for it, and " if channel == "an angle" else ""
            strength = f"{colour:.2g} times as strong at low frequencies as at the highest"
            reasons.append(f"the noise of {channel} is {strength}: {corrected}errors are larger by it")
    if one.scan.plateau is not None:
        first, last = (one.scan.window_length[place] for place in one.scan.plateau)
        reasons.append(
            f"test functions of {first} to {last} samples agree, of {one.scan.tried} widths that were compared"
        )
    if one.lengths:
        best = min(one.lengths, key=lambda tried: tried.error)
        reasons.append(f"windows of {best.samples} samples predict best, of {len(one.lengths)} lengths that were tried")
    return reasons


def whose(trials: int, masses: int) -> str:
    """Return what is merged, in words."""
    of_masses = "one mass" if masses == 1 else f"{masses} masses"
    return of_masses if trials == 1 else f"{trials} trials of {of_masses}"


@np.errstate(all="ignore")
def summary_of(result: Any, verdict: str) -> str:
    """Return the verdict, a table of the elements, and what was chosen and what to do."""
    rows: list[tuple[str, ...]] = [("element", *COLUMNS)]
    for name, values in result.elements.items():
        rows.append(row_of(name, result.kinds[name], values, result.stderr[name], result.units))
    s = result.settings
    seconds = float(result.time[-1] - result.time[0]) if result.time.size else 0.0
    lines = [
        in_words_of(result.units, verdict),
        in_words_of(result.units, result.held_back().words()),
        "",
        f"{whose(s['trials'], s['masses'])}, {result.time.size} samples, {seconds:.4g} s at {s['sample_rate']:.6g} Hz",
        "",
        *aligned(rows),
        *sentences_of(result),
    ]
    flags = (in_words_of(result.units, line) for line in describe(result.status, result.record_status))
    return "\n".join([*lines, "", *flags])
