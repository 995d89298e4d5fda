"""What nothing chosen by hand costs: the time of the automatic method over that of the paper's, on an hour at 1 kHz."""

from __future__ import annotations

import os
import time
from typing import Literal, TypeAlias

import numpy as np

import tvident
from accuracy import report
from accuracy.cases import Case

HEADING = "Cost of the automatic method"
_NOISES = (1e-6, 1e-2, 1e-1)
_Method: TypeAlias = Literal["paper", "auto"]
_METHODS: tuple[_Method, ...] = ("paper", "auto")


def measure(seconds: float, repeats: int) -> list[str]:
    """Time both methods in turns and return the section of the report."""
    rows, refusal = [], ""
    for noise in _NOISES:
        case = Case(angle_noise=noise, duration=seconds)
        recording = case.record(0)
        for workers in sorted({1, min(2, os.cpu_count() or 1)}):
            try:
                ratios, paper, chosen = _ratios(recording, repeats, workers)
            except (TypeError, ValueError, NotImplementedError) as error:
                refusal = str(error)
                continue
            low, middle, high = np.percentile(ratios, [0, 50, 100])
            ratio = f"{middle:.1f} ({low:.1f} … {high:.1f})"
            rows.append([case.angle_label, str(workers), f"{paper:.2f} s", ratio, chosen])
    samples = round(seconds * 1000)
    return [
        report.stamp(["ours"], f"{samples} samples, {repeats} repeats in turns after one to warm up"),
        "",
        *report.table(
            ["angle noise", "threads", "paper", "automatic over paper: median (range)", "form, window chosen"], rows
        ),
        "",
        *([f"* Not available: automatic: {refusal}."] if refusal else []),
    ]


def _ratios(recording: tvident.Recording, repeats: int, workers: int) -> tuple[list[float], float, str]:
    """Return the ratios of time, the median time of the paper's method in s, and what was chosen."""
    chosen = _identify(recording, "auto", workers).settings
    _identify(recording, "paper", workers)
    papers, ratios = [], []
    for _ in range(repeats):
        times = {}
        for method in _METHODS:
            start = time.perf_counter()
            _identify(recording, method, workers)
            times[method] = time.perf_counter() - start
        papers.append(times["paper"])
        ratios.append(times["auto"] / times["paper"])
    return ratios, float(np.median(papers)), f"{chosen['form']}, {chosen['window_length']}"


def _identify(recording: tvident.Recording, method: _Method, workers: int) -> tvident.Identification:
    return tvident.identify(
        recording.angle, recording.torque, sample_rate=recording.sample_rate, method=method, workers=workers
    )
