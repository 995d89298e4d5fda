"""Measure the README's first table and draw its first picture: ``make docs``.

One simulated rig whose stiffness is known, recorded with an encoder that is nearly perfect and with noise of 1 % in the angle, and what
one may do to find K(t): 15 lines of SciPy, the paper's settings, a spline whose settings are the best for the true stiffness, which nobody
knows outside a simulation, and tvident without any setting. ``python docs/comparison.py tune`` looks for the spline's settings again.
"""

from __future__ import annotations

import itertools
import sys
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib import pyplot as plt
from scipy.interpolate import BSpline
from scipy.signal import savgol_filter

import tvident
from tvident._figures.style import FOUND, MUTED, TRUTH, draw_line, style

Array = npt.NDArray[np.float64]

NOISE = 0.01
"""Standard deviation of the angle's noise, of that of the angle."""

RATE = 1000.0

TUNED = {0.0: (31, 4, 50), NOISE: (101, 7, 50)}
"""Window and order of the derivatives, and pieces of the spline, that are best for the true stiffness of either recording."""

BY_HAND = ((51, 5, 20), (51, 5, 40), (51, 5, 70), (61, 5, 40), (71, 5, 40), (81, 5, 40))
"""Others that one may come to by hand: the filter of the first row, the spline's pieces tuned; then longer windows against the noise."""

MARKS = ("<!-- comparison: `make docs` -->", "<!-- end -->")
"""Where a table stands in the README, and one in the page beside it."""


def with_scipy(angle: Array, torque: Array, window: int = 51, order: int = 5, rows: int = 200) -> Array:
    """Return K from derivatives of the Savitzky-Golay filter and least squares in sliding windows: what 15 lines do."""
    motion = [savgol_filter(angle, window, order, deriv=d, delta=1 / RATE) for d in (2, 1, 0)]
    columns = np.stack([*motion, torque], axis=1)[window // 2 : -(window // 2)]
    size = columns.std(axis=0)
    columns = columns / size
    windows = np.lib.stride_tricks.sliding_window_view(columns, rows, axis=0)
    normal = windows @ windows.transpose(0, 2, 1)
    solved = np.linalg.solve(normal[:, :3, :3], normal[:, :3, 3:])[:, 2, 0] * size[3] / size[2]
    found = np.full(angle.size, np.nan)
    first = window // 2 + rows // 2
    found[first : first + solved.size] = solved
    return found


def with_spline(angle: Array, torque: Array, window: int, order: int, pieces: int) -> Array:
    """Return K as a cubic spline of the time, beside constant inertia and damping, by least squares of the whole record."""
    acceleration, velocity, smooth = (savgol_filter(angle, window, order, deriv=d, delta=1 / RATE) for d in (2, 1, 0))
    basis = _splines(angle.size, pieces)
    rows = np.column_stack([acceleration, velocity, basis * smooth[:, np.newaxis]])
    inside = slice(window // 2, -(window // 2))
    size = rows.std(axis=0)
    used = rows[inside] / size
    factors = np.linalg.solve(used.T @ used, used.T @ torque[inside]) / size
    return np.asarray(basis @ factors[2:])


@cache
def _splines(samples: int, pieces: int) -> Array:
    knots = np.linspace(0, samples - 1, pieces + 1)
    around = np.r_[[knots[0]] * 3, knots, [knots[-1]] * 3]
    return np.asarray(BSpline.design_matrix(np.arange(samples), around, 3).toarray())


def tuned_on_the_truth(recording: tvident.Recording) -> tuple[int, int, int]:
    """Return the window, order and number of pieces whose spline is nearest to the true stiffness, of 96."""
    candidates = itertools.product((11, 21, 31, 41, 61, 81, 101, 121), (4, 5, 7), (25, 35, 50, 70))
    found = {one: error_of(with_spline(recording.angle, recording.torque, *one), recording) for one in candidates}
    return min(found, key=lambda one: found[one])


def error_of(found: Array, recording: tvident.Recording) -> float:
    """Return the rms error of K where there is a value, in percent of its mean."""
    return float(100 * np.sqrt(np.nanmean((found - recording.stiffness) ** 2)) / recording.stiffness.mean())


def recording_with(noise: float) -> tvident.Recording:
    """Return the rig's default recording, or the same with more noise in the angle."""
    return tvident.simulate_torsional_rig(angle_noise=noise) if noise else tvident.simulate_torsional_rig()


def identified(recording: tvident.Recording, method: Any) -> Array:
    """Return K as tvident finds it."""
    return tvident.identify(recording.angle, recording.torque, sample_rate=RATE, method=method).stiffness


def rows() -> list[tuple[str, float, float, str]]:
    """Return the table: the way, the error of K in percent without noise and with it, and what must be chosen."""
    clean, noisy = (recording_with(noise) for noise in TUNED)
    (own_clean, own_noisy) = TUNED.values()
    ways: list[tuple[str, Any, Any, str]] = [
        (
            "SciPy in 15 lines: `savgol_filter`, then least squares in windows",
            with_scipy,
            with_scipy,
            "window 51, order 5, 200 rows",
        ),
        ('the paper\'s settings, `method="paper"`', "paper", "paper", "nothing"),
        (
            "a spline for *K*, tuned on the true *K* of each recording",
            own_clean,
            own_noisy,
            "window, order, pieces; *I*, *C* constant",
        ),
        ("the same spline, tuned on the true *K* of the other recording", own_noisy, own_clean, "the same"),
        ("**tvident**", "auto", "auto", "nothing"),
    ]

    def error(way: Any, recording: tvident.Recording) -> float:
        if isinstance(way, str):
            return error_of(identified(recording, way), recording)
        if isinstance(way, tuple):
            return error_of(with_spline(recording.angle, recording.torque, *way), recording)
        return error_of(way(recording.angle, recording.torque), recording)

    return [(name, error(first, clean), error(second, noisy), chosen) for name, first, second, chosen in ways]


def table() -> str:
    """Return the table as it stands in the README."""
    lines = ["| How *K*(t) is found | error | with 1 % of noise | what must be chosen |", "|-|-|-|-|"]
    for name, clean, noisy, chosen in rows():
        # Two digits, of which the last may be a zero.
        errors = " | ".join(f"{error:#.2g}".rstrip(".") + " %" for error in (clean, noisy))
        lines.append(f"| {name} | {errors} | {chosen} |")
    return "\n".join(lines)


def table_of_splines() -> str:
    """Return what the spline makes of other settings."""
    clean, noisy = (recording_with(noise) for noise in TUNED)
    lines = ["| window | order | pieces | error | with 1 % of noise |", "|-|-|-|-|-|"]
    for one in (*BY_HAND, *TUNED.values()):
        errors = (error_of(with_spline(each.angle, each.torque, *one), each) for each in (clean, noisy))
        lines.append(
            f"| {' | '.join(map(str, one))} | {' | '.join(f'{error:#.2g}'.rstrip('.') + ' %' for error in errors)} |"
        )
    return "\n".join(lines)


def _written(page: Path, content: str) -> None:
    """Put a table into a page."""
    text = page.read_text(encoding="utf-8")
    begin = text.index(MARKS[0]) + len(MARKS[0])
    end = text.index(MARKS[1], begin)
    page.write_text(f"{text[:begin]}\n\n{content}\n\n{text[end:]}", encoding="utf-8")


def picture(place: Path) -> None:
    """Draw the stiffness that the paper's settings and tvident find in the noisy recording."""
    recording = recording_with(NOISE)
    with style():
        figure, axes = plt.subplots(1, 2, sharey=True, figsize=(9.6, 3.4), layout="constrained")
        for ax, method, title in zip(axes, ("paper", "auto"), ("The paper's method", "tvident"), strict=True):
            found = identified(recording, method)
            draw_line(ax, recording.time, found, color=FOUND, linewidth=1.2, label="identified")
            draw_line(
                ax,
                recording.time,
                recording.stiffness,
                color=TRUTH,
                linewidth=1.1,
                linestyle=(0, (5, 2)),
                label="truth",
            )
            ax.set_title(f"{title}: error {error_of(found, recording):#.2g} %")
            ax.set_xlabel("time (s)")
            ax.set_xlim(0, recording.time[-1])
        axes[0].set_ylabel("stiffness $K$ (N·m/rad)", color=MUTED)
        axes[0].set_ylim(0.6 * recording.stiffness.min(), 1.35 * recording.stiffness.max())
        axes[1].legend(loc="lower right", bbox_to_anchor=(1, 0.97), borderaxespad=0.2, ncols=2)
        figure.savefig(place)


def main() -> None:
    """Write the picture and the tables."""
    if sys.argv[1:] == ["tune"]:
        for noise in TUNED:
            sys.stdout.write(f"{noise:.0%}: {tuned_on_the_truth(recording_with(noise))}\n")
        return
    readme, page, place = map(Path, sys.argv[1:])
    mpl.use("agg")
    _written(readme, table())
    _written(page, table_of_splines())
    picture(place)


if __name__ == "__main__":
    main()
