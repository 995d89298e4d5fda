"""Says whether test functions of different widths, and so slow and fast motion, find the same parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tvident import _core
from tvident._arguments import listed, percent, with_error
from tvident._equation import COEFFICIENTS
from tvident._status import Status

_NEAR = 3
"""Widths about the one that is used, at least, to say by how much their parameters differ."""

_TOLD = 3.0
"""Standard errors by which a number differs from zero, at least, to be told from it."""


def scales_compared(found: _core.Identification, flags: Status) -> list[str]:
    """Return over which widths of the test function the estimates agree."""
    scan = found.scan
    if scan is None:
        return []
    if scan.plateau is None and Status.SCALES_DISAGREE in flags:
        determined = len(scan.window_length)
        return [
            f"of {determined} widths of the test function, no neighbours agree"
            if determined >= _core.FEWEST_WIDTHS
            else f"{scan.tried} widths of the test function were tried; {determined or 'none'} of them determined the constants"
        ]
    if scan.plateau is None:
        return ["the record is too short to compare test functions of different widths: nothing confirms these numbers"]
    narrowest, widest = scan.plateau
    only = "" if _is_wide(scan) else " alone"
    samples = f"{scan.window_length[narrowest]} to {scan.window_length[widest]} samples"
    but_for = "" if Status.SCALES_DISAGREE in flags else _but_for(scan)
    agree = f"estimates are the same from {samples} of the test function{only}{but_for}"
    if narrowest == 0 or not scan.moved:
        return [agree]
    return [
        f"{agree}: above {scan.band[narrowest]:.2g} Hz the recording does not obey the equation; only slower motion was used"
    ]


def disagreement(
    found: _core.Identification, names: Sequence[str], units: Mapping[str, str], flags: Status
) -> list[str]:
    """Return what disagrees with what, where the flags say that something does, and where to look."""
    if Status.SCALES_DISAGREE not in flags:
        return []
    if found.scan is not None and len(found.scan.window_length) < _core.FEWEST_WIDTHS:
        words = (
            f"{_none_of_stiffness(found, names)}test functions of other widths do not determine the parameters, and nothing confirms "
            "these: noise, feedback or rest hides what they would show; excite more, or give what is known; do not trust these numbers"
        )
        return [words]
    if found.scan is None or not _is_wide(found.scan):
        words = (
            "test functions of different widths find different parameters, and none can be trusted: is a channel filtered, clipped, "
            "held or wrapped (give lag=, or make clipped samples NaN), is a term missing, or does a controller feed noise back into the "
            f"torque? result.scan().plot() shows where they differ{_by_how_much(found, names)}; do not trust these numbers"
        )
        return [words]
    narrowest, widest = (found.scan.window_length[place] for place in found.scan.plateau or (0, 0))
    others = _others(found, names, units)
    of_scan = f"test functions of {narrowest} to {widest} samples all find"
    what = (
        f"{of_scan} {listed(others)} above: what is constant depends on how long the windows of the rest are"
        if others
        else f"{of_scan} the same, but not that of {found.window_length} samples, which is used"
    )
    words = (
        f"{what}; is a term missing, does something change that was taken as constant, or does a controller feed noise back into the "
        "torque? result.scan() lists what they find; do not trust these numbers"
    )
    return [words]


def _by_how_much(found: _core.Identification, names: Sequence[str]) -> str:
    """Return by how much inertia, damping and stiffness differ from half to twice the width that is used."""
    scan, used = found.scan, found.window_length
    near = [place for place, width in enumerate(scan.window_length if scan else []) if used <= 2 * width <= 4 * used]
    if scan is None or len(near) < _NEAR:
        return ""
    differences = []
    for column, unknown in enumerate(scan.unknowns):
        values = np.array([scan.values[place][column] for place in near])
        middle = abs(float(np.median(values)))
        if names[unknown] in COEFFICIENTS and middle > 0:
            differences.append(f"{names[unknown]} by {percent(float(np.ptp(values)) / middle)}")
    if not differences:
        return ""
    narrowest, widest = (scan.window_length[place] for place in (near[0], near[-1]))
    return f" (from {narrowest} to {widest} samples {listed(differences)})"


def _but_for(scan: _core.Scan) -> str:
    """Return by how much widths that agree differ, where that is more than their errors."""
    if scan.plateau is None:
        return ""
    first, last = scan.plateau
    values, errors = (np.array(of[first : last + 1]) for of in (scan.values, scan.stderr))
    apart = np.abs(values - values[0])
    parts = apart / np.abs(values[0])
    beyond = parts[apart > _core.AGREE * np.minimum(errors, errors[0])]
    return f" but for {percent(float(beyond.max()))}, which standard errors hold" if beyond.size else ""


def _none_of_stiffness(found: _core.Identification, names: Sequence[str]) -> str:
    """Return what to try first where the stiffness is not told from zero."""
    for name, one in zip(names, found.unknowns, strict=True):
        told = np.abs(one.values) / one.stderr
        told = told[np.isfinite(told)]
        if name == "stiffness" and told.size and bool(np.median(told) < _TOLD):
            return "the stiffness is not told from zero: try stiffness=0; "
    return ""


def _others(found: _core.Identification, names: Sequence[str], units: Mapping[str, str]) -> list[str]:
    """Return the constants that differ from what the widths that agree find, and what these find."""
    scan = found.scan
    if scan is None or scan.plateau is None:
        return []
    place, words = scan.plateau[0], []
    for column, unknown in enumerate(scan.unknowns):
        one = found.unknowns[unknown]
        if one.kind != "constant":
            continue
        value, error = scan.values[place][column], scan.stderr[place][column]
        used, its_error = float(one.values[0]), float(one.stderr[0])
        if abs(value - used) > _core.OTHER_CONSTANT * float(np.hypot(error, its_error)):
            unit = units.get(names[unknown], "")
            words.append(
                f"{names[unknown]} {with_error(value, error)} {unit}, not the {with_error(used, its_error)}".replace(
                    "  ", " "
                )
            )
    return words


def _is_wide(scan: _core.Scan) -> bool:
    """Return whether widths agree over a range that is no chance."""
    if scan.plateau is None:
        return False
    narrowest, widest = scan.plateau
    return scan.window_length[widest] >= _core.LEAST_PLATEAU * scan.window_length[narrowest]
