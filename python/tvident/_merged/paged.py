"""The report of trials or masses: what a page shows of each element, each channel and each torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _report
from tvident._merged.merging import Merging
from tvident._merged.words import whose

_MOST_TRIALS = 4
"""Whose channels are drawn: nobody looks at more, and the table says how trials differ."""


def report(
    result: Any,
    merging: Merging,
    path: str | Path,
    *,
    channels: Mapping[str, npt.ArrayLike] | None,
    title: str | None,
) -> None:
    """Write the report of a result, with the channels that are there."""
    _report.check_page(path)
    series, compared = [], []
    recorded = merging.recorded
    if recorded is not None and recorded.is_unchanged:
        for trial in range(min(merging.trials, _MOST_TRIALS)):
            series += _series(result, merging, trial)
            compared += _compared(result, merging, trial)
    result.held_back()  # as long as to identify: here it can be interrupted
    page = _report.ShownResult(
        result,
        values=result.elements,
        derived=lambda: _modes(result, merging),
        quality={"residual_std": result.residual_std},
        settings=_settings(result.settings),
        compared=compared,
        summary=result.summary,
        remarks=_remarks(result),
        repeats=False,
    )
    _report.write_page(path, page, series, channels, title)


def _series(result: Any, merging: Merging, trial: int) -> list[_report.Series]:
    """Return the channels of one trial."""
    recorded, angle, torque = merging.recorded, *_report.names_of_channels(result.units)
    assert recorded is not None  # noqa: S101 - for mypy
    drawn: list[tuple[str, str, Any]] = []
    for mass, (moves, drives) in enumerate(zip(recorded.angles[trial], recorded.torques[trial], strict=True)):
        name = _name(merging, trial, mass)
        drawn.append((f"{angle}{name}", "angle", moves))
        if drives is not None:
            drawn.append((f"{torque}{name}", "torque", drives))
    base = recorded.bases[trial]
    if base is not None:
        drawn.append((f"{angle} of the base", "angle", base))
    return [
        _report.series_of(result, name, of, recorded.on_result(trial, values, merging.samples))
        for name, of, values in drawn
    ]


def _compared(result: Any, merging: Merging, trial: int) -> list[_report.Compared]:
    """Return the torques of one trial beside what is predicted."""
    recorded = merging.recorded
    if not merging.parts or recorded is None:
        return []
    _, *both = result.predicted_torque(trial)
    name = _report.names_of_channels(result.units)[1]
    return [
        _report.Compared(
            f"{name}{_name(merging, trial, mass)}",
            *(recorded.on_result(trial, np.atleast_2d(one)[mass], merging.samples) for one in both),
        )
        for mass in range(max(merging.masses, 1))
    ]


def _name(merging: Merging, trial: int, mass: int) -> str:
    """Return which of several a channel is."""
    of_mass = f" {mass}" if merging.masses else ""
    return of_mass + (f" of trial {trial}" if merging.trials > 1 else "")


def _modes(result: Any, merging: Merging) -> Sequence[_report.Curve]:
    """Return natural frequencies and damping ratios; a mechanism has none."""
    if merging.inertia:
        return []
    modes, curves = result.modes, []
    for name, values, errors in (
        ("natural_frequency", modes.natural_frequency, modes.natural_frequency_stderr),
        ("damping_ratio", modes.damping_ratio, modes.damping_ratio_stderr),
    ):
        for mode, (value, error) in enumerate(zip(values, errors, strict=True)):
            words = _report.title_of(name) + (f" of mode {mode}" if len(values) > 1 else "")
            curves.append(_report.Curve(words, _report.unit_of(name, result.units), value, error))
    return curves


def _remarks(result: Any) -> dict[str, str]:
    """Return why elements cannot be known, and by how much trials differ."""
    found = {name: f"cannot be known: {why.reason}" for name, why in result.identifiable.items() if not why}
    for name, (differences, errors) in result.trial_spread.items():
        there = np.isfinite(differences) & np.isfinite(errors)
        if name not in found and there.sum() > 1:
            spread, noise = float(np.std(differences[there])), float(np.sqrt(np.mean(errors[there] ** 2)))
            found[name] = f"from trial to trial ± {spread:.2g}, of which noise explains ± {noise:.2g}"
    return found


def _settings(s: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return settings as an engineer reads them."""
    rate = float(s["sample_rate"])
    rows = [
        ("Method", f"{s['form']} form, rows merged: {whose(s['trials'], s['masses'])}"),
        ("Sample rate", f"{rate:.6g} Hz"),
        ("Test function", _report.samples_shown(s["window_length"], rate)),
        ("Exponent", ", ".join(dict.fromkeys(map(str, s["exponent"]))) or "none"),
        ("Regression windows", _report.samples_shown(s["regression_window"], rate)),
        *((_report.title_of(name), str(kind)) for name, kind in s["kinds"].items()),
    ]
    return rows if s["step"] == 1 else [*rows, ("A result for every", f"{s['step']} samples")]
