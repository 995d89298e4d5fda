from __future__ import annotations

import platform

import pytest

from hostile import attack


@pytest.mark.skipif(platform.system() != "Linux", reason="limits the address space as Linux does")
def test_memory_that_runs_out_is_a_memory_error() -> None:
    attack.run("hostile.exhaustion", cases=4, share=0.1)
