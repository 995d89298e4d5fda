"""The command ``tvident identify``."""

from __future__ import annotations

import json
import stat
from pathlib import Path
from typing import Any, get_args

import click

import tvident
from tvident import _arguments as arguments
from tvident import recordings
from tvident._command_line.channels import channel_of, mask_of, scaled, source_of
from tvident._command_line.equation import lag_of, parameter_of, terms_of
from tvident._command_line.group import main
from tvident._command_line.method import METHOD, NAMES, method_of
from tvident._command_line.options import (
    CHANNELS,
    PICTURE,
    RECORDING,
    RESULTS,
    RUN,
    SETTINGS,
    TIME,
    check_outputs,
    check_time,
    given,
    wanted_progress,
)
from tvident._command_line.output import give, save_figure
from tvident._equation import COEFFICIENTS, TERM_NAMES, UNITS
from tvident._files import printable, replaced

_MOST_BYTES = 100_000_000
"""Of settings, which are some lines for every record of a batch."""


# Every option is a parameter: so click passes them.
@main.command(epilog="Example: tvident identify rig.csv --angle angle --torque torque --time time -o result.csv")
@click.argument("file", type=click.Path(), required=False)
@CHANNELS
@TIME
@METHOD
@click.option("--inertia", metavar="KIND", help="auto, constant, windowed, varying, a known number, or a channel.")
@click.option("--damping", metavar="KIND", help="The same for damping; 0 leaves it out.")
@click.option("--stiffness", metavar="KIND", help="The same for stiffness.")
@click.option(
    "--term",
    "terms",
    multiple=True,
    metavar="TERM[:KIND]",
    help=f"{', '.join(TERM_NAMES)}; may be repeated; none removes the default offset.",
)
@click.option(
    "--instrument",
    metavar="NAME",
    help="Channel, or file, that moves the system and that no noise of the others reaches.",
)
@click.option("--lag", metavar="TIME", help="Delay of the torque: seconds, '2 ms', or auto.")
@click.option(
    "--quantisation", type=float, help="Step to which the angle was rounded; estimated if not given; 0: none."
)
@click.option("--mask", metavar="NAME", help="Channel, or file, that is not zero where a sample may be used.")
@click.option(
    "--settings", type=click.Path(), help="Settings of an earlier run: a JSON file that --settings-output wrote."
)
@click.option("--settings-output", type=click.Path(dir_okay=False), help="JSON file for the settings of this run.")
@click.option(
    "--nan-policy",
    type=click.Choice(get_args(arguments.RowPolicy)),
    default="omit",
    show_default=True,
    help="Missing values: omit their equations, propagate to all windows that contain one, or raise.",
)
@RUN
def identify(
    file: str | None,
    angle: str,
    torque: str,
    angle_scale: str | None,
    torque_scale: str | None,
    time_channel: str | None,
    method: str | None,
    terms: tuple[str, ...],
    instrument: str | None,
    lag: str | None,
    mask: str | None,
    settings: str | None,
    settings_output: str | None,
    output: str | None,
    plot: str | None,
    progress: bool | None,  # noqa: FBT001 - click passes options by name
    **options: Any,
) -> None:
    """Identify inertia, damping and stiffness from the angle and torque in FILE.

    What is not given is chosen from the recording, and the summary says what and why.
    """
    check_outputs(
        {RESULTS: output, PICTURE: plot, SETTINGS: settings_output},
        {
            RECORDING: file,
            "the angle": angle,
            "the torque": torque,
            "the mask": mask,
            "the instrument": instrument,
            "earlier settings": settings,
        },
    )
    if not check_time(options["sample_rate"], options["delta"], time_channel):
        raise click.UsageError("identify needs the sample period; got none; give --sample-rate, --delta or --time")
    of_method = {name: value for name, value in given(options).items() if name in NAMES}
    form = method_of(method, of_method, has_settings=settings is not None)
    channels = {} if file is None else recordings.read(file)
    result = tvident.identify(
        scaled(source_of(channels, angle, file), angle_scale, channels, file),
        scaled(source_of(channels, torque, file), torque_scale, channels, file),
        method=form,
        t=None if time_channel is None else channel_of(channels, time_channel, file),
        instrument=None if instrument is None else source_of(channels, instrument, file),
        lag=None if lag is None else lag_of(lag),
        mask=None if mask is None else mask_of(source_of(channels, mask, file)),
        settings=None if settings is None else _read_settings(settings),
        terms=terms_of(terms),
        progress=wanted_progress(progress),
        **{
            name: parameter_of(value, channels, file) if name in COEFFICIENTS else value
            for name, value in given(options).items()
            if name not in NAMES
        },
    )
    if settings_output is not None:
        with replaced(Path(settings_output)) as written:
            written.write((json.dumps(result.settings, indent=1) + "\n").encode())
    words = [result.summary()]
    for name, (value, error) in result.constants.items():
        words.append(f"{name} = {value:.8g} ± {error:.2g} {UNITS.get(name, '')}".rstrip())
    give(result.columns(), UNITS, "\n".join(words), output)
    if plot is not None:
        save_figure(result.plot(), Path(plot))


def _read_settings(path: str) -> dict[str, Any]:
    """Return what an earlier run chose."""
    place, cure = printable(path), "give a file that --settings-output wrote"
    kind = Path(path).stat()
    if not stat.S_ISREG(kind.st_mode) or kind.st_size > _MOST_BYTES:
        raise recordings.FileError(f"{place}: settings must be a file of at most {_MOST_BYTES} bytes; {cure}")
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise recordings.FileError(f"{place}: holds no settings ({error}); {cure}") from None
    if not isinstance(content, dict):
        raise recordings.FileError(f"{place}: holds no settings; {cure}")
    return content
