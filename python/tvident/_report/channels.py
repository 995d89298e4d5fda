"""The channels of a page: those of the recording, and those of the user's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files import listed
from tvident._report.content import ReportedResult, ShownResult, unit_of
from tvident._report.packed import Series
from tvident._report.written import write_report
from tvident._units import in_words_of, named_unit, unit_said


def check_page(path: str | Path) -> None:
    """Refuse a name that is not that of a page."""
    if arguments.path_of("path", path).suffix.lower() not in {".html", ".htm"}:
        raise ValueError(f"a report is a page: its name must end in .html; got {arguments.shown(str(path))}; rename it")


def names_of_channels(units: Mapping[str, str]) -> tuple[str, str]:
    """Return what moves and what drives, by the units of results."""
    return in_words_of(units, "Angle"), in_words_of(units, "Torque")


def series_of(result: ReportedResult, name: str, of: str, values: npt.ArrayLike, *, unit: str | None = None) -> Series:
    """Return a recorded channel as a page shows it."""
    start = float(result.time[0]) if result.time.size else 0.0
    shown = unit_of(of, result.units) if unit is None else unit
    numbers = arguments.real_array("channels", values)
    return Series(name, shown, numbers, start, 1 / float(result.settings["sample_rate"]), is_recorded=True)


def write_page(
    path: str | Path,
    page: ShownResult,
    recorded: Sequence[Series],
    channels: Mapping[str, npt.ArrayLike] | None,
    title: str | None,
) -> None:
    """Write a page with what was recorded, and with other channels of the user.

    Raises
    ------
    ValueError
        If a channel does not have a value for every sample.
    """
    if not isinstance(channels, Mapping | None):
        raise TypeError(
            f"channels must be a mapping of names to samples; got {arguments.shown(channels)}; write {{'force [N]': samples}}, say"
        )
    check_title(title)
    result, drawn = page.result, list(recorded)
    step, samples = int(result.settings["step"]), max((one.values.size for one in recorded), default=None)
    for name, values in (channels or {}).items():
        numbers = arguments.real_array("channels", values)
        count = (result.time.size - 1) * step + 1
        fits = numbers.shape == (samples,) if samples is not None else count <= numbers.size < count + step
        if numbers.ndim != 1 or not fits:
            raise ValueError(
                f"channels must have one value for every sample of the recording; got {arguments.shown(name)} with shape "
                f"{numbers.shape}; leave out {listed([name])}, or cut it"
            )
        bare, unit = named_unit(name)
        drawn.append(series_of(result, bare, "", numbers, unit=unit or unit_said(values)))
    write_report(path, page, drawn, title)


def check_title(title: str | None) -> None:
    """Refuse a title that is no text."""
    if not isinstance(title, str | None):
        raise TypeError(f"title must be text; got {arguments.shown(title)}; write it in quotes")


def samples_shown(value: Any, rate: float) -> str:
    """Return a number of samples, or several, with what they last."""
    several = value if isinstance(value, list) else [value]
    words = [f"{one} samples ({one / rate:.3g} s)" if isinstance(one, int | float) else str(one) for one in several]
    return ", ".join(dict.fromkeys(words)) or "none"
