"""Checks what users pass: every message states the rule, the value that broke it and the cure."""

from tvident._arguments.arrays import (
    along_axis,
    any_array,
    check_nan,
    is_read_as_it_is,
    mask,
    real_array,
    some_weights,
    weights,
)
from tvident._arguments.channels import as_record, channel, channels
from tvident._arguments.containers import fields_of, is_table, package_of, plain, time_axis
from tvident._arguments.digits import explained_in_words, ordinal, own_digits, percent, to_digits_of, with_error
from tvident._arguments.labelled import check_against_labels, cure_by_labels, implied_times, is_called_time, is_time
from tvident._arguments.labels import Labels, labels_in, labels_of, labels_out
from tvident._arguments.lost import check_no_lost_samples
from tvident._arguments.marks import CLOSE_TO_MARK, marks_in
from tvident._arguments.needed import called_as
from tvident._arguments.numbers import (
    LARGEST,
    finite_number,
    flag,
    is_several,
    is_word,
    mapping,
    one_of,
    positive_number,
    real_number,
    whole_number,
)
from tvident._arguments.paths import path_of
from tvident._arguments.progress import Progress, WatchedProgress, reporter
from tvident._arguments.ranges import finite, percentiles, told_once
from tvident._arguments.sampling import (
    MAY_BE_DAYS,
    check_power,
    check_window,
    delay,
    in_unit_of_time,
    length_given,
    sample_period,
    seconds,
    window_length,
)
from tvident._arguments.shown import listed, nearest, shown
from tvident._arguments.times import (
    NotUniformError,
    begin_of,
    check_no_counts,
    clock_changed,
    counted_since_1970,
    irregular_at_sight,
    printed_step,
    rounding,
    times_of,
)
from tvident._arguments.workers import worker_count
from tvident._arguments.wrapped import Unwrapped, unwrapped
from tvident._choices import NanPolicy, RowPolicy

__all__ = [
    "CLOSE_TO_MARK",
    "LARGEST",
    "MAY_BE_DAYS",
    "Labels",
    "NanPolicy",
    "NotUniformError",
    "Progress",
    "RowPolicy",
    "Unwrapped",
    "WatchedProgress",
    "along_axis",
    "any_array",
    "as_record",
    "begin_of",
    "called_as",
    "channel",
    "channels",
    "check_against_labels",
    "check_nan",
    "check_no_counts",
    "check_no_lost_samples",
    "check_power",
    "check_window",
    "clock_changed",
    "counted_since_1970",
    "cure_by_labels",
    "delay",
    "explained_in_words",
    "fields_of",
    "finite",
    "finite_number",
    "flag",
    "implied_times",
    "in_unit_of_time",
    "irregular_at_sight",
    "is_called_time",
    "is_read_as_it_is",
    "is_several",
    "is_table",
    "is_time",
    "is_word",
    "labels_in",
    "labels_of",
    "labels_out",
    "length_given",
    "listed",
    "mapping",
    "marks_in",
    "mask",
    "nearest",
    "one_of",
    "ordinal",
    "own_digits",
    "package_of",
    "path_of",
    "percent",
    "percentiles",
    "plain",
    "positive_number",
    "printed_step",
    "real_array",
    "real_number",
    "reporter",
    "rounding",
    "sample_period",
    "seconds",
    "shown",
    "some_weights",
    "time_axis",
    "times_of",
    "to_digits_of",
    "told_once",
    "unwrapped",
    "weights",
    "whole_number",
    "window_length",
    "with_error",
    "worker_count",
]
