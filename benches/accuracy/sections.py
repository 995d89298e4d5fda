"""The measurements: which methods run on which recordings, and how a section of the report shows what came out."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import get_args

import numpy as np

from accuracy import peers, report
from accuracy.cases import Case, Pattern
from accuracy.errors import PARAMETERS
from accuracy.goals import goal
from accuracy.methods import METHODS
from accuracy.results import Results

Lines = list[str]

PATTERNS: tuple[Pattern, ...] = ("slider", "ramp", "square", "constant", "I and C vary")
NOISES = (1e-6, 1e-3, 1e-2, 3e-2, 1e-1)
ENCODERS = (4096, 1024, 256)
SIGNAL_TO_NOISE = (10.0, 30.0)
"""Torque SNR in dB, beside the usual 20."""

_KINDS = ("inertia", "damping")


@dataclasses.dataclass(frozen=True)
class Section:
    """A measurement and its section of the report.

    Parameters
    ----------
    heading : str
        Of the section.
    cases : list of Case
        Kinds of recordings.
    methods : tuple of str
        What is run on each.
    recordings : int
        How many of each case, where nothing else is asked for.
    lines : callable
        Function of the section and the results that returns the section's text.
    """

    heading: str
    cases: list[Case]
    methods: tuple[str, ...]
    recordings: int
    lines: Callable[[Section, Results], Lines]


def _channels(case: Case) -> list[Case]:
    """Return a case with every quality of the angle."""
    noisy = [dataclasses.replace(case, angle_noise=noise) for noise in NOISES]
    return noisy + [dataclasses.replace(case, encoder_counts=counts) for counts in ENCODERS]


def _counted(results: Results, cases: Sequence[Case], name: str) -> str:
    """Return a method's label, with its number of recordings where that is not what was asked for."""
    counts = {len(results.available(case, name)) for case in cases} - {0}
    label = METHODS[name].label
    if counts <= {results.recordings}:
        return label
    least, most = min(counts), max(counts)
    return f"{label} (n = {least})" if least == most else f"{label} (n = {least} … {most})"


def _errors(results: Results, case: Case, name: str) -> str:
    """Return the median errors in one cell; a star where no parameters were found for some samples."""
    missing = results.median(case, name, "missing")
    values = [results.median(case, name, parameter) for parameter in PARAMETERS]
    cell = report.triple(values, goal(case) if name == "ours" and case.torque_snr_db == Case.torque_snr_db else None)
    return f"{cell} \\*" if missing > 0 else cell


def _shown(section: Section, results: Results, cases: Sequence[Case]) -> list[str]:
    """Return the methods that there are any results of."""
    return [name for name in section.methods if any(results.of(case, name) for case in cases)]


def _seconds(results: Results, cases: Sequence[Case], name: str) -> str:
    """Return the median time of one identification."""
    times = [results.median(case, name, "seconds") for case in cases]
    return f"{np.nanmedian(times):.2g} s" if np.isfinite(times).any() else report.NOTHING


def _identification(section: Section, results: Results) -> Lines:
    text = [
        report.stamp(
            section.methods, f"{results.recordings} recordings a cell unless said otherwise, torque SNR 20 dB"
        ),
        "",
    ]
    for pattern in PATTERNS:
        cases = [case for case in section.cases if case.pattern == pattern]
        goals = [goal(case) for case in cases]
        rows = []
        for name in _shown(section, results, cases):
            cells = [_errors(results, case, name) for case in cases]
            rows.append([_counted(results, cases, name), *cells, _seconds(results, cases, name)])
        if any(goals):
            rows.insert(0, ["goal", *(report.triple(figures) if figures else "" for figures in goals), ""])
        header = [f"{pattern}: K / I / C in %", *(case.angle_label for case in cases), "time of one"]
        text += [f"### {pattern}", "", *report.table(header, rows), ""]
    text += [
        "The bound is the median error of an efficient estimator that knows the patterns up to a factor; no method here does.",
        f"Peers are given the band limit of {peers.BAND_LIMIT:g} Hz, and PyNumDiff's settings are searched for on 2 s of the record; its",
        "derivatives, like the paper's, go into least squares over 200 equations. The Kalman smoother takes the paper's derivatives",
        "and knows which parameters change. Bold: above the goal. A star: no parameters were found for some samples.",
        "",
    ]
    best = [
        values["settings"]
        for case in section.cases
        for values in results.available(case, "best")
        if "settings" in values
    ]
    weak = sum(setting.get("form") == "weak" for setting in best)
    text += [f"* Of the {len(best)} best settings known afterwards {weak} are of the weak form."] if best else []
    return text + report.refused(results.refusals(section.cases, section.methods))


def _signal_to_noise(section: Section, results: Results) -> Lines:
    text = [report.stamp(section.methods, f"{results.recordings} recordings a cell"), ""]
    for pattern in PATTERNS:
        rows = []
        cases: list[Case] = []
        for snr in SIGNAL_TO_NOISE:
            cases = [case for case in section.cases if case.pattern == pattern and case.torque_snr_db == snr]
            for name in _shown(section, results, cases):
                cells = [_errors(results, case, name) for case in cases]
                rows.append([f"{snr:g} dB, {_counted(results, cases, name)}", *cells])
        text += [*report.table([f"{pattern}: K / I / C in %", *(case.angle_label for case in cases)], rows), ""]
    return text + report.refused(results.refusals(section.cases, section.methods))


def _derivatives(section: Section, results: Results) -> Lines:
    text = [
        report.stamp(section.methods, f"{results.recordings} recordings a cell unless said otherwise"),
        "",
        "Root mean square error of θ̈ over its standard deviation, in %, on the slider's recordings. The chirp sweeps from 0.5 to 12 Hz",
        "every 10 s. The best fixed window is one of 25 … 401 samples, the best order one of 2 … 15, known afterwards.",
        "",
    ]
    for excitation in ("multisine", "chirp"):
        cases = [case for case in section.cases if case.excitation == excitation]
        rows = [
            [
                _counted(results, cases, name),
                *(report.number(results.median(case, name, "acceleration")) for case in cases),
            ]
            for name in _shown(section, results, cases)
        ]
        text += [*report.table([f"{excitation}: θ̈ in %", *(case.angle_label for case in cases)], rows), ""]
    return text + report.refused(results.refusals(section.cases, section.methods))


def _derivative_errors(section: Section, results: Results) -> Lines:
    header = ["95 % coverage; error over standard error", *(case.angle_label for case in section.cases)]
    rows = []
    for name in _shown(section, results, section.cases):
        for place, symbol in enumerate(("θ", "θ̇", "θ̈")):
            cells = []
            for case in section.cases:
                found = [values for values in results.available(case, name) if "covered" in values]
                shares = [values["covered"][place] for values in found]
                ratios = [values["error_over_stderr"][place] for values in found]
                cells.append(
                    f"{100 * np.mean(shares):.1f} %; {np.sqrt(np.mean(np.square(ratios))):.2f}"
                    if found
                    else report.NOTHING
                )
            rows.append([f"{METHODS[name].label}: {symbol}", *cells])
    return [
        report.stamp(section.methods, f"slider, {results.recordings} recordings a cell"),
        "",
        "Share of the interior's samples whose interval of ±1.96 standard errors holds the truth, and the root mean square of the error",
        "over that of the standard error.",
        "",
        *report.table(header, rows),
        "",
        *report.refused(results.refusals(section.cases, section.methods)),
    ]


def _coverage(section: Section, results: Results) -> Lines:
    header = [
        "nominal 95 %",
        *(f"{METHODS[name].label}: {symbol}" for name in section.methods for symbol in "KIC"),
        "runs",
    ]
    rows = []
    for case in section.cases:
        cells = []
        for name in section.methods:
            found = results.available(case, name)
            for parameter in PARAMETERS:
                shares = [float(values["covered"][parameter]) for values in found]
                cells.append(f"{100 * np.nanmean(shares):.1f} %" if shares else report.NOTHING)
        runs = max(len(results.available(case, name)) for name in section.methods)
        rows.append([f"{case.pattern}, {case.angle_label}", *cells, str(runs)])
    return [
        report.stamp(section.methods, f"recordings of {section.cases[0].duration:g} s, torque SNR 20 dB"),
        "",
        "Share of the interior's samples whose interval of ±1.96 standard errors holds the truth, averaged over recordings; for a",
        "constant this is the share of recordings, which 400 of them give within ±2.1 %.",
        "",
        *report.table(header, rows),
        "",
        *report.refused(results.refusals(section.cases, section.methods)),
    ]


def _constancy(section: Section, results: Results) -> Lines:
    rows = []
    false, all_runs = np.zeros(2, int), 0
    for pattern in dict.fromkeys(case.pattern for case in section.cases):
        cells = []
        for case in (case for case in section.cases if case.pattern == pattern):
            found = results.available(case, "ours")
            varying = np.array([sum(name in values["varies"] for values in found) for name in _KINDS])
            cells.append(f"{varying[0]}, {varying[1]} of {len(found)}" if found else report.NOTHING)
            if not pattern.startswith("I "):
                false += varying
                all_runs += len(found)
        rows.append([pattern, *cells])
    labels = [case.angle_label for case in _channels(Case())]
    return [
        report.stamp(section.methods, "torque SNR 20 dB"),
        "",
        "How often the inertia and the damping were found to vary: false alarms, except where *I varies* or *ramps by 5 %*, or both do.",
        "",
        *report.table(["varying I, C", *labels], rows),
        "",
        f"False alarms in all: inertia {false[0]}, damping {false[1]} of {all_runs} runs." if all_runs else "",
        *report.refused(results.refusals(section.cases, section.methods)),
    ]


def _efficiency(section: Section, results: Results) -> Lines:
    rows = []
    for case in section.cases:
        found = results.both(case, "ours-constants", "bound")
        cells = []
        for parameter in PARAMETERS:
            ratios = [values[parameter] / (100 * limit["deviations"][parameter]) for values, limit in found]
            cells.append(f"{np.sqrt(np.mean(np.square(ratios))):.2f}" if ratios else report.NOTHING)
        rows.append([case.angle_label, *cells, str(len(found))])
    uncertainty = 100 / np.sqrt(2 * results.recordings)
    return [
        report.stamp(section.methods, f"recordings of {section.cases[0].duration:g} s, torque SNR 20 dB"),
        "",
        "All parameters are constant and known to be: root mean square error over the Cramér-Rao bound, which is that of maximum",
        f"likelihood in the frequency domain. {results.recordings} recordings give the ratio within ±{uncertainty:.0f} %.",
        "",
        *report.table(["angle noise", "K", "I", "C", "runs"], rows),
        "",
        *report.refused(results.refusals(section.cases, section.methods)),
    ]


_DIFFERENTIATORS = tuple(f"{name}{tuning}" for tuning in ("", "-truth") for name in peers.DIFFERENTIATORS)
_SHORT = 12.0
"""Seconds of the recordings of which many are needed."""


def sections() -> dict[str, Section]:
    """Return every measurement on recordings of the rig by the name that the command line knows it by."""
    usual = [case for pattern in PATTERNS for case in _channels(Case(pattern))]
    other = [
        dataclasses.replace(case, torque_snr_db=snr)
        for pattern in PATTERNS
        for snr in SIGNAL_TO_NOISE
        for case in _channels(Case(pattern))
    ]
    signals = [case for excitation in ("multisine", "chirp") for case in _channels(Case(excitation=excitation))]
    short = [
        Case(pattern, angle_noise=noise, duration=_SHORT)
        for pattern in ("slider", "ramp", "constant")
        for noise in (1e-3, 1e-2, 3e-2)
    ]
    every = [case for pattern in get_args(Pattern) for case in _channels(Case(pattern))]
    found = ("bound", "ours", "best", "paper")
    windows = ("window-201", "pooled-201", "average-201", "window-101", "pooled-101", "best-order-101")
    constant = _channels(Case("constant", duration=_SHORT))
    return {
        "identification": Section(
            "Identification", usual, (*found, "kalman", "kalman-truth", *_DIFFERENTIATORS), 48, _identification
        ),
        "torque-noise": Section("Identification at other torque noise", other, found, 48, _signal_to_noise),
        "derivatives": Section(
            "Second derivative", signals, ("best-fixed", "auto-window", *windows, *_DIFFERENTIATORS), 12, _derivatives
        ),
        "derivative-errors": Section(
            "Standard errors of derivatives",
            [Case(angle_noise=1e-3), Case(angle_noise=1e-2), Case(encoder_counts=4096)],
            ("window-201", "pooled-201", "average-201", "window-101", "pooled-101", "average-101", "auto-window"),
            12,
            _derivative_errors,
        ),
        "coverage": Section("Coverage of the standard errors", short, ("ours", "paper"), 400, _coverage),
        "constancy": Section("Constant or varying", every, ("ours",), 48, _constancy),
        "efficiency": Section("Efficiency", constant, ("bound", "ours-constants"), 200, _efficiency),
    }
