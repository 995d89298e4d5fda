"""Choices for a long record, made from stretches of it: each is identified on its own, and what they choose is put together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np

from tvident._identify import Held, Span
from tvident._results import Identification, Words
from tvident._status import Status
from tvident._units import in_words_of

STRETCH, MOST = 1 << 16, 8
"""Samples of a stretch, and how many there are at most: choices from minutes of data are as good as those from hours."""


@dataclass(frozen=True)
class Choices:
    """What stretches of a record say together.

    Parameters
    ----------
    settings : dict
        As those of a result.
    record_status : int
        Flags of all stretches.
    advice : list of str
        What there is to do, with the times of the stretch that it is about.
    """

    settings: dict[str, Any]
    record_status: int
    advice: list[str]


def stretches(samples: int, step: int) -> list[Span]:
    """Return the stretches that choices are made from: evenly spread, and beginning where a result is wanted."""
    count = min(max(samples // (2 * STRETCH), 2), MOST)
    room = samples - STRETCH
    firsts = [room * place // (count - 1) // step * step for place in range(count)]
    return [(first, first + STRETCH) for first in firsts]


def chosen(
    spans: Sequence[Span],
    read: Callable[[Sequence[Span]], Held],
    identified: Callable[[Held], Identification],
    period: float,
) -> Choices:
    """Return what stretches choose.

    Raises
    ------
    ValueError
        If none of them tells anything.
    """
    found: list[tuple[Span, Identification]] = []
    for span in spans:
        result = identified(read([span]))
        if any(np.isfinite(result.stiffness)) or any(np.isfinite(value) for value, _ in result.constants.values()):
            found.append((span, result))
    if not found:
        raise ValueError(
            f"choices need a stretch with motion; none of {len(spans)} stretches determines a parameter; give settings= of another record"
        )
    settings = together([result.settings for _, result in found])
    flags = Status(0)
    lines: dict[str, list[float]] = {}
    for (first, _), result in found:
        flags |= Status(int(result.record_status))
        # What the advice is worth is not tried out: that costs more than all choices.
        words = result._words  # noqa: SLF001 - without what is tried
        for line in (words if isinstance(words, Words) else words()).advice:
            lines.setdefault(in_words_of(result.units, line), []).append(first * period)
    advice = [f"{line} (stretches at {', '.join(f'{time:.0f}' for time in times)} s)" for line, times in lines.items()]
    return Choices(settings, int(flags), advice)


def together(each: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return settings that serve all of several records: the middle of every length, and the kind that changes most."""
    settings = dict(each[0])
    for name in ("window_length", "exponent", "regression_window"):
        values = [one[name] for one in each if isinstance(one.get(name), int)]
        if name in settings and values:
            middle = sorted(values)[len(values) // 2]
            settings[name] = middle
    for name in ("lag", "angle_zero"):
        values = [one[name] for one in each if isinstance(one.get(name), int | float)]
        if name in settings and values:
            settings[name] = median(values)
    inner = {name: [one["inner"][name] for one in each if name in one["inner"]] for name in settings["inner"]}
    settings["inner"] = {name: median(values) for name, values in inner.items()}
    for name in ("lag_samples", "lag_stderr", "lag_untold", "shown_noise", "width_from", "windows_near"):
        settings.pop(name, None)
    kinds = dict(settings["kinds"])
    for name, kind in kinds.items():
        changing = [one["kinds"][name] for one in each if one["kinds"][name] not in {"constant", "known"}]
        if kind == "constant" and changing:
            kinds[name] = changing[0]
    settings["kinds"] = kinds
    settings["terms"] = [[name, kinds[name]] for name, _ in settings["terms"]]
    return settings
