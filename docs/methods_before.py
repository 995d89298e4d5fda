"""Write the tables of docs/methods-before.md: every method on simulated recordings. ``python docs/methods_before.py``."""

import sys
from collections.abc import Sequence

import numpy as np

import tvident
from tvident import baselines

SECONDS = 8.0
NAMES = ("inertia", "damping", "stiffness")
MEASURES = ("inertia", "damping", "stiffness", "bias", "random", "vaf", "rise_time", "coverage", "seconds")


def table(pattern: str, noise: float, seeds: Sequence[int]) -> dict[str, list[float]]:
    """Return medians over seeds of every measure, by method."""
    found: dict[str, list[list[float]]] = {}
    for seed in seeds:
        rig = tvident.simulate_torsional_rig(duration=SECONDS, seed=seed, pattern=pattern, angle_noise=noise)  # type: ignore[arg-type]
        truth = {name: getattr(rig, name) for name in NAMES}
        compared = baselines.compare_methods(rig.angle, rig.torque, sample_rate=1000, truth=truth).table
        for row, method in enumerate(compared["method"]):
            found.setdefault(str(method), []).append([float(compared[name][row]) for name in MEASURES])
    return {method: np.median(np.array(rows), axis=0).tolist() for method, rows in found.items()}


def main(seeds: int) -> None:
    """Print a table for every pattern and level of noise."""
    for pattern in ("slider", "ramp", "square", "constant"):
        for noise in (1e-4, 1e-3, 1e-2):
            print(f"\n### {pattern}, {100 * noise:g} % noise of the angle\n")  # noqa: T201 - what it is for
            print("| method | I % | C % | K % | bias % | random % | VAF % | rise s | coverage | time s |")  # noqa: T201
            print("|-|-|-|-|-|-|-|-|-|-|")  # noqa: T201
            for method, row in table(pattern, noise, range(seeds)).items():
                cells = ["" if np.isnan(one) else "never" if np.isinf(one) else f"{one:.3g}" for one in row]
                print(f"| {method} | {' | '.join(cells)} |")  # noqa: T201


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
