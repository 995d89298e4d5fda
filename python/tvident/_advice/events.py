"""What happened in a record at some times only, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tvident import _core
from tvident._advice.channels import held
from tvident._arguments import listed, ordinal
from tvident._results import STAYS
from tvident._status import Status, stretches_of, untold_samples

_SHOWN = 6
"""Pulses that are listed at most."""

_NAN = f"make them NaN, {STAYS}takes them out"
_APART = (
    "windows over such a place are wrong in strong form: exclude half a window on either side with mask=, give the parts as a list of "
    f"records, {STAYS}leaves such equations out"
)
"""What to do about places at which the angle jumps."""

_TREATED = (
    ("angle", "what their neighbours say took their place"),
    ("torque", "equations with them were left out"),
)
"""What becomes of spikes, by channel."""


def lost_samples(found: _core.Identification) -> list[str]:
    """Return at how many places samples seem to be lost."""
    return [
        f"{_between_samples(round(one.amount), 'angle')}: equations over such a place were left out; if a recorder loses samples, record "
        "their times"
        for one in found.defects
        if one.name == "broken"
    ]


def spikes(found: _core.Identification) -> list[str]:
    """Return how many samples of each channel stand far out of their neighbours, and what became of them."""
    counts = Counter(one.channel for one in found.spikes)
    return [
        f"{_out_of_neighbours(counts[channel], name)}: {treated}"
        for channel, (name, treated) in enumerate(_TREATED)
        if counts[channel]
    ]


def unread(found: _core.Identification) -> list[str]:
    """Return how many samples of each channel hold one value in place of a reading."""
    return [
        f"{_not_read(len(places), name)}: they count as missing"
        for (name, _), places in zip(_TREATED, found.unread, strict=True)
        if places
    ]


def without_numbers(
    angles: npt.NDArray[np.number], torques: npt.NDArray[np.number], records: Sequence[int]
) -> list[tuple[int, str]]:
    """Return which channels hold nothing, by record, of those that determine nothing."""
    found = []
    for record in records:
        there = {
            name: np.isfinite(of.reshape(-1, of.shape[-1])[record])
            for name, of in (("angle", angles), ("torque", torques))
        }
        empty = [name for name, is_there in there.items() if not is_there.any()]
        if empty:
            count = there[empty[0]].size
            words = f"the {' and the '.join(empty)} hold{'s' if len(empty) == 1 else ''} no numbers: all {count} samples are missing"
            found.append((record, f"{words}; was another channel meant, or was a sensor not connected?"))
        elif not (there["angle"] & there["torque"]).any():
            found.append(
                (record, "no sample has both the angle and the torque: were they recorded one after the other?")
            )
    return found


def events_that_stay(angles: npt.NDArray[np.number], torques: npt.NDArray[np.number]) -> list[tuple[int, str]]:
    """Return what to do about readings that failed, spikes and jumps, by record, where nothing took them out."""
    looked_for = (
        (_not_read, _NAN, _core.unread_counts),
        (_out_of_neighbours, _NAN, _core.spike_counts),
        (_between_samples, _APART, _core.break_counts),
    )
    return [
        (record, f"{words(count, name)}: {cure}")
        for words, cure, counted in looked_for
        for record, counts in enumerate(counted(angles, torques))
        for (name, _), count in zip(_TREATED, counts, strict=True)
        if count
    ]


def _between_samples(count: int, name: str) -> str:
    return (
        f"the {name} jumps between two samples at {count} place{'' if count == 1 else 's'}, as it does where samples are lost or "
        "recordings are joined"
    )


def _not_read(count: int, name: str) -> str:
    return (
        f"{count} samples of the {name} hold one and the same value, to which it jumps and from which it comes back, as where a "
        "reading fails"
    )


def _out_of_neighbours(count: int, name: str) -> str:
    many, stand = ("1 sample", "stands") if count == 1 else (f"{count} samples", "stand")
    return (
        f"{many} of the {name} {stand} far out of the neighbours on both sides: spikes, as electrical disturbances make"
    )


def pulses(found: _core.Identification, period: float) -> list[str]:
    """Return when the stiffness is another one for a short while."""
    if not found.pulses:
        return []
    shown = ", ".join(f"{first * period:.6g} to {end * period:.6g}" for first, end in found.pulses[:_SHOWN])
    shown += " …" if len(found.pulses) > _SHOWN else ""
    many = "once" if len(found.pulses) == 1 else f"{len(found.pulses)} times"
    words = f"the stiffness is another one for a short while {many}, from {shown} s"
    return [f"{words}: everything else is identified without these pulses, which are added to it"]


def jumps_beside_pulses(found: _core.Identification) -> list[int]:
    """Return the samples before which parameters jump, without the ends of pulses."""
    ends = {end for pulse in found.pulses for end in pulse}
    return [jump for jump in found.jumps if jump not in ends]


def comes_late(found: _core.Identification, defect: tuple[str, str, float], period: float, *, late: bool) -> str:
    """Return what to do about a channel that is filtered, `late` or not, or holds values: its name, what was done, and how much of it."""
    name, what, amount = defect
    if what == "filtered" and not late:
        return (
            "seems to be low-passed by a filter that delays nothing, such as filtfilt, and the other channel is not: its fast motion is "
            f"weaker, which changes parameters by {100 * amount:.2g} % or more, as their errors say: pass the other channel through the "
            "same filter, or give both as they were recorded"
        )
    if what == "filtered":
        return (
            f"seems to be filtered: a lag explains most, a filter remains, which changes parameters by up to {100 * amount:.2g} %, as "
            "their errors say: pass the other channel through the same filter and give no lag, or record without a filter"
        )
    if name in {"velocity", "acceleration"}:
        return f"holds every value for {amount:.0f} samples: keep every {ordinal(amount)} sample of all channels"
    cure = held(amount, "both")
    # The steps of an angle are motion for the equation, whatever its lag; and channels that both hold are late alike.
    alone = name == "torque" and not any(one.channel == 0 and one.name == "held" for one in found.defects)
    return f"{cure}, or give lag={(amount - 1) / 2 * period:.3g} (seconds)" if alone else cure


def unexplained_here(found: _core.Identification, period: float, step: int) -> list[str]:
    """Return where more is left than the noise of the rest explains, and what to do there."""
    flagged = found.status & np.uint16(Status.NOISE_MODEL) != 0
    if found.outside_mask is not None or not flagged.any():
        return []
    words = (
        f"{_where(flagged, period * step)} the residual exceeds what the noise explains: was "
        "the machine touched, does something change there that no window follows, or is the noise larger? Errors are larger there, and "
        "values not trusted: mask these samples, or give weights="
    )
    return [words]


def untold_here(found: _core.Identification, windowed: Sequence[str], period: float, step: int) -> list[str]:
    """Return where the motion tells nothing of what is windowed, or no equation does, and what to do there."""
    told_apart = np.asarray(found.condition) <= _core.HARDLY_TOLD_APART
    # Of invalid samples, and where nothing is windowed, the flag is the record's.
    flagged = untold_samples(found.status) & told_apart
    in_gap = np.asarray(found.status & np.uint16(Status.GAP) != 0)
    return [
        *untold(flagged & ~in_gap, windowed, period * step),
        *_carried_on(flagged & in_gap, windowed, period * step),
    ]


def _carried_on(flagged: npt.NDArray[np.bool_], names: Sequence[str], seconds: float) -> list[str]:
    """Return in which gaps parameters are carried on from equations that are farther than a quarter of a window."""
    if not (names and flagged.any()):
        return []
    words = (
        f"{_where(flagged, seconds)} no equation is within a quarter of a window: "
        f"{listed(list(names))} is carried on there from beside the gap, and values are not trusted, as nobody knows what it does "
        "meanwhile"
    )
    return [words]


def untold(flagged: npt.NDArray[np.bool_], names: Sequence[str], seconds: float) -> list[str]:
    """Return where the motion tells nothing of some parameters, and what to do there; samples are so many seconds apart."""
    if not (names and flagged.any()):
        return []
    words = (
        f"{_where(flagged, seconds)} the motion tells nothing of "
        f"{listed(list(names))}: errors are as large as anything that the torques of this record suggest, and values are not trusted: "
        "drive the machine there, or make it constant or 'varying', if it is"
    )
    return [words]


def _where(flagged: npt.NDArray[np.bool_], seconds: float) -> str:
    """Return in how much of a record samples are flagged, and when; they are so many seconds apart."""
    begins, ends = stretches_of(flagged)
    shown = ", ".join(f"{a * seconds:.4g}-{b * seconds:.4g}" for a, b in list(zip(begins, ends, strict=True))[:_SHOWN])
    more = " …" if begins.size > _SHOWN else ""
    return f"in {flagged.mean():.1%} of the record (at {shown}{more} s)"
