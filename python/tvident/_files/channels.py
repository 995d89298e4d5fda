"""What a file of recordings holds: channels by name."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import numpy.typing as npt

from tvident._files.names import listed, printable
from tvident._units import named_unit

Channels = dict[str, npt.NDArray[Any]]
"""Channels by name, in the order of the file: what :func:`read` returns.

See Also
--------
read : reads them.
channel : one of them by its name.

References
----------
docs/files.md: what a channel is in every kind of file.

Examples
--------
>>> import numpy as np
>>> from tvident import recordings
>>> channels: recordings.Channels = {"angle [rad]": np.zeros(3)}
>>> recordings.channel(channels, "angle", "here").shape
(3,)
"""

Say = Callable[[str], None]
"""Takes in what is not read, or not as it stands in the file."""

WIDEST_LIST = 64
"""Numbers of a list in a cell that are channels of their own."""

_NUMBER = re.compile(r"[0-9]{1,9}")

_SAMPLES = re.compile(r"(.+_Data)((?:\.[0-9]+)?)")
"""What catman calls samples, or a column of them: what the header calls them stands between."""


class FileError(Exception):
    """A file that cannot be used. The message says why and what to do.

    See Also
    --------
    read, tvident.read_recording, tvident.load : raise it.
    FileWarning : of what is read in part.

    References
    ----------
    docs/files.md, "What is refused, and what is dropped".

    Examples
    --------
    >>> from tvident import recordings
    >>> try:
    ...     recordings.read("nowhere.csv")
    ... except recordings.FileError as error:
    ...     print(error)
    nowhere.csv: there is no such file; check the name and the folder
    """


class FileWarning(UserWarning):
    r"""Part of a file that is not read, or not as it stands there.

    See Also
    --------
    read, tvident.read_recording : warn of it.
    FileError : of what cannot be read at all.

    References
    ----------
    docs/files.md, "What is refused, and what is dropped".

    Examples
    --------
    >>> import warnings
    >>> from pathlib import Path
    >>> from tvident import recordings
    >>> _ = Path("notes.csv").write_text("angle,note\n1,calm\n2,loud\n")
    >>> with warnings.catch_warnings(record=True) as said:
    ...     warnings.simplefilter("always")
    ...     list(recordings.read("notes.csv"))
    ['angle']
    >>> said[0].category.__name__
    'FileWarning'
    """


_BETWEEN_PARTS = re.compile(r"[./\[\]]+")

MOST_CHANNELS = 10_000
"""Channels of a file. More are samples."""


def check_count(channels: int) -> None:
    """Refuse more channels than a recording has."""
    if channels > MOST_CHANNELS:
        raise FileError(
            f"a file must have at most {MOST_CHANNELS} channels; this one has {channels}; write one line, or one row, for every sample"
        )


def channel(channels: Mapping[str, npt.NDArray[Any]], name: str, source: str) -> npt.NDArray[Any]:
    """Return a channel by its name, without its unit where it has one, or by its number.

    Parameters
    ----------
    channels : mapping of str to ndarray
        What :func:`read` returned.
    name : str
        Name with or without its unit, and without its group where no other has such a channel, or number from 0.
    source : str
        What the file is called in the message.

    Returns
    -------
    ndarray, shape (n,) or ()
        In the unit of the file.

    Raises
    ------
    KeyError
        If there is no such channel, or several differ by their units alone: the message lists what there is.

    See Also
    --------
    read : reads channels from a file.

    References
    ----------
    docs/files.md: names of channels, and "Units".

    Examples
    --------
    >>> import numpy as np
    >>> from tvident import recordings
    >>> channels = {"time [s]": np.arange(3.0), "angle [rad]": np.ones(3)}
    >>> recordings.channel(channels, "angle", "rig.npz")
    array([1., 1., 1.])
    """
    return channels[full_name(channels, name, source)]


def full_name(channels: Mapping[str, Any], name: str, source: str) -> str:
    """Return what a channel is called in the file."""
    if name in channels:
        return name
    same = [key for key in channels if key.startswith(name) and named_unit(key)[0] == name]
    if len(same) == 1:
        return same[0]
    inside = [key for key in channels if named_unit(key)[0].endswith(f".{name}") or key.endswith(f".{name}")]
    inside = inside or _behind_samples(channels, name)
    if not same and len(inside) == 1 and not _NUMBER.fullmatch(name):
        return inside[0]
    if not same and not inside:
        # Whoever types a name by hand may not care for capitals; where two channels differ by these alone, nothing is guessed.
        same = [key for key in channels if name.casefold() in {key.casefold(), named_unit(key)[0].casefold()}]
    same = same or inside or _written_otherwise(channels, name)
    if len(same) == 1 and not inside:
        return same[0]
    place, asked = printable(source), printable(name)
    if same:
        raise KeyError(
            f"{place} must have one channel '{asked}'; it has {listed(same)}; name one of these as it is written here"
        )
    if _NUMBER.fullmatch(name) and int(name) < len(channels):
        return list(channels)[int(name)]
    raise KeyError(f"{place} has no channel '{asked}'; it has {listed(channels)}; use one of these or a number from 0")


def _written_otherwise(channels: Mapping[str, Any], name: str) -> list[str]:
    """Return the channels of this name where their groups are written in another way: ``/arm/q``, ``arm.q``; ``q[0]``, ``q.0``."""
    dotted = name.strip("/").replace("/", ".")
    if dotted not in {"", name} and not _NUMBER.fullmatch(dotted):
        with suppress(KeyError):
            return [full_name(channels, dotted, "")]
    parts = parts_of(name)
    return [key for key in channels if len(parts) > 1 and parts_of(named_unit(key)[0])[-len(parts) :] == parts]


def parts_of(name: str) -> list[str]:
    """Return the parts of a name between points, slashes and square brackets."""
    return [part for part in _BETWEEN_PARTS.split(name) if part]


def _behind_samples(channels: Mapping[str, Any], name: str) -> list[str]:
    """Return the channels that a header names behind this name."""
    found = _SAMPLES.fullmatch(name)
    begun = [key for key in channels if found and key.startswith(f"{found[1]}.")]
    return [key for key in begun if found and named_unit(key)[0].endswith(found[2])]
