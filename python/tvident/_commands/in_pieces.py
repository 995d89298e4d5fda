"""The command ``tvident identify --in-pieces``: a recording longer than memory."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

import tvident
from tvident._commands.channels import marks_missing
from tvident._commands.equation import lag_of, terms_of
from tvident._commands.given import given, wanted_progress
from tvident._commands.method import NAMES, method_of
from tvident._commands.named import with_joint_of_file
from tvident._commands.output import RECORDING, RESULTS, SETTINGS, check_outputs, say
from tvident._commands.settings import read_settings
from tvident._commands.words import units_assumed
from tvident._equation import COEFFICIENTS
from tvident._files import check_apart, replaced
from tvident._status import Status

_TAKEN = frozenset(
    {
        *NAMES,
        *COEFFICIENTS,
        *(
            "angle",
            "torque",
            "weights",
            "sample_rate",
            "delta",
            "time_channel",
            "angle_unit",
            "torque_unit",
            "method",
            "terms",
            "lag",
        ),
        *("quantisation", "nan_policy", "step", "settings", "workers", "progress"),
    }
)
"""Options that a recording which is not in memory has."""


def identify_in_pieces(
    file: str | None,
    output: str | None,
    settings_output: str | None,
    others: Mapping[str, Any],
    options: Mapping[str, Any],
) -> None:
    """Identify a recording from file to file."""
    if file in (None, "-") or output in (None, "-"):
        raise click.UsageError(
            "--in-pieces goes from a FILE to a file; got "
            f"{'a pipe' if '-' in (file, output) else 'none'}; name the file, and give -o"
        )
    options = with_joint_of_file(options, str(file))
    asked: dict[str, Any] = given(dict(options))
    refused = [
        name
        for name, value in {**asked, **given(dict(others))}.items()
        if name not in _TAKEN and value not in (False, ())
    ]
    if refused:
        raise click.UsageError(
            f"--{refused[0].replace('_', '-')} needs the whole recording in memory; got it with --in-pieces; leave one of them out"
        )
    check_outputs({SETTINGS: settings_output}, {})
    check_apart(
        {RESULTS: output, SETTINGS: settings_output}, {RECORDING: file, "earlier settings": asked.get("settings")}
    )
    of_method = {name: value for name, value in asked.items() if name in NAMES}
    settings, lag, method = asked.get("settings"), asked.get("lag"), asked.get("method")
    coefficients: dict[str, Any] = {name: _number(asked[name]) for name in COEFFICIENTS if name in asked}
    found = tvident.identify_file(
        str(file),
        str(output),
        angle=str(options["angle"]),
        torque=str(options["torque"]),
        t=asked.get("time_channel"),
        weights=asked.get("weights"),
        method=method_of(method, of_method, has_settings=settings is not None),
        settings=None if settings is None else read_settings(settings),
        lag=None if lag is None else lag_of(lag),
        terms=terms_of(asked.get("terms", ())),
        missing=marks_missing(),
        progress=wanted_progress(asked.get("progress")),
        **coefficients,
        **{
            name: asked[name]
            for name in (
                "sample_rate",
                "delta",
                "angle_unit",
                "torque_unit",
                "quantisation",
                "nan_policy",
                "step",
                "workers",
            )
            if name in asked
        },
    )
    if settings_output is not None:
        with replaced(Path(settings_output)) as written:
            written.write((json.dumps(found.settings, indent=1) + "\n").encode())
    if found.assumed:
        click.echo(units_assumed(found.assumed), err=True)
    say(found.summary())
    if found.flags.get(Status.INVALID.name or "", 0) == found.rows:
        click.get_current_context().exit(1)


def _number(value: str) -> str | float:
    """Return a kind as it is, a number as one."""
    try:
        return float(value)
    except ValueError:
        return value
