"""Runs an attack case by case in a child process, so that what crashes or hangs there fails a test here.

An attack is a module with a function ``case(seed)`` that raises where something is wrong. ``python -m hostile.attack MODULE FIRST``
repeats one case.
"""

from __future__ import annotations

import faulthandler
import importlib
import os
import re
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from pathlib import Path

SECONDS = float(os.environ.get("TVIDENT_ATTACK") or 0)
"""What all attacks together may take, set by ``make attack``; 0: each tries its first few cases, the same in every run."""

_LONGEST_CASE = 60
"""Seconds after which a case hangs: most take milliseconds, the longest some seconds on a busy machine."""

_MOST_CRASHES = 10
"""After so many an attack ends early."""

_FOUND = 3
"""What a process returns that was not killed but found something: no signal, no crash of Python's and no hang returns that."""


def run(module: str, *, cases: int, share: float) -> None:
    """Run an attack and fail with what it found.

    Parameters
    ----------
    module : str
        Where ``case`` is.
    cases : int
        How many cases belong to the short version.
    share : float
        The part of all seconds that the long version takes.
    """
    first = time.time_ns() if SECONDS else 0
    deadline = time.monotonic() + SECONDS * share
    found: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "seed"
        for _ in range(_MOST_CRASHES):
            left = max(0.0, deadline - time.monotonic())
            how_many = f"for {left} seconds" if SECONDS else f"{cases} cases"
            done = _child(module, str(first), how_many, str(place))
            if done.returncode == 0:
                break
            found.append(done.stdout)
            last = int(place.read_text(encoding="ascii") or first)
            if done.returncode == _FOUND:
                break
            found.append(
                f"seed {last} ended the process with {done.returncode}:\n{done.stderr[-3000:]}\n"
                f"repeat it with: python -m hostile.attack {module} {last}"
            )
            cases -= last + 1 - first
            first = last + 1
            if (SECONDS and time.monotonic() >= deadline) or (not SECONDS and cases <= 0):
                break
    assert not found, "\n".join(found)


def _child(*arguments: str) -> subprocess.CompletedProcess[str]:
    folder = str(Path(__file__).parents[1])
    paths = [folder, *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    return subprocess.run(
        [sys.executable, "-m", "hostile.attack", *arguments],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def _seeds(first: int, how_many: str) -> Iterator[int]:
    match how_many.split():
        case ["for", seconds, _]:
            deadline = time.monotonic() + float(seconds)
            while time.monotonic() < deadline:
                yield first
                first += 1
        case [count, _]:
            yield from range(first, first + int(count))


def main(module: str, first: str, how_many: str = "1 cases", place: str = os.devnull) -> int:
    """Try cases; print each kind of failure once, with the seed that repeats it."""
    case = importlib.import_module(module).case
    kinds: dict[str, int] = {}
    with Path(place).open("w", encoding="ascii") as now:
        for seed in _seeds(int(first), how_many):
            now.seek(0)
            now.write(str(seed))
            now.flush()
            faulthandler.dump_traceback_later(_LONGEST_CASE, exit=True)
            try:
                case(seed)
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # noqa: BLE001 - whatever it is, it is a finding
                frame = traceback.extract_tb(error.__traceback__)[-1]
                words = re.sub(r"\d+", "#", str(error))[:80]
                kind = f"{type(error).__name__} {Path(frame.filename).name}:{frame.lineno} {words}"
                kinds[kind] = kinds.get(kind, 0) + 1
                if kinds[kind] == 1:
                    found = (
                        f"repeat it with: python -m hostile.attack {module} {seed}\n{traceback.format_exc()[-3000:]}"
                    )
                    print(found, flush=True)  # noqa: T201 - the parent reads it
            faulthandler.cancel_dump_traceback_later()
    print(*(f"{count} times {kind}" for kind, count in kinds.items()), sep="\n")  # noqa: T201 - likewise
    return _FOUND if kinds else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
