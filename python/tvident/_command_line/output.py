"""Output of results and figures to files and to the screen."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import click
import numpy.typing as npt

from tvident._files import replaced, write_csv, write_table


def give(columns: dict[str, npt.NDArray[Any]], units: Mapping[str, str], words: str, output: str | None) -> None:
    """Write results to a file and words to standard output, or results to standard output and words to standard error."""
    if output == "-":
        write_csv(sys.stdout.buffer, columns, units)
    elif output is not None:
        write_table(output, columns, units)
    click.echo(words, err=output == "-")


def figures_on_file() -> Any:
    """Return the module of figures, set up to draw without a screen."""
    from tvident import figures  # noqa: PLC0415 - matplotlib is optional

    import_module("matplotlib.pyplot").switch_backend("agg")
    return figures


def save_figure(figure: Any, path: Path) -> None:
    """Write a picture, which appears whole or not at all."""
    with replaced(path) as file:
        figure.savefig(file, format=path.suffix.lower().lstrip("."))
