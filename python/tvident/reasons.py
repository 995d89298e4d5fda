"""What the automatic choice decided and why, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tvident.result import UNITS

_NO_CHANCE = 3e-4
"""Probability below which parts of a record differ by more than chance: that of the core."""
_NOISE_MODEL_FAILS = 4.0
"""Error of prediction, over the noise's, above which the noise of the channels does not explain it: that of the core."""
_TAKES_PART = 0.3
"""A constant that has at least this share in the combination that is determined worst is named."""
_HARDLY_TOLD_APART = 500.0
"""Condition number that is worth a word: that of the core."""

_MISSING = {
    "offset": "a constant torque",
    "coulomb": "dry friction",
    "cubic": "a spring that hardens or softens",
    "lag": "a torque that comes late",
}


def reasons(found: Mapping[str, Any], names: Mapping[int, str], chosen: Mapping[str, bool]) -> list[str]:
    """Return sentences about one record.

    Parameters
    ----------
    found : mapping
        What the core returned.
    names : mapping of int to str
        What the core's unknowns are called.
    chosen : mapping of str to bool
        Which settings were chosen from the record: ``"test_function"``, ``"equations"``.

    Returns
    -------
    list of str
    """
    angle, torque = np.sqrt(found["noise"])
    words = [f"noise of the angle {angle:.2g} rad, of the torque {torque:.2g} N m"]
    length, exponent = 2 * found["half_width"] + 1, found["exponent"]
    if chosen["test_function"]:
        words.append(
            f"test function of {length} samples, exponent {exponent}: "
            "the least error to be expected from the angle's spectrum and the noise"
        )
    else:
        words.append(f"test function of {length} samples, exponent {exponent}")
    words += _windows(found, chosen)
    words += [_constancy(names[number], test) for number, _, _, test in found["constants"] if test is not None]
    if found["pooling"] is not None:
        slow = [names[number] for number in found["changing"] if names[number] in {"inertia", "damping"}]
        words.append(
            f"{' and '.join(slow)} followed by a quadratic in time over {found['pooling']:.0f} samples, which predicts best"
        )
    if found["jumps"]:
        words.append(f"jumps at {len(found['jumps'])} samples: {_listed(found['jumps'])}")
    return words + _warnings(found, names)


def _windows(found: Mapping[str, Any], chosen: Mapping[str, bool]) -> list[str]:
    if not found["lengths"]:
        return []
    error = found["prediction_error"]
    if chosen["equations"]:
        return [
            f"windows of {found['equations']} samples predict what they have not seen best: "
            f"{error:.2f} times the noise's variance; longer and shorter ones take part by how well they predict nearby"
        ]
    return [f"windows of about {found['equations']} samples, as asked for: {error:.2f} times the noise's variance"]


def _constancy(name: str, test: tuple[float, float]) -> str:
    probability, spread = test
    if probability < _NO_CHANCE:
        return f"{name} differs between eight parts of the record by {spread:.1%} beyond noise (p = {probability:.1g})"
    return f"{name} is the same in eight parts of the record (p = {probability:.2g})"


def _warnings(found: Mapping[str, Any], names: Mapping[int, str]) -> list[str]:
    words = []
    if found["prediction_error"] > _NOISE_MODEL_FAILS:
        words.append(
            f"the rows are predicted {found['prediction_error']:.1f} times worse than the noise explains: "
            "coloured noise, a lag, or a term that is missing; errors are taken from the residuals"
        )
    for name, value, error, conspicuous in found["suspects"]:
        if conspicuous:
            unit = {"lag": "samples"}.get(name, UNITS.get(name, ""))
            words.append(f"{_MISSING[name]} may be missing: {value:.3g} ± {error:.1g} {unit}")
    constants = [names[number] for number, *_ in found["constants"]]
    if found["condition"] > _HARDLY_TOLD_APART and len(constants) == len(found["weakest"]):
        parts = [name for name, part in zip(constants, found["weakest"], strict=True) if abs(part) > _TAKES_PART]
        told = "is hardly determined" if len(parts) == 1 else "are hardly told apart"
        words.append(f"{' and '.join(parts)} {told}: excite the system at more frequencies, or give one of them")
    return words


def _listed(numbers: Sequence[int], most: int = 6) -> str:
    shown = ", ".join(str(number) for number in numbers[:most])
    return shown if len(numbers) <= most else f"{shown} …"
