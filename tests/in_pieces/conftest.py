"""Fixtures of tests that identify files piece by piece."""

from __future__ import annotations

from pathlib import Path

import pytest

import tvident
from in_pieces.small_pieces import cut_small


@pytest.fixture
def small_pieces(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Make pieces short, and work in a folder of the test's own."""
    cut_small(monkeypatch, tmp_path)


@pytest.fixture(scope="module")
def rig(request: pytest.FixtureRequest) -> tvident.Recording:
    """Simulate a rig whose stiffness moves, of as many samples as the module of the test says."""
    samples = request.module.SAMPLES
    return tvident.simulate_torsional_rig(duration=samples / 1000, sample_rate=1000, seed=5, pattern="slider")
