"""The command line for tests: in this process, or as a program of its own where that is what counts."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from tvident._command_line import main

TVIDENT = str(Path(sys.executable).with_name("tvident"))


def run(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command in this process: as a program it would need four times as long to start as to work."""
    words = [str(argument) for argument in arguments]
    with contextlib.chdir(cwd or Path.cwd()):
        done = CliRunner().invoke(main, words, prog_name="tvident", catch_exceptions=False)
    return subprocess.CompletedProcess(words, done.exit_code, done.stdout, done.stderr)


def run_program(*arguments: object, cwd: Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run the command as users do: its environment, its streams and its limits are its own."""
    command = [TVIDENT, *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False, timeout=60, **options)
