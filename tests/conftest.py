from __future__ import annotations

import os
import signal
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

QUICK, SLOW, LONG = "quick", "slow", "long"
"""What `make test`, `make test-slow` and `make test-long` run: each test is in one of these groups."""
GROUP = os.environ.get("TVIDENT_TESTS") or QUICK
"""The group whose tests are run."""
if GROUP not in (QUICK, SLOW, LONG):
    raise pytest.UsageError(f"TVIDENT_TESTS is {QUICK}, {SLOW} or {LONG}, not {GROUP!r}")

# A slow machine is no failure; the seed is fixed, so that a green run stays green. `make soak` looks further.
settings.register_profile("short", deadline=None, max_examples=25, derandomize=True, print_blob=True)
settings.register_profile("long", deadline=None, max_examples=100, derandomize=True, print_blob=True)
settings.register_profile("soak", deadline=None, max_examples=2000, print_blob=True)
settings.load_profile(os.environ.get("TVIDENT_HYPOTHESIS", "long" if GROUP == LONG else "short"))


NO_RECORDINGS, A_MISSING_RECORDING = "no recordings at", "the recording "
"""How tests that need one say why they are skipped."""


def group_of(item: pytest.Item, cases: Counter[str]) -> str:
    """Give the group of a test: as it is marked, and long if it comes after the first cases of its test, of which `cases` counts."""
    if item.get_closest_marker("long") is not None:
        return LONG
    first = item.get_closest_marker("first")
    if first is not None:
        test = item.nodeid.partition("[")[0]
        cases[test] += 1
        if cases[test] > first.args[0]:
            return LONG
    return QUICK if item.get_closest_marker("slow") is None else SLOW


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what is in another group. The longest have properties of all groups among them, with more examples."""
    parted: dict[bool, list[pytest.Item]] = {True: [], False: []}
    cases: Counter[str] = Counter()
    for one in items:
        of_more_examples = GROUP == LONG and getattr(getattr(one, "obj", None), "is_hypothesis_test", False)
        parted[of_more_examples or group_of(one, cases) == GROUP].append(one)
    items[:] = parted[True]
    config.hook.pytest_deselected(items=parted[False])


@pytest.fixture(scope="session", autouse=True)
def let_interrupts_in() -> Iterator[None]:
    """Let Ctrl-C in, here and in the programs that tests start: a shell's background jobs are born ignoring it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session")
def folder_of_recordings() -> Path:
    """Give the folder of real recordings, which are not part of the project."""
    folder = Path(os.environ.get("TVIDENT_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"{NO_RECORDINGS} {folder}; set TVIDENT_DATA to where they are")
    return folder


def pytest_unconfigure(config: pytest.Config) -> None:
    """Say in the last line how many tests had no recordings: a green run does not mean that they passed."""
    reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
    if reporter is None:
        return
    reasons = [str(one.longrepr) for one in reporter.stats.get("skipped", [])]
    skipped = [reason for reason in reasons if any(words in reason for words in (NO_RECORDINGS, A_MISSING_RECORDING))]
    if skipped:
        reporter.write_line(
            f"NOT RUN: {len(skipped)} tests on real recordings, which are not part of the project; to run them, set "
            f"TVIDENT_DATA to the folder that holds them (CONTRIBUTING.md says which)",
            yellow=True,
        )
