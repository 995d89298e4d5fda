"""The command ``tvident plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np

import tvident
from tvident._commands.given import given
from tvident._commands.output import RECORDING, RESULTS, check_outputs, say
from tvident._equation import COEFFICIENTS
from tvident._files import RESULT_ENDINGS, printable, write_table


def plan(file: str | None, output: str | None, **options: Any) -> None:
    """Plan an experiment, or say what more of a recording would bring."""
    check_outputs({RESULTS: output}, {RECORDING: file})
    asked = given(options)
    if file is not None:
        if Path(file).suffix not in RESULT_ENDINGS:
            raise click.UsageError(
                f"a plan goes on from a result; got '{printable(file)}'; identify a recording with tvident identify … -o result.npz, "
                "and give that file"
            )
        if output is not None:
            raise click.UsageError("a plan to go on has no torque to write; got -o; leave it out")
        kept = {name: asked[name] for name in ("wanted", "more") if name in asked}
        say(tvident.plan_experiment(result=tvident.load(file), **kept).summary())
        return
    if not asked.keys() & COEFFICIENTS:
        raise click.UsageError(
            "a plan needs a guess of the system, or a result; got neither; give --inertia, --damping, --stiffness, --band and "
            "--torque-noise, or a FILE that identify saved as .npz or .parquet"
        )
    found = tvident.plan_experiment(**asked)
    say(found.summary())
    if output is not None:
        rate = asked.get("sample_rate", 1000.0)
        torque = found.excitation(sample_rate=rate)
        write_table(
            Path(output), {"time": np.arange(torque.size) / rate, "torque": torque}, {"time": "s", "torque": "N m"}
        )
