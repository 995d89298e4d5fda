"""The command ``tvident plan``."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import click
import numpy as np

import tvident
from tvident._commands import plain
from tvident._commands.given import given
from tvident._commands.output import RECORDING, RESULTS, check_outputs, say
from tvident._commands.words import in_options
from tvident._equation import COEFFICIENTS
from tvident._files import keeps_result, printable, write_table


def plan(
    file: str | None,
    output: str | None,
    as_json: bool,  # noqa: FBT001 - click passes options by name
    **options: Any,
) -> None:
    """Plan an experiment, or say what more of a recording would bring."""
    check_outputs({RESULTS: output}, {RECORDING: file})
    asked = given(options)
    if file is not None:
        if not keeps_result(file):
            raise click.UsageError(
                f"a plan goes on from a result; got '{printable(file)}'; identify a recording with tvident identify … -o result.npz, "
                "and give that file"
            )
        if output is not None:
            raise click.UsageError("a plan to go on has no torque to write; got -o; leave it out")
        others = [f"--{name.replace('_', '-')}" for name in asked if name not in {"wanted", "more"}]
        if others:
            raise click.UsageError(
                f"a plan is of a guess or of a result; got '{printable(file)}' and {', '.join(others)}; leave out one of them"
            )
        kept = {name: asked[name] for name in ("wanted", "more") if name in asked}
        _show(tvident.plan_experiment(result=tvident.load(file), **kept), as_json=as_json)
        return
    if not asked.keys() & COEFFICIENTS:
        raise click.UsageError(
            "a plan needs a guess of the system, or a result; got neither; give --inertia, --damping, --stiffness, --band and "
            "--torque-noise, or a FILE that identify saved as .npz or .parquet"
        )
    if "more" in asked:
        raise click.UsageError("--more goes with FILE, which it is added to; got none; give --duration instead")
    found = tvident.plan_experiment(**asked)
    _show(found, as_json=as_json)
    if output is not None:
        rate = asked.get("sample_rate", 1000.0)
        torque = found.excitation(sample_rate=rate)
        columns = {"time": np.arange(torque.size) / rate, "torque": torque}
        write_table(Path(output), columns, {"time": "s", "torque": found.units["torque"]})


def _show(found: tvident.ExperimentPlan, *, as_json: bool) -> None:
    """Print a plan in words, or as JSON, where numbers that are none are null."""
    if not as_json:
        say(found.summary())
        return

    words = found.summary().splitlines()[0]
    content = {"verdict": in_options(words)} | {one.name: getattr(found, one.name) for one in fields(found)}
    click.echo(plain.as_json(content))
