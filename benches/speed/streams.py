"""Rows for streams: pieces of several sizes against one call with all samples."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

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


def _weak(samples: int) -> Callable[[float], Duel]:
    """Pit a stream in weak form by settings of an earlier result against the batch on one thread; both must agree to chance."""

    def prepare(share: float) -> Duel:
        angle, torque = signals.recording(max(int(samples * share), 40_000))
        earlier = tvident.identify(angle[:20_000], torque[:20_000], sample_rate=signals.RATE)
        # What the earlier recording chose is taken as it is, as every block does.
        settings = {**earlier.settings, "chosen": []}

        def streamed() -> list[Any]:
            stream = tvident.IdentificationStream(sample_rate=signals.RATE, settings=settings)
            return [stream.push(angle, torque), stream.finish()]

        def batch() -> tvident.Identification:
            found: tvident.Identification = tvident.identify(
                angle, torque, sample_rate=signals.RATE, settings=settings, workers=1
            )
            return found

        def check() -> None:
            whole = batch()
            stiffness = np.concatenate([out.stiffness for out in streamed()])
            away = (stiffness - whole.stiffness) / whole.stderr["stiffness"]
            if not np.sqrt(np.nanmean(away**2)) < 1:
                raise checks.DifferentError("a stream differs from the batch by more than chance")

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
    Row(
        "stream-weak",
        "`IdentificationStream`, weak form by settings of an earlier recording",
        "`identify` with the same settings, one thread",
        _weak(200_000),
        most=1.5,
    ),
]
"""One sample at a time fills one of eight lanes and pays for a call from Python: what counts is that it ends before the next one comes."""
