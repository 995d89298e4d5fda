"""The command ``tvident identify``."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import click
import numpy as np

from tvident._command_line.channels import channels_in
from tvident._command_line.group import main
from tvident._command_line.identification import IDENTIFICATION, identified, inputs
from tvident._command_line.options import PICTURE, RESULTS, RUN, SETTINGS, check_outputs
from tvident._command_line.output import give, save_figure
from tvident._files import RESULT_ENDINGS, replaced
from tvident._results import explained_steps
from tvident._status import Status


@main.command(epilog="Example: tvident identify rig.csv --angle angle --torque torque --time time -o result.csv")
@click.argument("file", type=click.Path(), required=False)
@IDENTIFICATION
@click.option("--settings-output", type=click.Path(dir_okay=False), help="JSON file for the settings of this run.")
@click.option("--json", "as_json", is_flag=True, help="Print verdict, numbers, advice and settings as JSON.")
@click.option("--explain", is_flag=True, help="Walk through what was asked, found, tested and tried.")
@RUN
def identify(
    file: str | None,
    settings_output: str | None,
    output: str | None,
    plot: str | None,
    as_json: bool,  # noqa: FBT001 - click passes options by name
    explain: bool,  # noqa: FBT001 - likewise
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
    if as_json:
        words = json.dumps(_plain(result), indent=1, ensure_ascii=False)
    else:
        words = explained_steps(result) if explain else result.summary()
        for name, (value, error) in result.constants.items():
            words += f"\n{name} = {value:.8g} ± {error:.2g} {result.units.get(name, '')}".rstrip()
    if output is not None and Path(output).suffix in RESULT_ENDINGS:
        result.save(output)  # with all that repeats it
        click.echo(words)
    else:
        give(result.columns(), result.units, words, output)
    if plot is not None:
        save_figure(result.plot(), Path(plot))
    if not np.isfinite(result.inertia).any():
        click.get_current_context().exit(1)


def _plain(result: Any) -> dict[str, Any]:
    """Return what the summary says as JSON has it; numbers that are none are null."""

    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    values = {
        name: result.value(name)._asdict() for name in (*result.settings["kinds"], "natural_frequency", "damping_ratio")
    }
    held_back = result.held_back()
    summary = result.summary().splitlines()
    return {
        "verdict": summary[0],
        "parameters": {
            name: {key: number(one) if isinstance(one, float) else one for key, one in value.items()}
            for name, value in values.items()
        },
        "held_back": {name: number(float(getattr(held_back, name))) for name in ("simulated", "predicted")},
        "advice": list(result.advice),
        "reasons": list(result.reasons),
        "jumps": list(result.jumps),
        "record_flags": [flag.name for flag in Status if result.record_status & flag],
        "trusted": float(np.mean(result.trusted)) if result.trusted.size else 0.0,
        "settings": result.settings,
    }
