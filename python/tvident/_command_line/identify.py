"""The command ``tvident identify``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from tvident._command_line.channels import channels_in
from tvident._command_line.group import main
from tvident._command_line.identification import IDENTIFICATION, identified, inputs
from tvident._command_line.options import PICTURE, RESULTS, RUN, SETTINGS, check_outputs
from tvident._command_line.output import give, save_figure
from tvident._files import replaced
from tvident._results import explained_steps


@main.command(epilog="Example: tvident identify rig.csv --angle angle --torque torque --time time -o result.csv")
@click.argument("file", type=click.Path(), required=False)
@IDENTIFICATION
@click.option("--settings-output", type=click.Path(dir_okay=False), help="JSON file for the settings of this run.")
@click.option("--explain", is_flag=True, help="Walk through what was asked, found, tested and tried.")
@RUN
def identify(
    file: str | None,
    settings_output: str | None,
    output: str | None,
    plot: str | None,
    explain: bool,  # noqa: FBT001 - click passes options by name
    **options: Any,
) -> None:
    """Identify inertia, damping and stiffness from the angle and torque in FILE.

    What is not given is chosen from the recording, and the summary says what and why.
    """
    check_outputs({RESULTS: output, PICTURE: plot, SETTINGS: settings_output}, inputs(file, options))
    channels = channels_in(file)
    result = identified(channels, file, **options)
    if settings_output is not None:
        with replaced(Path(settings_output)) as written:
            written.write((json.dumps(result.settings, indent=1) + "\n").encode())
    words = [explained_steps(result) if explain else result.summary()]
    for name, (value, error) in result.constants.items():
        words.append(f"{name} = {value:.8g} ± {error:.2g} {result.units.get(name, '')}".rstrip())
    give(result.columns(), result.units, "\n".join(words), output)
    if plot is not None:
        save_figure(result.plot(), Path(plot))
