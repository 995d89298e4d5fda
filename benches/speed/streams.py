"""Rows for streams: pieces of several sizes against one call with all samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import tvident
from speed import checks, signals
from speed.rows import Duel, Row


def _stream(samples: int, piece: int) -> Callable[[float], Duel]:
    """Pit a stream in pieces of some samples against the batch on one thread; the numbers must be the same."""

    def prepare(share: float) -> Duel:
        angle, torque = signals.recording(max(int(samples * share), 4000))
        pieces = [slice(first, first + piece) for first in range(0, angle.size, piece)]

        def streamed() -> list[tvident.IdentificationStream]:
            stream = tvident.IdentificationStream(sample_rate=signals.RATE, method="paper")
            for one in pieces:
                stream.push(angle[one], torque[one])
            return [stream]

        def batch() -> tvident.Identification:
            return tvident.identify(angle, torque, sample_rate=signals.RATE, method="paper", workers=1)

        def check() -> None:
            stream = tvident.IdentificationStream(sample_rate=signals.RATE, method="paper")
            found = [stream.push(angle[one], torque[one]).stiffness for one in pieces]
            found.append(stream.finish().stiffness)
            if not np.array_equal(np.concatenate(found), batch().stiffness, equal_nan=True):
                raise checks.DifferentError("a stream gives other numbers than the batch")

        return Duel([streamed, batch], check, angle.size)

    return prepare


STREAMS = [
    Row(
        "stream",
        "`IdentificationStream`, paper's method, pieces of 20 000 samples",
        "`identify`, one thread",
        _stream(1_000_000, 20_000),
        most=1.3,
    ),
    Row(
        "stream-200",
        "the same, pieces of 200 samples",
        "`identify`, one thread",
        _stream(200_000, 200),
        most=3,
    ),
    Row(
        "stream-1",
        "the same, one sample at a time from Python",
        "`identify`, one thread",
        _stream(20_000, 1),
        most=60,
    ),
]
"""One sample at a time fills one of eight lanes and pays for a call from Python: what counts is that it ends before the next one comes."""
