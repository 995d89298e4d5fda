"""The Markdown report: one section a measurement, each with its date and versions, replaced when it is measured anew."""

from __future__ import annotations

import datetime as dt
import importlib.metadata
import math
import platform
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from accuracy.methods import METHODS

NOTHING = "—"
"""What stands in a cell where nothing is known."""

_PREFACE = """# Accuracy

Written by `make accuracy`; `python -m accuracy --help` lists what can be measured.

The recordings are simulated (`tvident.simulate_torsional_rig`): I = 0.0123 kg·m², K between 10 and 20 N·m/rad, damping ratio about 1 %, a
multisine torque from 0.5 to 12 Hz, 40 s at 1 kHz where nothing else is said, with seeds that nothing was tuned on. Patterns: the stiffness
follows a *slider* (two sines), a *ramp* between two rests, a *square* wave that jumps every 4 s, or is *constant*; in *I and C vary* the
stiffness follows the slider while the inertia changes by ±30 % and three times the damping by ±50 %. The noise of the angle is given over
the angle's standard deviation; an encoder rounds instead (4096 counts are noise of 0.4 %, 1024 of 1.7 %, 256 of 7 %).

Errors are the root mean square over the record's interior (all but 7.5 % at either end) over the mean of the true parameter, in %,
median over recordings: K / I / C. For a parameter that is identified as a constant this is the relative error of that constant.
"""


def replace_section(path: Path, heading: str, lines: Iterable[str]) -> None:
    """Replace a section of the report, or append it, leaving the others as they are."""
    sections = _sections(path)
    sections[heading] = "\n".join(lines).strip()
    path.parent.mkdir(parents=True, exist_ok=True)
    body = "\n\n".join(f"## {name}\n\n{text}" for name, text in sections.items())
    path.write_text(f"{_PREFACE}\n{body}\n", encoding="utf-8")


def _sections(path: Path) -> dict[str, str]:
    """Return the text of every section that the report has by its heading."""
    if not path.exists():
        return {}
    _, *parts = path.read_text(encoding="utf-8").split("\n## ")
    headed = (part.partition("\n") for part in parts)
    return {heading.strip(): text.strip() for heading, _, text in headed}


def stamp(names: Iterable[str], note: str = "") -> str:
    """Return when and with what a section was measured."""
    packages = dict.fromkeys(["tvident", "numpy", *(p for name in names for p in METHODS[name].packages)])
    versions = [f"{package} {_version(package)}" for package in packages]
    today = dt.datetime.now(tz=dt.UTC).date().isoformat()
    told = [f"Measured {today}", f"Python {platform.python_version()}", *versions, *([note] if note else [])]
    return f"*{', '.join(told)}.*"


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return a Markdown table, its first column to the left and the others to the right."""
    rule = [":--", *["--:"] * (len(header) - 1)]
    return ["| " + " | ".join(cells) + " |" for cells in (header, rule, *rows)]


def number(value: float) -> str:
    """Return a figure in % with about two digits that count."""
    if not math.isfinite(value):
        return NOTHING
    for limit, digits in ((0.095, 3), (0.95, 2), (9.5, 1)):
        if abs(value) < limit:
            return f"{value:.{digits}f}"
    return f"{value:.0f}"


def triple(values: Sequence[float], goals: Sequence[float] | None = None) -> str:
    """Return the figures of K, I and C in one cell; bold where they miss their goal."""
    if not any(map(math.isfinite, values)):
        return NOTHING
    limits = goals or [math.inf] * len(values)
    figures = [f"**{number(v)}**" if v > limit else number(v) for v, limit in zip(values, limits, strict=True)]
    return " / ".join(figures)


def refused(said: Mapping[str, str]) -> list[str]:
    """Return a line for every method that there are no results of."""
    return [f"* Not available: {METHODS[name].label}: {reason}." for name, reason in said.items()]
