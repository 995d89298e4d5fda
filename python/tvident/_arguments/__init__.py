"""Checks what users pass: every message states the rule, the value that broke it and the cure."""

from tvident._arguments.arrays import NanPolicy, RowPolicy, along_axis, any_array, check_nan, mask, real_array
from tvident._arguments.numbers import (
    LARGEST,
    finite_number,
    flag,
    is_word,
    one_of,
    positive_number,
    real_number,
    whole_number,
)
from tvident._arguments.progress import Progress, reporter
from tvident._arguments.sampling import check_power, check_window, length_given, sample_period, seconds, window_length
from tvident._arguments.shown import shown
from tvident._arguments.workers import worker_count
from tvident._arguments.wrapped import Unwrapped, unwrapped

__all__ = [
    "LARGEST",
    "NanPolicy",
    "Progress",
    "RowPolicy",
    "Unwrapped",
    "along_axis",
    "any_array",
    "check_nan",
    "check_power",
    "check_window",
    "finite_number",
    "flag",
    "is_word",
    "length_given",
    "mask",
    "one_of",
    "positive_number",
    "real_array",
    "real_number",
    "reporter",
    "sample_period",
    "seconds",
    "shown",
    "unwrapped",
    "whole_number",
    "window_length",
    "worker_count",
]
