"""The command ``tvident plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np

import tvident
from tvident._commands.given import given
from tvident._commands.output import RECORDING, RESULTS, check_outputs, say
from tvident._files import write_table


def plan(file: str | None, output: str | None, **options: Any) -> None:
    """Plan an experiment, or say what more of a recording would bring."""
    check_outputs({RESULTS: output}, {RECORDING: file})
    asked = given(options)
    if file is not None:
        if output is not None:
            raise click.UsageError("a plan to go on has no torque to write; got -o; leave it out")
        kept = {name: asked[name] for name in ("wanted", "more") if name in asked}
        say(tvident.plan_experiment(result=tvident.load(file), **kept).summary())
        return
    found = tvident.plan_experiment(**asked)
    say(found.summary())
    if output is not None:
        rate = asked.get("sample_rate", 1000.0)
        torque = found.excitation(sample_rate=rate)
        write_table(
            Path(output), {"time": np.arange(torque.size) / rate, "torque": torque}, {"time": "s", "torque": "N m"}
        )
