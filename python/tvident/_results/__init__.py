"""Holds the result of an identification: parameters by name, standard errors, natural frequency, the summary."""

from tvident._results.curve import ExpandedParameter, of_powers
from tvident._results.estimates import Estimates
from tvident._results.explained import explained_steps
from tvident._results.loaded import load
from tvident._results.parts import chosen, of_records, settings_of
from tvident._results.recorded import Recorded
from tvident._results.records import IdentifiedRecords, Shared, covariance_between, with_shared
from tvident._results.result import Identification
from tvident._results.scan import Scan
from tvident._results.simulated import predicted_at_samples
from tvident._results.words import Words, of_batch

__all__ = [
    "Estimates",
    "ExpandedParameter",
    "Identification",
    "IdentifiedRecords",
    "Recorded",
    "Scan",
    "Shared",
    "Words",
    "chosen",
    "covariance_between",
    "explained_steps",
    "load",
    "of_batch",
    "of_powers",
    "of_records",
    "predicted_at_samples",
    "settings_of",
    "with_shared",
]
