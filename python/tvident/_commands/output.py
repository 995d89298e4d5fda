"""Output of results and figures to files and to the screen."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt

from tvident._commands.words import in_options
from tvident._files import check_apart, check_folder, check_place, printable, replaced, write_csv, write_table
from tvident._status import Status

RESULTS, PICTURE, SETTINGS, RECORDING = "results", "the picture", "the settings of this run", "the recording"
REPORT = "the report"
"""What messages call files."""


def say(words: str, *, err: bool = False) -> None:
    """Print what a result says, with options where it advises arguments."""
    click.echo(in_options(words), err=err)


def give(columns: dict[str, npt.NDArray[Any]], units: Mapping[str, str], words: str, output: str | None) -> None:
    """Write results to a file and words to standard output, or results to standard output and words to standard error."""
    if output == "-":
        write_csv(sys.stdout.buffer, columns, units)
    elif output is not None:
        write_table(output, columns, units)
    say(words, err=output == "-")


def figures_on_file() -> Any:
    """Return the module of figures, set up to draw without a screen."""
    from tvident import figures  # noqa: PLC0415 - matplotlib is optional

    import_module("matplotlib.pyplot").switch_backend("agg")
    return figures


def save_figure(figure: Any, path: Path) -> None:
    """Write a picture, which appears whole or not at all."""
    with replaced(path) as file:
        figure.savefig(file, format=path.suffix.lower().lstrip("."))


def check_outputs(outputs: Mapping[str, str | None], inputs: Mapping[str, str | None]) -> None:
    """Refuse what cannot be written, or would write over what is read, before any work is done.

    Keys are what messages call the files.
    """
    output, plot, settings = (outputs.get(name) for name in (RESULTS, PICTURE, SETTINGS))
    if output == "-" and sys.stdout is None:
        raise click.UsageError("-o - needs standard output; it is closed; open it, or give a file")
    if output is not None and output != "-":
        check_place(Path(output))
    if plot is not None:
        figures_on_file()
        if Path(plot).suffix.lower() not in {".png", ".pdf", ".svg"}:
            raise click.UsageError(f"--plot must end in .png, .pdf or .svg; got '{printable(plot)}'; rename it")
        check_folder(Path(plot))
    for place in (settings, outputs.get(REPORT)):
        if place is not None:
            check_folder(Path(place))
    files = {name: path for name, path in outputs.items() if (name, path) != (RESULTS, "-")}
    check_apart(files, inputs)


def end_without_result(status: npt.NDArray[Any]) -> None:
    """End with 1 where no sample has a value: what was written holds nothing that can be used."""
    if not status.size or (np.asarray(status) & Status.INVALID != 0).all():
        click.get_current_context().exit(1)
