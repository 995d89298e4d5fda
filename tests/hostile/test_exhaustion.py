from __future__ import annotations

import platform
import subprocess
import sys

import pytest

from hostile import attack

_LIMITED = pytest.mark.skipif(platform.system() != "Linux", reason="limits the address space as Linux does")

_WITH_MANY_WORKERS = """
import pathlib, resource
import numpy as np, tvident
x = np.sin(np.arange(200_000) / 20) + 1e-3 * np.random.default_rng(0).standard_normal(200_000)
alone = tvident.fit_local_polynomials(x, 51, workers=1)
with open("/proc/self/statm") as file:
    size = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (size + (700 << 20), resource.RLIM_INFINITY))
together = tvident.fit_local_polynomials(x, 51, workers=24)
np.testing.assert_array_equal(together.derivatives, alone.derivatives)
names = [task.joinpath("comm").read_text() for task in pathlib.Path("/proc/self/task").iterdir()]
print(sum(name.startswith("tvident-") for name in names))
"""


@_LIMITED
def test_memory_that_runs_out_is_a_memory_error() -> None:
    attack.run("hostile.exhaustion", cases=4, share=0.1)


@_LIMITED
def test_threads_are_as_many_as_there_is_memory_for() -> None:
    """The C library reserves 64 or 128 MiB of addresses for what a thread allocates; one without them may end the process."""
    done = subprocess.run([sys.executable, "-c", _WITH_MANY_WORKERS], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert 1 <= int(done.stdout) <= 700 // 64
