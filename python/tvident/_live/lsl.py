"""Inlets and outlets of the Lab Streaming Layer; needs pylsl: install ``tvident[lsl]``."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from typing import Any

from tvident._live.lines import check_one
from tvident._units import unit_of

_MOST = 4096
"""Samples of a piece."""

_BUFFERED = 360
"""Seconds that an inlet keeps."""

_SECOND = 0.5
"""Seconds in which a second device answers to a name that a first has answered to."""

_AGAIN = 10.0
"""Seconds in which an outlet that began again answers, at most; what it sends meanwhile is kept."""

_CLOCK = 10.0
"""Seconds in which a stream's clock is told from this machine's, at most; what is sent meanwhile is kept."""

_UNDER_WAY = 1.0
"""Seconds that samples take to who listens: what an outlet has not sent when it goes is lost."""


def _library() -> Any:
    try:
        import pylsl  # noqa: PLC0415 - an extra
    except (ImportError, RuntimeError) as error:
        raise ImportError(
            f"the Lab Streaming Layer needs pylsl ({error}); install it with: pip install 'tvident[lsl]'"
        ) from None
    return pylsl


class Inlet:
    """Channels of a stream on the network.

    Parameters
    ----------
    name : str
        Name of the stream, or ``type=…`` or ``source_id=…``.
    names : sequence of str
        Channels by label, or by number from 0.
    timeout : float
        Seconds to look for the stream.

    Attributes
    ----------
    read, unreadable : int
        Samples with numbers, and those of a stream of text without, which are missing.
    first_unreadable : str
        One of them.
    restarts : int
        How often an outlet of the same source began again, where one missing sample keeps windows apart.
    has_gone : bool
        Whether the outlet went, and nothing says which other one goes on: it has no source_id.
    """

    def __init__(self, name: str, names: Sequence[str], timeout: float = 10.0) -> None:
        pylsl = _library()
        key, _, value = (
            name.partition("=") if name.partition("=")[0] in {"type", "source_id", "name"} else ("name", "", name)
        )
        found = pylsl.resolve_byprop(key, value, minimum=1, timeout=timeout)
        if not found:
            raise ValueError(
                f"a stream must be on the network; got none with {key} {value!r} within {timeout:g} s; start its outlet first"
            )
        if len(found) == 1:
            found = pylsl.resolve_byprop(key, value, minimum=2, timeout=_SECOND) or found
        if len(found) > 1:
            there = ", ".join(f"source_id={one.source_id()} at {one.hostname()}" for one in found)
            raise ValueError(
                f"a name must be that of one stream; got {len(found)} with {key} {value!r}; give one of {there}, or stop the others"
            )
        # Nothing is done to stamps here: smoothing them hides what was lost, and what brings them to this
        # machine's clock takes the only sign of an outlet that began again (see ``_to_our_clock``).
        self._inlet = pylsl.StreamInlet(found[0], max_buflen=_BUFFERED, processing_flags=pylsl.proc_none)
        self._lost, self._late = pylsl.util.LostError, pylsl.util.TimeoutError
        self.read = self.unreadable = self.restarts = 0
        self.first_unreadable = ""
        self.has_gone = False
        try:
            info = self._inlet.info(timeout=timeout)
        except (self._lost, self._late):
            raise ValueError(
                f"a stream must say its channels; got nothing from {key} {value!r} within {timeout:g} s; start its outlet again"
            ) from None
        self.nominal_rate: float = info.nominal_srate()
        self._places = _places(info, names)
        self._source, self._said = found[0].source_id(), _said(info)
        of_channels = [_unit(one) for one in info.get_channel_units() or ()]
        self.units = [of_channels[place] if place < len(of_channels) else "" for place in self._places]
        """Of the channels, as the stream says them."""
        self._inlet.open_stream(timeout=timeout)

    def pieces(self, wait: float) -> Iterator[list[list[float]]]:
        """Give what has come, stamps first, every so many seconds at least; end where the stream does."""
        while True:
            try:
                samples, stamps = self._inlet.pull_chunk(timeout=wait, max_samples=_MOST, min_samples=1)
                again = self._inlet.was_clock_reset()
                if again:
                    self._check_same()
                    self.restarts += 1
                ahead = self._to_our_clock() if stamps else 0.0
            except self._lost:
                self.has_gone = True
                return
            rows = [[stamp + ahead, *self._numbers(sample)] for sample, stamp in zip(samples, stamps, strict=True)]
            if again:
                rows.insert(0, [math.nan] * (1 + len(self._places)))
            yield rows

    def _to_our_clock(self) -> float:
        """Return the seconds from the stream's clock to this machine's, as the layer last measured them."""
        try:
            return float(self._inlet.time_correction(_CLOCK))
        except self._late:
            raise ValueError(
                f"a stream's clock must answer, for its stamps are another machine's; got nothing within {_CLOCK:g} s; "
                "let UDP through between the machines (ports 16572 to 16604)"
            ) from None

    def _check_same(self) -> None:
        """Refuse an outlet that began again with other channels: the layer goes on with whatever has the same source."""
        pylsl = _library()
        for found in pylsl.resolve_byprop("source_id", self._source, minimum=1, timeout=_AGAIN) if self._source else []:
            try:
                said = _said(pylsl.StreamInlet(found, recover=False).info(timeout=_AGAIN))
            except (self._lost, self._late):
                continue
            if said != self._said:
                raise ValueError(
                    f"an outlet that begins again must have the channels, units and rate of before: {self._said}; got {said}; "
                    "start this command again"
                )

    def _numbers(self, sample: Sequence[Any]) -> list[float]:
        """Return the numbers of the channels; a stream may hold text."""
        try:
            numbers = [float(sample[place]) for place in self._places]
        except ValueError:
            self.unreadable += 1
            self.first_unreadable = self.first_unreadable or repr([sample[place] for place in self._places])[:80]
            return [math.nan] * len(self._places)
        self.read += 1
        return numbers


def _said(info: Any) -> str:
    """Return what a stream says of its channels."""
    labels, units = info.get_channel_labels() or (), info.get_channel_units() or ()
    return f"labels {list(map(str, labels))}, units {list(map(str, units))}, {info.channel_count()} channels, {info.nominal_srate():g} Hz"


def _unit(said: Any) -> str:
    """Return a unit that is known; drivers write many things there."""
    text = str(said or "").strip()
    return text if unit_of(text) is not None else ""


def _places(info: Any, names: Sequence[str]) -> list[int]:
    """Return the numbers of channels."""
    labels: list[str] = [str(label) for label in info.get_channel_labels() or ()]
    count = info.channel_count()
    places = []
    for name in names:
        check_one(name, labels)
        if name in labels:
            places.append(labels.index(name))
        elif name.isdigit() and int(name) < count:
            places.append(int(name))
        else:
            there = ", ".join(labels) or f"numbers from 0 to {count - 1}, since they have no labels"
            raise ValueError(f"a channel must be one of the stream's; got {name!r}; there are {there}")
    return places


class Outlet:
    """A stream of parameters, their errors and the status, each sample with the stamp of the one that it belongs to.

    Parameters
    ----------
    name : str
    channels : sequence of (str, str)
        Labels and units.
    rate : float
        Samples per second.
    """

    def __init__(self, name: str, channels: Sequence[tuple[str, str]], rate: float) -> None:
        pylsl = _library()
        info = pylsl.StreamInfo(name, "Parameters", len(channels), rate, pylsl.cf_double64, f"tvident-{name}")
        info.set_channel_labels([label for label, _ in channels])
        info.set_channel_units([unit for _, unit in channels])
        self._outlet = pylsl.StreamOutlet(info)

    def show(self, stamps: Sequence[float], columns: Sequence[Sequence[float]]) -> None:
        """Send samples, given channel by channel."""
        for stamp, row in zip(stamps, zip(*columns, strict=True), strict=True):
            self._outlet.push_sample([float(value) for value in row], stamp)

    def close(self) -> None:
        """Wait until who listens has what was sent."""
        if self._outlet.have_consumers():
            time.sleep(_UNDER_WAY)
