"""Reads recordings from files and writes tables to them."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tvident._files.arrow_names import named_field, units_of_table
from tvident._files.beside import check_beside, place_beside, settings_beside, write_settings
from tvident._files.channels import Channels, FileError, FileWarning, channel, full_name
from tvident._files.names import listed, printable
from tvident._files.places import ENDINGS as TABLE_ENDINGS
from tvident._files.places import check_apart, check_folder, check_place
from tvident._files.replacement import errors_name, put_in_place, replaced
from tvident._files.results import keeps_result, read_result, write_result
from tvident._files.table import aligned, write_csv, write_table
from tvident._files.unpacked import ending_of

if TYPE_CHECKING:
    from tvident._files.beginnings import ending_by
    from tvident._files.counts import counters
    from tvident._files.joints import joint_of
    from tvident._files.no_values import marks_given, without_marks
    from tvident._files.rates import other_rate
    from tvident._files.recorded import FileRecording, read_recording, said_otherwise
    from tvident._files.recordings import TEXT_ENDINGS, read
    from tvident._files.single_rates import RatesDifferError, check_alike, no_rate_told, told_rates
    from tvident._files.stated import no_rate_stated, stated_rate
    from tvident._files.text import copy_text, names_of_text
    from tvident._files.which_clock import check_no_counts, clock_among, increasing_times, time_channels

__all__ = [
    "TABLE_ENDINGS",
    "TEXT_ENDINGS",
    "Channels",
    "FileError",
    "FileRecording",
    "FileWarning",
    "RatesDifferError",
    "aligned",
    "channel",
    "check_alike",
    "check_apart",
    "check_beside",
    "check_folder",
    "check_no_counts",
    "check_place",
    "clock_among",
    "copy_text",
    "counters",
    "ending_by",
    "ending_of",
    "errors_name",
    "full_name",
    "increasing_times",
    "joint_of",
    "keeps_result",
    "listed",
    "marks_given",
    "named_field",
    "names_of_text",
    "no_rate_stated",
    "no_rate_told",
    "other_rate",
    "place_beside",
    "printable",
    "put_in_place",
    "read",
    "read_recording",
    "read_result",
    "replaced",
    "said_otherwise",
    "settings_beside",
    "stated_rate",
    "time_channels",
    "told_rates",
    "units_of_table",
    "without_marks",
    "write_csv",
    "write_result",
    "write_settings",
    "write_table",
]

_READERS = {
    "counters": "counts",
    "ending_by": "beginnings",
    "joint_of": "joints",
    "marks_given": "no_values",
    "other_rate": "rates",
    "without_marks": "no_values",
    "FileRecording": "recorded",
    "read_recording": "recorded",
    "said_otherwise": "recorded",
    "read": "recordings",
    "TEXT_ENDINGS": "recordings",
    "no_rate_stated": "stated",
    "stated_rate": "stated",
    "copy_text": "text",
    "names_of_text": "text",
    "RatesDifferError": "single_rates",
    "check_alike": "single_rates",
    "no_rate_told": "single_rates",
    "told_rates": "single_rates",
    "check_no_counts": "which_clock",
    "clock_among": "which_clock",
    "increasing_times": "which_clock",
    "time_channels": "which_clock",
}
"""Where what reads comes from: entered when first asked for, since it takes a quarter of what all of `identify` takes to load."""


def __getattr__(name: str) -> Any:
    if name not in _READERS:
        raise AttributeError(f"module 'tvident._files' has no attribute {name!r}")
    globals()[name] = getattr(import_module(f"tvident._files.{_READERS[name]}"), name)
    return globals()[name]
