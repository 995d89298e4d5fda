"""Holds the result of an identification: parameters by name, standard errors, natural frequency, the summary."""

from tvident._results.curve import ExpandedParameter, of_powers
from tvident._results.estimates import Estimates
from tvident._results.expanded_fit import ExpandedFit
from tvident._results.explained import explained_steps
from tvident._results.held_back import parts_of, where_held_back
from tvident._results.loaded import from_file, list_from_file
from tvident._results.measured import Measured, known_name, number_of
from tvident._results.medians import median_of
from tvident._results.parts import chosen, of_records, samples_between, settings_of
from tvident._results.recorded import Recorded, begins_once, both_or_none, mark_of, still_there
from tvident._results.records import IdentifiedRecords, Shared, covariance_between, of_short, with_shared
from tvident._results.response import Model, accounted_for, every_sample, without_gaps
from tvident._results.result import Identification
from tvident._results.scan import Scan, scan_of
from tvident._results.short import samples_and_seconds
from tvident._results.simulated import POOR, in_units_of, predicted_ahead, predicted_at_samples
from tvident._results.stored import plain_scan, plain_words, scan_from, words_from
from tvident._results.stored_curves import curves_from, plain_curves
from tvident._results.stored_lists import KIND_OF_LISTS
from tvident._results.summary import COLUMNS, row_of, sentences_of
from tvident._results.told import Telling
from tvident._results.torque import correlated_with, kernels_of, touched_by
from tvident._results.verdict import (
    CHANGING,
    SYMBOLS,
    found_elsewhere,
    found_marked,
    how_well_known,
    known_to,
    mostly_flagged,
    negative,
    relative_error,
    share_of,
    two_digits,
    unflagged,
    unfollowed,
    verdict_of_distrusted,
    verdict_of_trusted,
    why_not,
    wrong_sign,
)
from tvident._results.windows_beside import WindowsBeside
from tvident._results.words import (
    BECOMES,
    FED_BACK,
    MARKED,
    NOT_CONSTANT,
    OF_WEAK_FORM,
    STAYS,
    TRIED,
    UNFOLLOWED,
    UNTOLD_LAG,
    Words,
    of_batch,
)

__all__ = [
    "BECOMES",
    "CHANGING",
    "COLUMNS",
    "FED_BACK",
    "KIND_OF_LISTS",
    "MARKED",
    "NOT_CONSTANT",
    "OF_WEAK_FORM",
    "POOR",
    "STAYS",
    "SYMBOLS",
    "TRIED",
    "UNFOLLOWED",
    "UNTOLD_LAG",
    "Estimates",
    "ExpandedFit",
    "ExpandedParameter",
    "Identification",
    "IdentifiedRecords",
    "Measured",
    "Model",
    "Recorded",
    "Scan",
    "Shared",
    "Telling",
    "WindowsBeside",
    "Words",
    "accounted_for",
    "begins_once",
    "both_or_none",
    "chosen",
    "correlated_with",
    "covariance_between",
    "curves_from",
    "every_sample",
    "explained_steps",
    "found_elsewhere",
    "found_marked",
    "from_file",
    "how_well_known",
    "in_units_of",
    "kernels_of",
    "known_name",
    "known_to",
    "list_from_file",
    "mark_of",
    "median_of",
    "mostly_flagged",
    "negative",
    "number_of",
    "of_batch",
    "of_powers",
    "of_records",
    "of_short",
    "parts_of",
    "plain_curves",
    "plain_scan",
    "plain_words",
    "predicted_ahead",
    "predicted_at_samples",
    "relative_error",
    "row_of",
    "samples_and_seconds",
    "samples_between",
    "scan_from",
    "scan_of",
    "sentences_of",
    "settings_of",
    "share_of",
    "still_there",
    "touched_by",
    "two_digits",
    "unflagged",
    "unfollowed",
    "verdict_of_distrusted",
    "verdict_of_trusted",
    "where_held_back",
    "why_not",
    "with_shared",
    "without_gaps",
    "words_from",
    "wrong_sign",
]
