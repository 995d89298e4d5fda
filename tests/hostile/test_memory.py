from __future__ import annotations

import sys

import pytest

from hostile import attack
from parameters import long


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of the address space")
@pytest.mark.parametrize("cases", [5, *long(13)])
def test_memory_that_runs_out_is_an_error(cases: int) -> None:
    attack.run("hostile.memory", cases=cases, share=0.1)
