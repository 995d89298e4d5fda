"""The record that a result was found in, as far as its simulation needs it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from tvident._equation import FixedTerm
from tvident._results.scan import Scan
from tvident._results.words import Words

Numbers: TypeAlias = npt.NDArray[np.number]


class Changeable(Protocol):
    """A record whose arrays somebody else may write into."""

    @property
    def is_unchanged(self) -> bool:
        """Whether nobody has."""


OneRecord = TypeVar("OneRecord", bound=Changeable)

_BLOCKS = 1024
"""Of each record, whose sums know it again: one sample that is written over changes one of them, another order most."""

Marks: TypeAlias = tuple[npt.NDArray[np.uint64], ...]


@dataclass(frozen=True)
class Recorded:
    r"""A record, by reference: its channels are not copied.

    Parameters
    ----------
    angles, torques : ndarray, shape (\*, n)
        As they were used: copies where there were spikes, clipped or lost samples.
    given : tuple of ndarray
        Both as they were given.
    own : mapping of str to FixedTerm
        Terms of the user's own, with their inner parameters.
    again : callable
        Identifies once more, with the same settings and another angle.
    part : callable, optional
        Gives what NumPy's indexing takes of several records.
    improve : callable, optional
        Tries what a result advises, and returns words that begin with what leads to the answer.
    scans : callable, optional
        Compares windows of other lengths with those that were used, in strong form.
    again_in : callable, optional
        Identifies a stretch once more, with the same settings, its angle, which one it is, and parameters that are known; None where a
        stretch is no record of its own.
    mask : ndarray of bool, shape (\*, n), optional
        True where a sample counts; None where all do.
    beside : sequence of ndarray
        What else was given with a value for every sample.
    marks : tuple of ndarray, optional
        By which arrays are known again; by default those that they have now.
    """

    angles: Numbers
    torques: Numbers
    given: tuple[Numbers, Numbers]
    own: Mapping[str, FixedTerm]
    again: Callable[[Numbers], Any]
    part: Callable[[Any], Recorded] | None = None
    improve: Callable[[Any, Words], Words] | None = None
    scans: Callable[[], tuple[Scan, ...]] | None = None
    again_in: Callable[[Numbers, slice, Mapping[str, Any]], Any] | None = None
    mask: npt.NDArray[np.bool_] | None = None
    beside: Sequence[npt.NDArray[Any]] = ()
    marks: Marks | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.marks is None:
            object.__setattr__(self, "marks", self._marks_now())

    def of(self, place: Any) -> Recorded | None:
        """Return some of several records, which are known again as the whole is: arrays may have been written over before."""
        if self.part is None:
            return None
        return replace(self.part(place), marks=tuple(mark[place] for mark in self.marks or ()))

    def mask_in(self, some: slice) -> npt.NDArray[np.bool_] | None:
        """Return the mask of a stretch."""
        return None if self.mask is None else self.mask[..., some]

    def unmasked(self, some: slice = slice(None)) -> Numbers:
        """Return the angles of a stretch, missing where the mask leaves samples out."""
        angles, mask = self.angles[..., some], self.mask_in(some)
        return angles if mask is None else np.where(mask, angles, np.nan)

    @property
    def is_unchanged(self) -> bool:
        """Whether nobody has written another record into the arrays meanwhile."""
        return all(map(np.array_equal, self.marks or (), self._marks_now()))

    def _marks_now(self) -> Marks:
        return tuple(mark_of(channel) for channel in (*self.given, *self.beside))


def mark_of(channel: npt.NDArray[Any]) -> npt.NDArray[np.uint64]:
    r"""Return sums of the bits of the blocks of every record, shape (\*, blocks), by which a channel is known again.

    They take 0.4 ns a sample, and 8 kB for a record of any length.
    """
    samples = channel.shape[-1]
    if not samples:
        return np.zeros((*channel.shape[:-1], 0), np.uint64)
    begins = np.unique(np.linspace(0, samples, min(samples, _BLOCKS), endpoint=False).astype(np.intp))
    bits = channel.view(f"u{channel.itemsize}")
    return np.asarray(np.add.reduceat(bits, begins, axis=-1, dtype=np.uint64))


def still_there(recorded: OneRecord | None, cure: str) -> OneRecord:
    """Return the record that was identified.

    Raises
    ------
    ValueError
        If it was not kept, or its arrays hold something else by now; the cure is what to give instead.
    """
    if recorded is None:
        raise ValueError(
            f"the record must be there; got a part of a result, or one that was stored without it; give {cure}"
        )
    if not recorded.is_unchanged:
        raise ValueError(
            f"the record must be as it was identified; its arrays hold other samples by now; give {cure}, or pass copies to identify"
        )
    return recorded


def both_or_none(angle: Any, torque: Any) -> None:
    """Raise ValueError if only one channel of a recording is given."""
    if (angle is None) != (torque is None):
        raise ValueError("angle and torque must be of the same recording; got only one of them; give both")


def begins_once(initial: Any, angle: Any) -> None:
    """Raise ValueError if the state at the first sample is given in two ways."""
    if initial is not None and angle is not None:
        raise ValueError("the state must come from initial= or from angle=; got both; drop one")
