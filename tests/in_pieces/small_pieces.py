"""Pieces that are short, so that short records have several, in a folder of their own."""

from __future__ import annotations

from pathlib import Path

import pytest

from tvident._in_pieces import call, choices


def cut_small(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Cut records into pieces of 20 000 samples and choose by stretches of 8 000, with files in a folder."""
    monkeypatch.setattr(call, "PIECE", 20_000)
    monkeypatch.setattr(call, "LONG_PIECE", 20_000)
    monkeypatch.setattr(choices, "STRETCH", 8_000)
    monkeypatch.chdir(folder)
