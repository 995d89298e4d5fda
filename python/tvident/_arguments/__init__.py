"""Checks what users pass: every message states the rule, the value that broke it and the cure."""

from tvident._arguments.arrays import NanPolicy, RowPolicy, along_axis, check_nan, mask, real_array
from tvident._arguments.numbers import finite_number, one_of, positive_number, whole_number
from tvident._arguments.progress import Progress, reporter
from tvident._arguments.sampling import check_window, length_given, sample_period, seconds, window_length
from tvident._arguments.workers import worker_count

__all__ = [
    "NanPolicy",
    "Progress",
    "RowPolicy",
    "along_axis",
    "check_nan",
    "check_window",
    "finite_number",
    "length_given",
    "mask",
    "one_of",
    "positive_number",
    "real_array",
    "reporter",
    "sample_period",
    "seconds",
    "whole_number",
    "window_length",
    "worker_count",
]
