"""Inlets and outlets of the Lab Streaming Layer; needs pylsl: install ``tvident[lsl]``."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import Any

from tvident._units import unit_of

_MOST = 4096
"""Samples of a piece."""

_BUFFERED = 360
"""Seconds that an inlet keeps."""

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
        # Stamps are brought to this machine's clock; smoothing them would hide what was lost.
        self._inlet = pylsl.StreamInlet(found[0], max_buflen=_BUFFERED, processing_flags=pylsl.proc_clocksync)
        self._lost = pylsl.util.LostError
        info = self._inlet.info(timeout=timeout)
        self.nominal_rate: float = info.nominal_srate()
        self._places = _places(info, names)
        of_channels = [_unit(one) for one in info.get_channel_units() or ()]
        self.units = [of_channels[place] if place < len(of_channels) else "" for place in self._places]
        """Of the channels, as the stream says them."""
        self._inlet.open_stream(timeout=timeout)

    def pieces(self, wait: float) -> Iterator[list[list[float]]]:
        """Give what has come, stamps first, every so many seconds at least; end where the stream does."""
        while True:
            try:
                samples, stamps = self._inlet.pull_chunk(timeout=wait, max_samples=_MOST, min_samples=1)
            except self._lost:
                return
            yield [
                [stamp, *(float(sample[place]) for place in self._places)]
                for sample, stamp in zip(samples, stamps, strict=True)
            ]


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
