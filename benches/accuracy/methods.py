"""Every method by name: what turns a recording into errors."""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.metadata
import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import tvident
from accuracy import bound, cases, derivatives, errors, ours, peers
from accuracy.cases import Case
from tvident import _simulate

Values = dict[str, Any]

_MEDIAN = 0.6745
"""Median magnitude of a normal variable of standard deviation 1."""


@dataclass(frozen=True)
class Method:
    """A way to get from a recording to errors.

    Parameters
    ----------
    label : str
        What the tables call it.
    run : callable
        Function of the case and one of its recordings.
    sources : tuple
        Modules that its results depend on; the package ``tvident`` stands for all that is in it. When one changes, results are
        computed anew.
    packages : tuple of str, optional
        Other packages that it needs.
    most : int, optional
        Recordings of a case at most: it takes long.
    """

    label: str
    run: Callable[[Case, tvident.Recording], Values]
    sources: tuple[ModuleType, ...]
    packages: tuple[str, ...] = ()
    most: int | None = None

    @property
    def installed(self) -> bool:
        """Whether the packages that it needs are there."""
        return all(importlib.util.find_spec(package) is not None for package in self.packages)

    def fingerprint(self) -> str:
        """Return what changes when its results may."""
        versions = [_version(package) for package in ("numpy", *self.packages)]
        return " ".join([*versions, *(_digest(source) for source in (cases, _simulate, errors, *self.sources))])

    def timed(self, case: Case, recording: tvident.Recording) -> Values:
        """Run, and add the seconds that it took."""
        start = time.perf_counter()
        values = self.run(case, recording)
        return values | {"seconds": time.perf_counter() - start}


@functools.cache
def _version(package: str) -> str:
    return importlib.metadata.version(package)


@functools.cache
def _digest(module: ModuleType) -> str:
    """Return a digest of what a module does, or all modules of a package, compiled ones included."""
    path = Path(str(module.__file__))
    files = sorted(path.parent.iterdir()) if path.name == "__init__.py" else [path]
    digest = hashlib.sha256()
    for file in files:
        if file.suffix == ".py":
            digest.update(_code(file.read_text(encoding="utf-8")).encode())
        elif file.suffix in {".so", ".pyd"}:
            digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def _code(source: str) -> str:
    """Return Python source without comments and documentation: words alone make no result outdated."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [part for part in node.body if not _is_text(part)] or [ast.Pass()]
    return ast.unparse(tree)


def _is_text(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _plain(run: Callable[[tvident.Recording], Values]) -> Callable[[Case, tvident.Recording], Values]:
    """Return a method that need not know the case."""
    return lambda _, recording: run(recording)


def _ours(label: str, run: Callable[[tvident.Recording], Values]) -> Method:
    return Method(label, _plain(run), (tvident, ours))


def _derivative(label: str, run: Callable[[tvident.Recording], Values]) -> Method:
    return Method(label, _plain(run), (tvident, derivatives))


def _peer(name: str, tuning: peers.Tuning) -> Method:
    how = "its own rule" if tuning == "rule" else "the truth"
    most = 3 if name == "rtsdiff" else 6
    return Method(
        f"PyNumDiff {name}, tuned by {how}",
        lambda _, recording: peers.pynumdiff(recording, name, tuning),
        (peers,),
        ("pynumdiff",),
        most,
    )


def _kalman(tuning: peers.Tuning) -> Method:
    how = "maximum likelihood" if tuning == "rule" else "the truth"
    label = f"statsmodels Kalman smoother, tuned by {how}"
    return Method(label, lambda _, recording: peers.kalman(recording, tuning), (peers,), ("statsmodels",), 12)


def _bound(case: Case, recording: tvident.Recording) -> Values:
    """Return the median error of an estimator that attains the Cramér-Rao bound, in %."""
    deviations = bound.relative_standard_errors(recording, *case.noise_levels(recording))
    inside = errors.interior(recording.time.size)
    values: Values = {"missing": 0.0, "deviations": deviations}
    for name, deviation in deviations.items():
        truth = getattr(recording, name)[inside]
        values[name] = 100 * _MEDIAN * deviation * float(np.sqrt(np.mean(truth**2)) / np.mean(truth))
    return values


METHODS: dict[str, Method] = {
    "bound": Method("Cramér-Rao bound, pattern known", _bound, (bound,), ("scipy",)),
    "ours": _ours('ours: `method="auto"`', ours.automatic),
    "ours-constants": _ours("ours, all constant", ours.automatic_constants),
    "best": _ours("ours, best setting known afterwards", ours.best_setting),
    "paper": _ours('paper: `method="paper"`', ours.paper),
    "kalman": _kalman("rule"),
    "kalman-truth": _kalman("truth"),
    **{name: _peer(name, "rule") for name in peers.DIFFERENTIATORS},
    **{f"{name}-truth": _peer(name, "truth") for name in peers.DIFFERENTIATORS},
    "window-201": _derivative("AICc in every window of 201 (paper)", derivatives.chosen(window_length=201)),
    "pooled-201": _derivative("AICc pooled, windows of 201", derivatives.chosen(window_length=201, selection="pooled")),
    "average-201": _derivative(
        "Akaike weights, windows of 201", derivatives.chosen(window_length=201, selection="average")
    ),
    "window-101": _derivative("AICc in every window of 101", derivatives.chosen(window_length=101)),
    "pooled-101": _derivative("AICc pooled, windows of 101", derivatives.chosen(window_length=101, selection="pooled")),
    "average-101": _derivative(
        "Akaike weights, windows of 101", derivatives.chosen(window_length=101, selection="average")
    ),
    "best-order-101": _derivative("best fixed order, windows of 101", derivatives.best_order),
    "auto-window": _derivative('ours: `window_length="auto"`', derivatives.chosen(window_length="auto")),
    "best-fixed": _derivative("best fixed window and order", derivatives.best_fixed),
}
"""Every method by the name that the command line knows it by."""
