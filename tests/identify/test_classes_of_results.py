"""What users who check types are told: the class of a result by what is asked for."""

from __future__ import annotations

import inspect
from typing import Any, assert_type

import numpy as np
import numpy.typing as npt

import tvident
from tvident._identify.typed import OfOne


def told(one: npt.NDArray[np.float64], several: npt.NDArray[np.float64]) -> None:
    """Hold calls for mypy, which `make lint` runs and which fails where the class is another one; nobody calls this."""
    diagonal = tvident.Matrix("diagonal")
    assert_type(tvident.identify(one, one, sample_rate=500, stiffness=3.0), tvident.Identification)
    assert_type(tvident.identify(several, several, sample_rate=500), tvident.Identification)
    assert_type(
        tvident.identify(several, several, sample_rate=500, dof_axis=0, inertia=diagonal), tvident.MergedIdentification
    )
    assert_type(
        tvident.identify([one, one], [one, one], sample_rate=500, ensemble_axis=0), tvident.MergedIdentification
    )
    assert_type(
        tvident.identify(several, several, sample_rate=500, ensemble_axis=0, dof_axis=1), tvident.MergedIdentification
    )
    assert_type(tvident.identify([one], [one], sample_rate=500, share=("inertia",)), tvident.IdentifiedRecords)
    assert_type(tvident.identify(several, several, sample_rate=500, share="inertia"), tvident.IdentifiedRecords)
    assert_type(
        tvident.identify([one, one], [one, one], sample_rate=500), tvident.Identification | tvident.IdentifiedRecords
    )
    assert_type(tvident.identify([one, one], [one, one], sample_rate=500)[0], tvident.Identification)
    assert_type(tvident.identify([0.0, 1.0], [0.0, 1.0], sample_rate=500), tvident.Identification)
    assert_type(tvident.identify(None, one, velocity=one, sample_rate=500), tvident.Identification)
    assert_type(
        tvident.identify(one, one, sample_rate=500, stiffness=tvident.Expansion("bspline")), tvident.Identification
    )


def test_all_options_are_among_the_types() -> None:
    implementation = inspect.signature(tvident.identify).parameters
    deciding = {"dof_axis", "structure", "ensemble_axis", "phase", "share"}
    given: Any = OfOne
    assert set(implementation) - {"angle", "torque"} == deciding | given.__required_keys__ | given.__optional_keys__
