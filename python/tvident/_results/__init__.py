"""Holds the result of an identification: parameters by name, standard errors, natural frequency, the summary."""

from tvident._results.curve import ExpandedParameter, of_powers
from tvident._results.estimates import Estimates
from tvident._results.explained import explained_steps
from tvident._results.held_back import parts_of, percent, where_held_back
from tvident._results.loaded import from_file
from tvident._results.parts import chosen, of_records, settings_of
from tvident._results.recorded import Recorded
from tvident._results.records import IdentifiedRecords, Shared, covariance_between, with_shared
from tvident._results.response import accounted_for, every_sample, without_gaps
from tvident._results.result import Identification
from tvident._results.scan import Scan, scan_of
from tvident._results.simulated import predicted_at_samples
from tvident._results.stored import plain_scan, plain_words, scan_from, words_from
from tvident._results.torque import correlated_with, kernels_of, touched_by
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
    "accounted_for",
    "chosen",
    "correlated_with",
    "covariance_between",
    "every_sample",
    "explained_steps",
    "from_file",
    "kernels_of",
    "of_batch",
    "of_powers",
    "of_records",
    "parts_of",
    "percent",
    "plain_scan",
    "plain_words",
    "predicted_at_samples",
    "scan_from",
    "scan_of",
    "settings_of",
    "touched_by",
    "where_held_back",
    "with_shared",
    "without_gaps",
    "words_from",
]
