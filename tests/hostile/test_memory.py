from __future__ import annotations

import sys

import pytest

from hostile import attack


@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of the address space")
def test_memory_that_runs_out_is_an_error() -> None:
    attack.run("hostile.memory", cases=13, share=0.1)
