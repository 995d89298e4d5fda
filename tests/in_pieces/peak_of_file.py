"""Identify a file in a process of its own and print by how many bytes it raised the most memory the process ever held."""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path
from typing import Any

import tvident


def held(field: str) -> int:
    """Return bytes that the kernel says this process holds (VmRSS), or ever held since the record was cleared (VmHWM)."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith(field):
            return int(line.split()[1]) * 1024
    raise LookupError(field)


def main(source: str, target: str, method: str) -> int:
    """Return by how many bytes the call raised the peak."""
    given: dict[str, Any] = {
        "paper": {"method": "paper"},
        "given": {"method": "auto"},
    }
    rig = tvident.simulate_torsional_rig(duration=4, sample_rate=1000, seed=1)
    # Loads the code and starts the threads.
    some = tvident.identify(rig.angle, rig.torque, sample_rate=1000, **given[method])
    if method == "given":
        given[method]["settings"] = some.settings
    ctypes.CDLL(None).malloc_trim(0)
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    before = held("VmRSS")
    tvident.identify_file(source, target, angle="angle", torque="torque", sample_rate=1000, step=100, **given[method])
    return held("VmHWM") - before


if __name__ == "__main__":
    print(main(*sys.argv[1:]))  # noqa: T201 - for the test that called
