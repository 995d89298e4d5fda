"""The command line: ``python -m accuracy``."""

from __future__ import annotations

from pathlib import Path

import click

from accuracy import cost, report, signals
from accuracy.methods import METHODS
from accuracy.results import Results
from accuracy.sections import sections
from accuracy.store import Store

_BENCHES = Path(__file__).parents[1]
_SECTIONS = sections()
_MEASUREMENTS = (*_SECTIONS, "signals", "cost")


# Options of the command.
@click.command()
@click.argument("measurements", nargs=-1, type=click.Choice(_MEASUREMENTS))
@click.option("--recordings", type=click.IntRange(min=1), help="Recordings of every case; by default 12 to 400.")
@click.option(
    "--only",
    multiple=True,
    type=click.Choice(tuple(METHODS)),
    help="Run no other method; results at hand are still shown.",
)
@click.option("--workers", type=click.IntRange(0, 2), default=2, show_default=True, help="Processes; 0: this one.")
@click.option("--seconds", type=float, default=3600.0, show_default=True, help="Length of the recording of `cost`.")
@click.option("--repeats", type=int, default=5, show_default=True, help="Repeats of `cost`.")
@click.option(
    "--store",
    type=click.Path(path_type=Path),
    default=_BENCHES / ".cache" / "accuracy.jsonl",
    help="File of results at hand; remove it to start afresh.",
)
@click.option(
    "--report",
    "path",
    type=click.Path(path_type=Path),
    default=_BENCHES / "accuracy.md",
    help="The report, in Markdown.",
)
def main(
    measurements: tuple[str, ...],
    recordings: int | None,
    only: tuple[str, ...],
    workers: int,
    seconds: float,
    repeats: int,
    store: Path,
    path: Path,
) -> None:
    """Measure how accurate identification is, print it and write it to the report.

    MEASUREMENTS are any of those named above, by default all. What was measured before, with the same versions of everything that it
    depends on, is not measured again; a run that is cut off goes on where it stopped.
    """
    kept = Store(store)
    for name in measurements or _MEASUREMENTS:
        if name == "signals":
            heading, lines = signals.HEADING, signals.measure(kept, recordings or 10, workers)
        elif name == "cost":
            heading, lines = cost.HEADING, cost.measure(seconds, repeats)
        else:
            section = _SECTIONS[name]
            results = Results(kept, recordings or section.recordings)
            results.compute(
                section.cases, [m for m in section.methods if not only or m in only], workers, section.heading
            )
            heading, lines = section.heading, section.lines(section, results)
        click.echo("\n".join([f"## {heading}", "", *lines]))
        report.replace_section(path, heading, lines)


if __name__ == "__main__":
    main()
