"""A long stream in random pieces: memory stays where it is, and nothing drifts. Ten million samples in ``make soak-stream``."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import numpy as np
import pytest

import tvident

SAMPLES = int(os.environ.get("TVIDENT_STREAM", "120000"))
MIB = 2**20


def resident() -> int:
    """Return the bytes of memory that this process holds."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="the kernel tells what a process holds on Linux alone"
)
def test_memory_stays_and_nothing_drifts() -> None:
    generator = np.random.default_rng(0)
    # A signal of some minutes, again and again: the same samples at the same places of the grid must give the same numbers.
    stream = tvident.IdentificationStream(sample_rate=1000, method="paper")
    span = int(np.lcm(256, 200) * 8)
    t = np.arange(span) / 1000
    turns = 2 * np.pi / (span / 1000)
    angle = 0.2 * np.sin(turns * 90 * t) + 0.1 * np.sin(turns * 331 * t) + 1e-4 * generator.standard_normal(span)
    torque = 15 * angle + 0.01 * generator.standard_normal(span)
    state = len(pickle.dumps(stream))
    first = np.full(span, np.nan)
    held, largest, pushed, given = 0, 0, 0, 0
    while pushed < SAMPLES:
        count = min(int(generator.choice([1, 7, 200, 1999, 20_000])), SAMPLES - pushed)
        places = np.arange(pushed, pushed + count) % span
        out = stream.push(angle[places], torque[places])
        pushed += count
        samples = np.arange(given, given + out.time.size)
        given += out.time.size
        where = samples % span
        is_first, is_later = (samples >= span) & (samples < 2 * span), samples >= 2 * span
        first[where[is_first]] = out.stiffness[is_first]
        known = is_later & np.isfinite(first[where])
        # Spans and blocks lie on a grid whose periods need not divide the signal's: to rounding.
        assert np.allclose(out.stiffness[known], first[where[known]], rtol=1e-7)
        if pushed > 2 * span and not held:
            held = resident()
        largest = max(largest, len(pickle.dumps(stream))) if generator.random() < 0.02 else largest
    assert given == pushed - stream.delay
    assert largest < state + MIB
    assert not held or resident() - held < 8 * MIB
