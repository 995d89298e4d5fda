from __future__ import annotations

import os
import shutil

import pytest

import instruction_counts

# What another C library or linker may change; a regression worth the name is larger.
MARGIN = 0.10


def leave_out(reason: str) -> None:
    """Skip, unless skipping is forbidden: continuous integration must count."""
    if os.environ.get("TVIDENT_REQUIRE_VALGRIND"):
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.mark.long  # the core is compiled once more, as it is shipped
def test_no_window_costs_more_instructions_than_recorded() -> None:
    for program in ("valgrind", "cargo"):
        if shutil.which(program) is None:
            leave_out(f"instructions cannot be counted without {program}; install it")
    expected = instruction_counts.recorded()
    if not expected:
        compiler, architecture = instruction_counts.compiler(), instruction_counts.architecture()
        leave_out(f"no counts are recorded for rustc {compiler} on {architecture}; run `make record-instructions`")
    found = instruction_counts.count()
    assert found.keys() == expected.keys(), "workloads came or went; run `make record-instructions`"
    more = {name: (count, expected[name]) for name, count in found.items() if count > (1 + MARGIN) * expected[name]}
    less = {name: (count, expected[name]) for name, count in found.items() if count < (1 - MARGIN) * expected[name]}
    assert not more, f"more instructions a window than recorded: {more}"
    assert not less, f"fewer instructions a window than recorded, well done: run `make record-instructions`: {less}"
