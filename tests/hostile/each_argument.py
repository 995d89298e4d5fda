"""Every argument of every public function and method, each once with every odd value: a result, or a message that says what was wrong."""

from __future__ import annotations

import inspect
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

import tvident
from hostile import arguments
from hostile.random_calls import check_message
from tvident import baselines
from tvident._arguments import shown

mpl.use("agg")
mpl.rcParams["figure.max_open_warning"] = 0

Function = Callable[..., Any]

ODD: tuple[Any, ...] = (
    *arguments.ODD,
    *("", "a" * 5000, "\0", b"", "/", Path("/")),
    *(
        {"a": 1},
        {1: 2},
        {"x": np.ones(3)},
        {(0, 0): "x"},
        {1},
        [None],
        ["x"],
        ["auto", "auto"],
        [np.nan],
        (1, 2, 3),
        range(3),
    ),
    *([[1, 2], [3]], (np.ones(3), np.ones(4)), np.array([1, "a"], object), np.zeros(0), np.zeros((2, 0)), np.ones(300)),
    *(np.ones((300, 300)), np.full(300, np.nan), float, np.datetime64("2020"), np.timedelta64(1, "s")),
)
"""What is no sane value for anything, and what is one for something else."""

_OWN = {"progress", "ax", "family", "truth", "pattern", "inertia", "damping"}
"""Arguments that take functions of the user's own, whose errors are theirs, or places to draw."""


@cache
def _functions() -> list[tuple[Function, Mapping[str, Any]]]:
    """Return functions, each with arguments that are right."""
    t = np.arange(300) / 100
    angle = 0.2 * np.sin(7 * t) + 0.1 * np.sin(19 * t + 1)
    torque = 15 * angle + 0.1 * np.gradient(np.gradient(angle, t), t) + 0.01 * np.sin(500 * t)
    both: dict[str, Any] = {"angle": angle, "torque": torque, "sample_rate": 100}
    masses: dict[str, Any] = {
        name: np.stack([one, np.roll(one, 7)]) for name, one in (("angle", angle), ("torque", torque))
    }
    several: dict[str, Any] = {"angle": [angle, angle[:200]], "torque": [torque, torque[:200]], "sample_rate": 100}
    rows: dict[str, Any] = {"regressors": np.stack([angle, np.cos(7 * t)], axis=1), "rhs": torque}
    result = tvident.identify(**both)
    merged = tvident.identify(**masses, sample_rate=100, dof_axis=0)
    trials = tvident.identify(**masses, sample_rate=100, ensemble_axis=0)
    spring = tvident.Expansion("bspline", size=4)
    expanded = tvident.identify(**both, inertia="constant", damping="constant", stiffness=spring)
    fit = tvident.fit_local_polynomials(angle, 21, sample_rate=100)
    guess: dict[str, Any] = {
        "inertia": 0.01,
        "damping": 0.05,
        "stiffness": 15.0,
        "band": (0.5, 10),
        "torque_noise": 0.01,
        "duration": 20,
    }
    plan = tvident.plan_experiment(**guess)
    found: list[tuple[Function, Mapping[str, Any]]] = [
        (tvident.identify, both),
        (tvident.identify, {**masses, "sample_rate": 100, "dof_axis": 0}),
        (tvident.identify, {**masses, "sample_rate": 100, "ensemble_axis": 0}),
        (tvident.identify, several),
        (tvident.Chain, {"masses": 2, "springs": [("base", 0)]}),
        (tvident.Matrix, {}),
        (tvident.Mechanism, {"kinetic": {"A": lambda _q, v: v[0] ** 2 / 2}}),
        (tvident.Expansion, {"family": "bspline"}),
        (tvident.WeakForm, {}),
        (tvident.StrongForm, {}),
        (tvident.fit_local_polynomials, {"y": angle, "window_length": 21}),
        (tvident.rolling_least_squares, {"A": rows["regressors"], "b": torque, "window_length": 20}),
        (tvident.savgol_filter, {"x": angle, "window_length": 21, "polyorder": 3}),
        (tvident.plan_experiment, guess),
        (tvident.simulate_torsional_rig, {"duration": 0.2}),
        (tvident.RollingStream, {"window_length": 21}),
        (baselines.chebyshev_derivatives, {"samples": angle, "size": 5, "delta": 0.01}),
        (baselines.lanczos_derivatives, {"samples": angle, "window_length": 11, "delta": 0.01}),
        (baselines.savgol_derivatives, {"samples": angle, "window_length": 11, "polyorder": 3, "delta": 0.01}),
        (baselines.recursive_least_squares, rows),
        (baselines.random_walk_smoother, {**rows, "steps": [0.1, 0], "noise": 0.1}),
        (baselines.expanded_least_squares, {**rows, "family": "legendre", "sizes": [2, 2]}),
        (baselines.tvarx, {"angle": angle, "torque": torque, "window": 50, "delta": 0.01}),
        (baselines.compare_methods, {**both, "methods": ["forgetting"]}),
    ]
    for one in (result, merged, trials, expanded, expanded.expansions["stiffness"], fit, plan, result.scan()):
        found += [(method, {}) for method in _methods(one)]
    return found


def _methods(of: object) -> Iterator[Function]:
    for name in dir(type(of)):
        method = getattr(of, name)
        if not name.startswith("_") and inspect.ismethod(method) and inspect.signature(method).parameters:
            yield method


def case(seed: int) -> None:
    """Try all odd values of every argument of one function: the seed says of which."""
    functions = _functions()
    function, right = functions[seed % len(functions)]
    parameters = inspect.signature(function).parameters.values()
    names = [one.name for one in parameters if one.kind not in {one.VAR_KEYWORD, one.VAR_POSITIONAL}]
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in names:
            for odd in ODD:
                if name in _OWN and callable(odd):
                    continue
                in_folder = isinstance(odd, str | Path) and name == "path" and str(odd) not in {"", "\0"}
                given = {**right, name: Path(folder) / str(odd).strip("/") if in_folder else odd}
                try:
                    function(**given)
                except MemoryError:
                    continue
                except (ValueError, TypeError, KeyError, IndexError, OSError) as refused:
                    if isinstance(refused, TypeError) and "required" in str(refused):
                        break  # a method that needs more than this one
                    _check(refused, f"{getattr(function, '__qualname__', function)} {name}={shown(odd)}")


def _check(refused: Exception, call: str) -> None:
    try:
        check_message(refused)
    except AssertionError as wrong:
        raise AssertionError(f"{call}: {wrong}") from refused
