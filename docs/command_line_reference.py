"""Write the reference of the command line from what its commands say themselves: ``make docs``."""

import sys
from pathlib import Path

import click
from click.testing import CliRunner

from tvident._command_line import main

WIDTH = 110
INTRODUCTION = """\
Every argument of the Python functions has an option of the same name. Results go to files or to standard output, messages and
progress to standard error, so `-o -` can be piped. The exit status is 0, 2 for a wrong call, 1 where there is no usable result or a
file cannot be used. Ctrl-C stops at once; files appear whole or not at all, keep the mode of those that they replace, and never
replace what is read. The command comes with `pip install 'tvident[cli]'`; where the program is not on the path,
`python -m tvident` runs it. `--settings` takes a TOML file of options, such as
`inertia = 0.0123` and `term = ["coulomb"]`, for several commands in tables such as `[identify]`; what
`--settings-output` wrote, or a result: NPZ and Parquet files hold
their settings, beside others stands a file with `.settings.json` behind the name of the result. So a run can be repeated from what
it wrote, to the last digit. With `--json` standard output is one JSON object whatever happens: an error is
`{"error": "…", "exit_status": 1}`. `tvident completion` prints what makes bash, zsh and fish complete.
This page is written by `make docs` from what the commands say themselves."""


def reference() -> str:
    """Return the page."""
    parts = ["# The command line", INTRODUCTION, _shown([])]
    for name in main.list_commands(click.Context(main)):
        parts += [f"## tvident {name}", _shown([name])]
    return "\n\n".join(parts) + "\n"


def _shown(command: list[str]) -> str:
    """Return what a command says of itself, as a block."""
    arguments = [*command, "--help"]
    result = CliRunner().invoke(main, arguments, prog_name="tvident", terminal_width=WIDTH, catch_exceptions=False)
    return f"```text\n$ tvident {' '.join(arguments)}\n{result.output.rstrip()}\n```"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(reference(), encoding="utf-8")
