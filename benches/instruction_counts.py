"""Instructions that one window costs, counted under valgrind: the same figure on a busy machine as on an idle one.

``make record-instructions`` writes them down by compiler version and architecture; a test compares. Valgrind knows no AVX-512, so it is the
AVX2 path that is counted.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

_ROOT = Path(__file__).parents[1]
_RECORD = Path(__file__).with_name("instructions.toml")
_PACKAGE = "tvident-instructions"
_HEAD = """\
# Instructions a window, by compiler version and architecture, as `make record-instructions` counted them.
"""

Counts = dict[str, float]


def compiler() -> str:
    """Return the version of the Rust compiler that builds the core."""
    return _run("rustc", "--version").split()[1]


def architecture() -> str:
    """Return the processor's architecture."""
    return platform.machine().lower()


def count() -> Counts:
    """Build the workloads and return the instructions that a window of each costs.

    Raises
    ------
    RuntimeError
        If a program that is needed fails; its own words are in the message.
    """
    _run(
        "cargo",
        "build",
        "--quiet",
        "--profile",
        "checked",
        "--config",
        "benches/instructions/shipped.toml",
        # Of the whole workspace, so that dependencies have the features that the tests have compiled them with.
        "--workspace",
        "--bin",
        _PACKAGE,
    )
    program = str(_ROOT / "target" / "checked" / _PACKAGE)
    names = _run(program, "list").split()
    # Valgrind counts one thread and no time, so workloads may run beside each other.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        counts = pool.map(lambda name: round(_a_window(program, name), 1), names)
        return dict(zip(names, counts, strict=True))


def recorded() -> Counts:
    """Return what was recorded for this compiler and architecture; empty if nothing was."""
    return _all_recorded().get(compiler(), {}).get(architecture(), {})


def record(counts: Counts) -> None:
    """Write counts for this compiler and architecture beside those of others."""
    everything = _all_recorded()
    everything.setdefault(compiler(), {})[architecture()] = counts
    lines = [_HEAD]
    for version, architectures in sorted(everything.items()):
        for name, values in sorted(architectures.items()):
            lines += [f'["{version}".{name}]', *(f"{workload} = {value}" for workload, value in values.items()), ""]
    _RECORD.write_text("\n".join(lines), encoding="utf-8")


def _all_recorded() -> dict[str, dict[str, Counts]]:
    return tomllib.loads(_RECORD.read_text(encoding="utf-8")) if _RECORD.exists() else {}


def _a_window(program: str, workload: str) -> float:
    """Return the instructions of a window: the difference between records of one length and of two."""
    windows, instructions = zip(*(_counted(program, workload, lengths) for lengths in ("1", "2")), strict=True)
    return float((instructions[1] - instructions[0]) / (windows[1] - windows[0]))


def _counted(program: str, workload: str, lengths: str) -> tuple[int, int]:
    """Return the windows and the instructions of one run."""
    valgrind = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    finished = _finished(*valgrind, program, workload, lengths)
    counted = re.search(r"Collected : (\d+)", finished.stderr)
    if counted is None:
        raise RuntimeError(f"valgrind must say what it collected; it said {finished.stderr!r}; is it a known version?")
    return int(finished.stdout), int(counted[1])


def _run(*command: str) -> str:
    return _finished(*command).stdout


def _finished(*command: str) -> subprocess.CompletedProcess[str]:
    finished = subprocess.run(command, cwd=_ROOT, capture_output=True, text=True, check=False)  # noqa: S603 - our own programs
    if finished.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} must succeed; it returned {finished.returncode}: {finished.stderr}")
    return finished


if __name__ == "__main__":
    found = count()
    record(found)
    for workload_name, instructions_a_window in found.items():
        print(f"{workload_name:16}{instructions_a_window:8.1f}")
    sys.exit(0)
