"""What this library finds: the paper's method, everything automatic, and the setting that would have been best."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import tvident
from accuracy import errors
from tvident import Status

Values = dict[str, Any]
"""What a method says of a recording: errors in %, and whatever else a measurement needs. Kept as JSON."""


def paper(recording: tvident.Recording) -> Values:
    """Identify by the paper's method."""
    return _judged(lambda: _identify(recording, method="paper"), recording)


def automatic(recording: tvident.Recording) -> Values:
    """Identify with nothing chosen by hand."""
    return _judged(lambda: _identify(recording, method="auto"), recording)


def automatic_constants(recording: tvident.Recording) -> Values:
    """Identify with nothing chosen but that all parameters are constant."""
    kinds = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
    return _judged(lambda: _identify(recording, method="auto", **kinds), recording)


def best_setting(recording: tvident.Recording) -> Values:
    """Identify with every setting of a grid and keep the one with the least error of stiffness.

    Settings that this version does not know, or that the record is too short for, are passed over.
    """
    best: Values = {}
    for setting in _settings():
        try:
            found = _identify(recording, **setting)
        except (TypeError, ValueError):
            continue
        values: Values = errors.of_parameters(_parameters(found), recording)
        if values["missing"] == 0 and (not best or values["stiffness"] < best["stiffness"]):
            best = values | {"settings": _kept(found)}
    return best


def _settings() -> Iterator[dict[str, Any]]:
    windowed = {"inertia": "windowed", "damping": "windowed", "stiffness": "windowed", "terms": ()}
    constants = {"inertia": "constant", "damping": "constant", "stiffness": "windowed", "terms": ()}
    for window_length, rows in itertools.product((51, 101, 201, 401), (100, 200, 400, 800, 1600, 3200)):
        strong = tvident.StrongForm(window_length=window_length, regression_window=rows)
        yield {"method": strong, "quantisation": 0.0, **windowed}
    grid = itertools.product(
        (constants, windowed), (14, 28, 56, 113, 160, 226, 320), (70, 140, 280, 560, 1120, 2240, 4480)
    )
    for kinds, half_width, rows in grid:
        weak = tvident.WeakForm(
            window_length=2 * half_width + 1, exponent=9, regression_window=rows, averaging=False, variation="linear"
        )
        yield {"method": weak, **kinds}


def _identify(recording: tvident.Recording, **options: Any) -> tvident.Identification:
    found: tvident.Identification = tvident.identify(
        recording.angle, recording.torque, sample_rate=recording.sample_rate, workers=1, **options
    )
    return found


def _parameters(found: tvident.Identification) -> dict[str, Any]:
    """Return what was found at every sample."""
    return {name: getattr(found, name) for name in errors.PARAMETERS}


def _judged(identify: Callable[[], tvident.Identification], recording: tvident.Recording) -> Values:
    """Identify and compare with the truth; where that is refused, say why."""
    try:
        found = identify()
    except (TypeError, ValueError, NotImplementedError) as refusal:
        return {"unavailable": str(refusal)}
    values: Values = errors.of_parameters(_parameters(found), recording)
    values["varies"] = [name for name in errors.PARAMETERS if name not in found.constants]
    values["covered"] = {name: _coverage(found, recording, name) for name in errors.PARAMETERS}
    flags = int(np.bitwise_or.reduce(found.status[errors.interior(recording.time.size)])) | int(found.record_status)
    values["status"] = [flag.name for flag in Status if flag & flags]
    values["settings"] = _kept(found)
    return values


def _kept(found: tvident.Identification) -> dict[str, Any]:
    """Return the settings that a report may ask for."""
    kept = ("form", "window_length", "exponent", "regression_window", "variation", "kinds")
    return {name: found.settings[name] for name in kept if name in found.settings}


def _coverage(found: tvident.Identification, recording: tvident.Recording, name: str) -> float:
    """Return the share of the interior where the nominal 95 % interval holds the truth."""
    inside = errors.interior(recording.time.size)
    error = getattr(found, name)[inside] - getattr(recording, name)[inside]
    return errors.coverage(error, found.stderr[name][inside])
