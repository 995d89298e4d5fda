"""The command ``tvident simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

import tvident
from tvident._files import check_place, printable


def simulate(output: str, **options: Any) -> None:
    """Write a simulated recording of the paper's rig, with its truth, to OUTPUT: a CSV file, or of another kind by its ending."""
    check_place(Path(output))
    recording = tvident.simulate_torsional_rig(**options)
    recording.save(output)
    click.echo(f"{recording.time.size} samples written to {printable(output)}", err=True)
