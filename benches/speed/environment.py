"""What was measured on: the machine and the versions."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path

from tvident import _core

PEERS = ("numpy", "scipy", "polars", "polars-ols")


def describe(*, memory_kept: bool) -> dict[str, str]:
    """Return what a reader must know to judge the figures."""
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg())
    return {
        "processor": f"{_processor()}, {_usable()} of {os.cpu_count()} processors usable, load {load} beforehand",
        "instructions": f"{', '.join(_core.available_instructions())} (the first is used unless a row says otherwise)",
        "system": f"{platform.system()} {platform.release()}, Python {platform.python_version()}",
        "tvident": f"{metadata.version('tvident')}, release build, {_compiler()}",
        "memory": "freed memory stays with the process" if memory_kept else "freed memory may go back to the system",
        "peers": ", ".join(f"{name} {metadata.version(name)}" for name in PEERS),
    }


def _processor() -> str:
    """Return the model's name where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    fields = dict(line.split(":", 1) for line in lines if ":" in line)
    named = {key.strip(): value.strip() for key, value in fields.items()}
    family = ", ".join(f"{key} {named[key]}" for key in ("cpu family", "model") if key in named)
    return f"{named.get('model name', platform.machine())} ({family})" if family else platform.machine()


def _usable() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _compiler() -> str:
    """Return the Rust compiler that is installed, which `make bench` built with."""
    try:
        version = subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "compiler unknown"
    return version.stdout.strip()
