"""Who watches: a table on the terminal, JSON lines, datagrams."""

from __future__ import annotations

import io
import json
import math
import socket
from collections.abc import Mapping, Sequence
from typing import IO, Any

Columns = Mapping[str, Sequence[float]]


class LiveTable:
    """One line of a table every so many seconds of the recording.

    Parameters
    ----------
    output : file
    every : float
        Seconds.
    units : mapping of str to str
        Of the parameters, by name.
    """

    def __init__(self, output: IO[str], every: float, units: Mapping[str, str]) -> None:
        self._output = output
        self._every = every
        self._units = units
        self._next = -math.inf

    def show(self, times: Sequence[float], columns: Columns) -> None:
        """Show the last sample, if it is time."""
        if not len(times) or times[-1] < self._next:
            return
        if self._next == -math.inf:
            heads = [f"{name} [{unit}]" if unit else name for name, unit in self._units.items()]
            self._line("time [s]", heads, "status")
        self._next = times[-1] + self._every
        cells = [f"{columns[name][-1]:.6g} ± {columns[f'{name}_stderr'][-1]:.2g}" for name in self._units]
        self._line(f"{times[-1]:.3f}", cells, str(int(columns["status"][-1])))

    def _line(self, time: str, cells: Sequence[str], status: str) -> None:
        self._output.write(f"{time:>12}  {'  '.join(f'{cell:>26}' for cell in cells)}  {status:>6}\n")
        self._output.flush()


def _lines(times: Sequence[float], columns: Columns) -> list[str]:
    """Return one object a sample; what is no number is null."""
    names = [*columns]
    found = []
    for time, *values in zip(times, *columns.values(), strict=True):
        row: dict[str, Any] = {"timestamp": float(time)}
        for name, value in zip(names, values, strict=True):
            row[name] = int(value) if name == "status" else float(value) if math.isfinite(value) else None
        found.append(json.dumps(row, separators=(",", ":")))
    return found


def _write(output: IO[str], text: str) -> None:
    """Write all of a text: where nothing is buffered (``PYTHONUNBUFFERED``) Python drops what a pipe does not take before a signal."""
    raw = getattr(output, "buffer", None)
    if not isinstance(raw, io.RawIOBase):
        output.write(text)
        output.flush()
        return
    left = memoryview(text.encode())
    while left:
        left = left[raw.write(left) or 0 :]


class JsonLines:
    """One object a sample and line, with ``timestamp`` and a key for every number.

    Parameters
    ----------
    output : file
    """

    def __init__(self, output: IO[str]) -> None:
        self._output = output

    def show(self, times: Sequence[float], columns: Columns) -> None:
        """Write samples."""
        if len(times):
            _write(self._output, "\n".join(_lines(times, columns)) + "\n")


class Udp:
    """The same as datagrams, which PlotJuggler's UDP server takes as JSON.

    Parameters
    ----------
    address : str
        ``host:port``.
    """

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        if not host or not port.isdigit():
            raise ValueError(f"an address must be host:port; got {address!r}; write 127.0.0.1:9870, say")
        self._to = (host, int(port))
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def show(self, times: Sequence[float], columns: Columns) -> None:
        """Send samples."""
        for line in _lines(times, columns):
            self._socket.sendto(line.encode(), self._to)
