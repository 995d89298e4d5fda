"""The command ``tvident demo``."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click
import numpy as np

import tvident
from tvident._commands.output import figures_on_file, save_figure
from tvident._commands.own_files import check_own, note_own
from tvident._equation import UNITS
from tvident._files import aligned, printable, write_table

TABLES = ("recording.csv", "result.csv")
PICTURES = ("recording.png", "window.png", "window-with-noise.png", "parameters.png", "parameters-paper.png")
"""What is written."""


def demo(folder: Path, seed: int) -> None:
    """Identify a simulated recording, compare with the truth and draw the paper's figures."""
    if find_spec("matplotlib") is None:
        click.echo(
            "Pictures need matplotlib, which is not installed: pip install 'tvident[plot]'. Numbers follow.\n", err=True
        )
    folder.mkdir(parents=True, exist_ok=True)
    check_own(folder, (*TABLES, *PICTURES))
    recording = tvident.simulate_torsional_rig(seed=seed)
    call: dict[str, Any] = {"sample_rate": recording.sample_rate}
    result = tvident.identify(recording.angle, recording.torque, **call)
    paper = tvident.identify(recording.angle, recording.torque, method="paper", **call)
    click.echo(
        f"Simulated rig: {recording.time.size} samples at {recording.sample_rate:g} Hz, a slider changes the stiffness.\n"
    )
    click.echo(result.summary() + "\n")
    rows: list[tuple[str, ...]] = [
        ("parameter", "unit", "true (median)", "identified (median)", "rms error", "with --method paper")
    ]
    for name in ("inertia", "damping", "stiffness"):
        medians = [f"{np.nanmedian(getattr(one, name)):.5g}" for one in (recording, result)]
        errors = [f"{_rms_error(one, recording, name):.2%}" for one in (result, paper)]
        rows.append((name, UNITS[name], *medians, *errors))
    click.echo("\n".join([*aligned(rows), ""]))

    recording.save(folder / TABLES[0])
    write_table(folder / TABLES[1], result.columns(), result.units)
    for name in TABLES:
        note_own(folder, name)
    click.echo(f"Written to {printable(folder)}: {', '.join(TABLES)}")
    if find_spec("matplotlib") is None:
        return
    figures = figures_on_file()
    drawn = (
        figures.paper_figure_2(recording),
        figures.paper_figure_4(recording),
        figures.paper_figure_5(recording, seed=seed + 1),
        figures.plot_identification(result, recording),
        figures.paper_figure_6(paper, recording),
    )
    for name, picture in zip(PICTURES, drawn, strict=True):
        save_figure(picture, folder / name)
        note_own(folder, name)
    click.echo(f"Drawn in {printable(folder)}: {', '.join(PICTURES)}")


def _rms_error(result: tvident.Identification, truth: tvident.Recording, name: str) -> float:
    """Return the rms error of a parameter over its mean."""
    true = getattr(truth, name)
    return float(np.sqrt(np.nanmean((getattr(result, name) - true) ** 2)) / np.mean(true))
