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
    return _judged(lambda: _identify(recording, preset="paper"), recording)


def automatic(recording: tvident.Recording) -> Values:
    """Identify with nothing chosen by hand."""
    return _judged(lambda: _identify(recording, preset="auto"), recording)


def automatic_constants(recording: tvident.Recording) -> Values:
    """Identify with nothing chosen but that all parameters are constant."""
    kinds = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
    return _judged(lambda: _identify(recording, preset="auto", **kinds), recording)


def best_setting(recording: tvident.Recording) -> Values:
    """Identify with every setting of a grid and keep the one with the least error of stiffness.

    Settings that this version does not know, or that the record is too short for, are passed over.
    """
    best: Values = {}
    for setting in _settings():
        try:
            found = _identify(recording, preset="paper", **setting)
        except (TypeError, ValueError):
            continue
        values: Values = errors.of_parameters(_parameters(found), recording)
        if values["missing"] == 0 and (not best or values["stiffness"] < best["stiffness"]):
            best = values | {"settings": setting}
    return best


def _settings() -> Iterator[dict[str, Any]]:
    for window_length, equations in itertools.product((51, 101, 201, 401), (100, 200, 400, 800, 1600, 3200)):
        yield {"window_length": window_length, "equations": equations}
    constants = {"inertia": "constant", "damping": "constant", "stiffness": "windowed"}
    grid = itertools.product((constants, {}), (14, 28, 56, 113, 160, 226, 320), (70, 140, 280, 560, 1120, 2240, 4480))
    for kinds, half_width, equations in grid:
        weak = {"form": "weak", "exponent": 9, "variation": "linear"}
        yield {**weak, "window_length": 2 * half_width + 1, "equations": equations, **kinds}


def _identify(recording: tvident.Recording, **options: Any) -> tvident.Identification:
    return tvident.identify(recording.angle, recording.torque, sample_rate=recording.sample_rate, workers=1, **options)


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
    flags = int(np.bitwise_or.reduce(found.status[errors.interior(recording.time.size)]))
    values["status"] = [flag.name for flag in Status if flag & flags]
    kept = ("form", "window_length", "exponent", "equations", "variation")
    values["settings"] = {name: found.settings[name] for name in kept if name in found.settings}
    return values


def _coverage(found: tvident.Identification, recording: tvident.Recording, name: str) -> float:
    """Return the share of the interior where the nominal 95 % interval holds the truth."""
    inside = errors.interior(recording.time.size)
    error = getattr(found, name)[inside] - getattr(recording, name)[inside]
    return errors.coverage(error, found.stderr[name][inside])
