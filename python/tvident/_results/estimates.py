"""Estimates of a batch of records, by name and in the shape of the batch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._equation import UNITS
from tvident._results.curve import ExpandedParameter
from tvident._results.scan import Scan
from tvident._status import Status

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Estimates:
    r"""Numbers of a batch of records.

    Attributes
    ----------
    values, errors : mapping of str to ndarray, shape (\*, n)
        Inertia, damping, stiffness and terms, unknown or known; errors before `factors`.
    factors : mapping of str to ndarray, shape (\*, 1)
        What standard errors are still to be multiplied by, where that is left to those who ask for them.
    covariances : mapping of frozenset to ndarray, shape (\*, n)
        Of pairs of coefficients, before `factors`.
    constants : mapping of str to (value, stderr)
        What is constant in every record: numbers for a single record, arrays in the batch's shape otherwise.
    condition, residual_std : ndarray, shape (\*, n)
    order : ndarray of uint8, shape (\*, n)
    status : ndarray of uint16, shape (\*, n)
    record_status : Status or ndarray of uint16, shape (\*)
    scans : tuple of Scan
        One a record, in weak form.
    labels : Labels, optional
        What the samples came with: an index, coordinates.
    kinds : mapping of str to ndarray of str, shape (\*)
        How every unknown of every record turned out.
    units : mapping of str to str
        Of everything by name.
    expansions : mapping of str to ExpandedParameter
        Curves of parameters that are expansions.
    in_common : mapping of str to float or ndarray, shape (\*)
        The part of the squares of errors that all samples have in common, through constants; all of them where nothing is told.
    is_part : bool
        Some of the samples of records, of all of which constants are.
    """

    values: Mapping[str, Array]
    errors: Mapping[str, Array]
    factors: Mapping[str, Array]
    covariances: Mapping[frozenset[str], Array]
    constants: Mapping[str, tuple[Any, Any]]
    condition: Array
    residual_std: Array
    order: npt.NDArray[np.uint8]
    status: npt.NDArray[np.uint16]
    record_status: Status | npt.NDArray[np.uint16]
    scans: tuple[Scan, ...] = ()
    labels: arguments.Labels | None = None
    kinds: Mapping[str, npt.NDArray[np.str_]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=lambda: UNITS)
    expansions: Mapping[str, ExpandedParameter] = field(default_factory=dict)
    in_common: Mapping[str, Any] = field(default_factory=dict)
    is_part: bool = False
