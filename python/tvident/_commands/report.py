"""The command ``tvident report``."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click

from tvident import _report, recordings
from tvident._commands.channels import channels_in, source_of
from tvident._commands.identification import identified, inputs
from tvident._commands.named import named, with_joint
from tvident._commands.output import REPORT, RESULTS, check_outputs, end_without_result, say
from tvident._commands.words import in_options
from tvident._files import full_name, printable

_MOST_CHANNELS = 40
"""Of a file that are shown beside angle and torque: the first ones."""


def report(file: str | None, output: str, **options: Any) -> None:
    """Identify as identify does, and write a page that shows the recording and the result."""
    if output != "-" and Path(output).suffix.lower() not in {".html", ".htm"}:
        raise click.UsageError(f"-o must end in .html, or be -; got '{printable(output)}'; rename it")
    _report.check_plotly()
    options = named(options, file)
    check_outputs({RESULTS if output == "-" else REPORT: output}, inputs(file, options))
    channels = channels_in(file)
    options = with_joint(options, channels, file)
    result = identified(channels, file, **options)
    used = {
        full_name(channels, options[name], "")
        for name in ("angle", "velocity", "acceleration", "torque", "time_channel")
        if _is_in(channels, options[name])
    }
    samples = source_of(channels, options["torque"], file).shape
    others = {name: values for name, values in channels.items() if values.shape == samples and name not in used}
    for name in list(others)[_MOST_CHANNELS:]:
        del others[name]
    title = None if file in {None, "-"} else Path(file).name
    with TemporaryDirectory() as folder:
        page = Path(folder) / "report.html" if output == "-" else Path(output)
        result._report(page, others, title, said=in_options)  # noqa: SLF001 - as report does, in words of the command line
        if output == "-":
            sys.stdout.buffer.write(page.read_bytes())
    say(result.summary(), err=output == "-")
    if output != "-":
        click.echo(f"\nWritten: {printable(output)}")
    end_without_result(result.status)


def _is_in(channels: recordings.Channels, name: str | None) -> bool:
    """Return whether a name is that of a channel, and not of a file of its own."""
    try:
        return name is not None and bool(full_name(channels, name, ""))
    except KeyError:
        return False
