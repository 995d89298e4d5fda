"""The report of a result: its channels, and those of the user's own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeAlias

import numpy.typing as npt

from tvident import _report
from tvident._equation import COEFFICIENTS
from tvident._results.recorded import Recorded
from tvident._results.summary import summary_of
from tvident._results.verdict import share_of, without_carried
from tvident._units import in_words_of

Row: TypeAlias = tuple[str, str]
"""A setting as a table shows it."""


def report(
    result: Any,
    path: str | Path,
    *,
    recorded: Recorded | None,
    channels: Mapping[str, npt.ArrayLike] | None,
    title: str | None,
    said: Callable[[str], str],
) -> None:
    """Write the report of the result of one record, with the channels that are there, in words that `said` passes on."""
    _report.check_page(path)
    if result.inertia.ndim != 1:
        raise ValueError(
            f"only a single record has a report; this one has shape {result.inertia.shape}; take one record"
        )
    page, shown = _shown(result, recorded, said)
    _report.write_page(path, page, shown, channels, title)


def report_list(
    records: Sequence[Any],
    path: str | Path,
    *,
    shared: Mapping[str, tuple[float, float]],
    advice: Sequence[str],
    summary: str,
    title: str | None,
) -> None:
    """Write one report of several records that were identified together."""
    _report.check_page(path)
    _report.check_count(len(records))
    _report.check_title(title)
    shown = [_shown(record, record._recorded, str) for record in records]  # noqa: SLF001 - of this room
    _report.write_list(path, _report.ShownList(shown, shared, advice, summary), title)


def _shown(
    result: Any, recorded: Recorded | None, said: Callable[[str], str]
) -> tuple[_report.ShownResult, list[_report.Series]]:
    """Return what a page shows of a result, and the channels that are there."""
    shown: list[_report.Series] = []
    compared: list[_report.Compared] = []
    share = None
    with ThreadPoolExecutor(1) as beside:
        is_there = recorded is not None and recorded.is_unchanged
        prediction = beside.submit(result.predicted_torque) if is_there else None
        # Both may take as long as to identify: here they can be interrupted.
        result.held_back()
        _ = result.advice
    if recorded is not None and prediction is not None:
        angle, torque = _report.names_of_channels(result.units)
        _, *torques = prediction.result()
        compared = [_report.Compared(torque, *torques)]
        share = share_of(torques[0], without_carried(result, torques[1]))
        shown = [
            _report.series_of(result, name, of, values)
            for name, of, values in ((angle, "angle", recorded.given[0]), (torque, "torque", recorded.given[1]))
        ]
    page = _report.ShownResult(
        result,
        values={name: getattr(result, name) for name in COEFFICIENTS} | result.terms,
        derived=lambda: [
            _report.Curve(
                _report.title_of(name), _report.unit_of(name, result.units), getattr(result, name), result.stderr[name]
            )
            for name in ("natural_frequency", "damping_ratio")
        ],
        quality={name: getattr(result, name) for name in ("residual_std", "condition", "order")},
        settings=_settings(result.settings, result.units),
        compared=compared,
        summary=lambda: summary_of(result, share),
        said=said,
    )
    return page, shown


def _settings(s: Mapping[str, Any], units: Mapping[str, str]) -> list[Row]:
    """Return settings as an engineer reads them; all of them are in the JSON below."""
    rate = float(s["sample_rate"])
    weak = s["form"] == "weak"
    rows = [
        ("Method", f"{s['method']}: {s['form']} form"),
        ("Sample rate", f"{rate:.6g} Hz"),
        ("Test function" if weak else "Window of the polynomials", _report.samples_shown(s["window_length"], rate)),
        (
            "Exponent" if weak else "Orders",
            str(s["exponent"]) if weak else f"up to {s['max_order']} by {s['criterion']}",
        ),
        ("Regression windows", _report.samples_shown(s["regression_window"], rate)),
        *((_report.title_of(name), str(kind)) for name, kind in s["kinds"].items()),
        (
            in_words_of(units, "Delay of the torque"),
            f"{s['lag']:.6g} s" if isinstance(s["lag"], int | float) else str(s["lag"]),
        ),
    ]
    if s["step"] != 1:
        rows.append(("A result for every", f"{s['step']} samples"))
    chosen = [name.replace("_", " ") for name in s["chosen"]]
    return [*rows, ("Chosen from the recording", ", ".join(chosen) or "nothing")]
