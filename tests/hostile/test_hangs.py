from __future__ import annotations

import subprocess
import sys

import pytest

from hostile import attack

_INTERRUPTED_IN_NUMPY = """
import sys, types
import numpy, tvident, tvident._core, tvident._derivatives

class Interrupted(types.ModuleType):
    def __getattr__(self, name):
        raise KeyboardInterrupt

for name in ("numpy._core.multiarray", "numpy.core.multiarray"):
    sys.modules[name] = Interrupted(name)
assert tvident.savgol_filter([0.0, 1.0, 2.0, 3.0, 4.0], 5, 1).tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
"""


@pytest.mark.slow
def test_what_nobody_can_mean_ends_at_once() -> None:
    attack.run("hostile.hangs", cases=6, share=0.1)


def test_ctrl_c_ends_every_call() -> None:
    attack.run("hostile.interrupts", cases=6, share=0.1)


def test_the_first_array_needs_nothing_that_an_interrupt_can_end() -> None:
    subprocess.run([sys.executable, "-c", _INTERRUPTED_IN_NUMPY], check=True)
