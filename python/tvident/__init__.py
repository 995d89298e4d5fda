"""Identification of inertia, damping and stiffness that change while they are measured, and derivatives of noisy recordings."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tvident._compare import ModelComparison, compare_models
    from tvident._derivatives import LocalPolynomialFit, fit_local_polynomials, savgol_filter
    from tvident._equation import Term
    from tvident._expansion import Expansion
    from tvident._files import FileRecording, read_recording
    from tvident._identify import StrongForm, WeakForm, identify
    from tvident._in_pieces import FileIdentification, identify_file
    from tvident._merged import Chain, Matrix, Mechanism, MergedIdentification, load
    from tvident._plan import ExperimentPlan, plan_experiment
    from tvident._regression import RollingRegression, rolling_least_squares
    from tvident._results import ExpandedParameter, Identification, IdentifiedRecords, Scan
    from tvident._simulate import Recording, simulate_torsional_rig
    from tvident._status import Status
    from tvident._stream import IdentificationStream, LocalPolynomialStream, RollingStream
    from tvident._units import Channel

    __version__: str

__all__ = [
    "Chain",
    "Channel",
    "ExpandedParameter",
    "Expansion",
    "ExperimentPlan",
    "FileIdentification",
    "FileRecording",
    "Identification",
    "IdentificationStream",
    "IdentifiedRecords",
    "LocalPolynomialFit",
    "LocalPolynomialStream",
    "Matrix",
    "Mechanism",
    "MergedIdentification",
    "ModelComparison",
    "Recording",
    "RollingRegression",
    "RollingStream",
    "Scan",
    "Status",
    "StrongForm",
    "Term",
    "WeakForm",
    "compare_models",
    "fit_local_polynomials",
    "identify",
    "identify_file",
    "load",
    "plan_experiment",
    "read_recording",
    "rolling_least_squares",
    "savgol_filter",
    "simulate_torsional_rig",
]

_ROOMS = {
    "_compare": ("ModelComparison", "compare_models"),
    "_expansion": ("Expansion",),
    "_derivatives": ("LocalPolynomialFit", "fit_local_polynomials", "savgol_filter"),
    "_equation": ("Term",),
    "_files": ("FileRecording", "read_recording"),
    "_identify": ("StrongForm", "WeakForm", "identify"),
    "_merged": ("Chain", "Matrix", "Mechanism", "MergedIdentification", "load"),
    "_plan": ("ExperimentPlan", "plan_experiment"),
    "_in_pieces": ("FileIdentification", "identify_file"),
    "_regression": ("RollingRegression", "rolling_least_squares"),
    "_results": ("ExpandedParameter", "Identification", "IdentifiedRecords", "Scan"),
    "_simulate": ("Recording", "simulate_torsional_rig"),
    "_status": ("Status",),
    "_stream": ("IdentificationStream", "LocalPolynomialStream", "RollingStream"),
    "_units": ("Channel",),
}
"""Where each name comes from: a room is entered when a name of it is asked for, so that the command's help need not wait for NumPy."""

_DOORS = ("baselines", "figures", "recordings")
"""Modules that users import by their name."""


def __getattr__(name: str) -> Any:
    if name == "__version__":
        globals()[name] = import_module("tvident._choices").VERSION
        return globals()[name]
    if name in _DOORS:
        return import_module(f"tvident.{name}")
    for room, names in _ROOMS.items():
        if name in names:
            globals()[name] = getattr(import_module(f"tvident.{room}"), name)
            return globals()[name]
    raise AttributeError(f"module 'tvident' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, *_DOORS, "__doc__", "__file__", "__name__", "__path__", "__version__"])
