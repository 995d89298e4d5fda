"""The record that a result was found in, as far as its simulation needs it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
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

_LOOKED_AT = 1024
"""Samples of each channel by which a record is known again: whoever writes another recording into the same arrays changes most of them."""


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
    _mark: bytes = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_mark", self._mark_of_given())

    def of(self, place: Any) -> Recorded | None:
        """Return some of several records."""
        return None if self.part is None else self.part(place)

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
        return self._mark == self._mark_of_given()

    def _mark_of_given(self) -> bytes:
        return b"".join(mark_of(channel) for channel in self.given)


def mark_of(channel: Numbers) -> bytes:
    """Return some samples of a channel, by which it is known again."""
    flat = channel.reshape(-1, channel.shape[-1])
    rows, samples = (max(1, size // some) for size, some in ((flat.shape[0], 8), (flat.shape[1], _LOOKED_AT)))
    return np.ascontiguousarray(flat[::rows, ::samples]).tobytes()


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
