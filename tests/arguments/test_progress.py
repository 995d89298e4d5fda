"""What is told of the work done, whatever order its stages tell it in."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import tvident
from tvident import _arguments as arguments

TOLD = [(0, 10), (7, 10), (3, 10), (10, 10), (2, 10), (10, 10), (0, 7), (5, 7), (7, 7), (1, 7000)]
"""As stages, threads and calls one after another tell it: it begins anew, has another whole, and does not come to its end."""


def test_progress_never_goes_back_and_ends_with_the_whole() -> None:
    told: list[tuple[int, int]] = []
    with arguments.reporter(lambda *of: told.append(of), "work") as report:
        assert report is not None
        for of in TOLD:
            report(*of)
    parts = [done / total for done, total in told]
    assert parts == sorted(parts)
    assert told[:3] == [(0, 10), (7, 10), (7, 10)]
    # The whole is told at the end alone, once.
    assert [part for part in parts if part >= 1] == [1.0]
    assert told[-2:] == [(9, 10), (10, 10)]


def test_a_bar_never_goes_back(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("tqdm")
    with arguments.reporter(progress=True, description="work") as report:
        assert report is not None
        for of in TOLD:
            report(*of)
        report(0, 0)
    shown = [int(part) for part in re.findall(r"(\d+)%", capsys.readouterr().err)]
    assert shown == sorted(shown)
    assert shown[-1] == 100


def test_work_that_fails_or_tells_nothing_is_not_told_to_be_done() -> None:
    told: list[tuple[int, int]] = []
    with arguments.reporter(lambda *of: told.append(of), "work"):
        pass
    assert not told

    def fail() -> None:
        with arguments.reporter(lambda *of: told.append(of), "work") as report:
            assert report is not None
            report(3, 10)
            raise ValueError("enough")

    with pytest.raises(ValueError, match="enough"):
        fail()
    assert told == [(3, 10)]


@pytest.mark.parametrize(
    "options",
    [{}, {"method": tvident.StrongForm(), "damping": "auto", "stiffness": "auto"}, {"terms": ["coulomb"]}],
    ids=["weak", "strong", "terms"],
)
def test_records_share_the_whole(options: dict[str, Any]) -> None:
    random, time = np.random.default_rng(51407), np.arange(3000) / 1000
    angle = np.stack([np.sin(2 * np.pi * rate * time) + np.sin(31 * time) for rate in (1.1, 1.7, 2.3)])
    torque = 15 * angle + random.standard_normal(angle.shape)
    told: list[tuple[int, int]] = []
    tvident.identify(angle, torque, sample_rate=1000, **options, progress=lambda *of: told.append(of))
    parts = [done / total for done, total in told]
    assert parts == sorted(parts)
    assert [part for part in parts if part >= 1] == [1.0]
