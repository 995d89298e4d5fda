"""The command ``tvident demo``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tvident._command_line.group import commands, main


@main.command()
@click.option(
    "--folder",
    type=click.Path(file_okay=False, path_type=Path),
    default="tvident-demo",
    show_default=True,
    help="Where pictures and data are written. Only files that demo wrote there itself, unchanged since, are replaced.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the simulated recording.")
def demo(**options: Any) -> None:
    """Identify a simulated recording, compare with the truth and draw the paper's figures."""
    commands().demo(**options)
