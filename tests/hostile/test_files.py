from __future__ import annotations

import pytest

from hostile import attack


@pytest.mark.slow
def test_text_is_read_as_it_stands_there_or_refused() -> None:
    attack.run("hostile.text_files", cases=150, share=0.1)


@pytest.mark.slow
def test_damaged_arrays_are_read_or_refused() -> None:
    attack.run("hostile.array_files", cases=16, share=0.1)


def test_outputs_cost_nothing_that_was_there() -> None:
    attack.run("hostile.outputs", cases=4, share=0.1)
