"""Write the tables of docs/methods-before.md: every method on simulated and real recordings. ``python docs/methods_before.py``.

Real recordings are looked for where ``TVIDENT_DATA`` says. With 20 seeds it takes about ten minutes of processor time, and is run by hand.
"""

import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

import tvident
from tvident import baselines, recordings

Array = npt.NDArray[np.float64]

SECONDS = 8.0
NAMES = ("inertia", "damping", "stiffness")
MEASURES = ("inertia", "damping", "stiffness", "bias", "random", "vaf", "rise_time", "coverage", "seconds")
HEAD = "| method | I % | C % | K % | bias % | random % | VAF % | rise s | coverage | time s |\n|-|-|-|-|-|-|-|-|-|-|"

SILVERBOX = {"inertia": 5.375e-6, "damping": 2.257e-4, "stiffness": 0.9905, "cubic": 3.92, "sample_rate": 610.3515625}
"""As published with the recording."""


def rows_of(compared: baselines.MethodComparison) -> dict[str, list[float]]:
    """Return every measure of one record, by method."""
    table = compared.table
    return {str(method): [float(table[name][row]) for name in MEASURES] for row, method in enumerate(table["method"])}


def table(pattern: str, noise: float, seeds: Sequence[int]) -> dict[str, list[float]]:
    """Return medians over seeds of every measure, by method, and the mean of the coverage: a record is in or out of it as a whole."""
    found: dict[str, list[list[float]]] = {}
    for seed in seeds:
        rig = tvident.simulate_torsional_rig(duration=SECONDS, seed=seed, pattern=pattern, angle_noise=noise)  # type: ignore[arg-type]
        truth = {name: getattr(rig, name) for name in NAMES}
        compared = baselines.compare_methods(rig.angle, rig.torque, sample_rate=1000, truth=truth)
        for method, row in rows_of(compared).items():
            found.setdefault(method, []).append(row)
    medians = {method: np.median(np.array(rows), axis=0) for method, rows in found.items()}
    place = MEASURES.index("coverage")
    for method, rows in found.items():
        medians[method][place] = np.mean(np.array(rows)[:, place])
    return {method: row.tolist() for method, row in medians.items()}


def real(folder: Path) -> Iterator[tuple[str, dict[str, list[float]]]]:
    """Give every real recording that is there, with its measures."""
    silverbox, ankle, emps = (folder / name for name in ("silverbox_arrow.csv", "ankle_stationary.mat", "emps.mat"))
    if silverbox.exists():
        channels = recordings.read(silverbox)
        angle, torque = channels["V2"] - channels["V2"].mean(), channels["V1"] - channels["V1"][:20].mean()
        # A window of 0.2 s sees the hardening spring as one of this stiffness.
        window = np.ones(round(0.2 * SILVERBOX["sample_rate"]))
        secant = np.convolve(angle**4, window, "same") / np.convolve(angle**2, window, "same")
        stiffness = SILVERBOX["stiffness"] + SILVERBOX["cubic"] * secant
        given: dict[str, npt.ArrayLike] = {
            "inertia": SILVERBOX["inertia"],
            "damping": SILVERBOX["damping"],
            "stiffness": stiffness,
        }
        compared = baselines.compare_methods(angle, torque, sample_rate=SILVERBOX["sample_rate"], truth=given)
        yield "silverbox, an electronic oscillator", rows_of(compared)
    if ankle.exists():
        channels = recordings.read(ankle)
        compared = baselines.compare_methods(channels["angle"][:20000], -channels["torque"][:20000], sample_rate=1000)
        yield "ankle, its first 20 s", rows_of(compared)
    if emps.exists():
        channels = recordings.read(emps)
        force = channels["vir"] * float(channels["gtau"])
        yield "positioning system", rows_of(baselines.compare_methods(channels["qm"], force, sample_rate=1000))


def show(title: str, rows: dict[str, list[float]]) -> None:
    """Print a table."""
    print(f"\n### {title}\n\n{HEAD}", flush=True)  # noqa: T201 - what it is for
    for method, row in rows.items():
        cells = ["" if np.isnan(one) else "never" if np.isinf(one) else f"{one:.3g}" for one in row]
        print(f"| {method} | {' | '.join(cells)} |", flush=True)  # noqa: T201


def main(seeds: int) -> None:
    """Print a table for every real recording, then for every pattern and level of noise."""
    for title, rows in real(Path(os.environ.get("TVIDENT_DATA", "recordings"))):
        show(title, rows)
    for pattern in ("slider", "ramp", "square", "constant"):
        for noise in (1e-4, 1e-3, 1e-2):
            show(f"{pattern}, {100 * noise:g} % noise of the angle", table(pattern, noise, range(seeds)))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
