from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tvident
from tvident import recordings

# Published parameters of the electro-mechanical positioning system (Janot, Gautier, Brunot).
EMPS = {"inertia": (95.1089, 0.01), "damping": (203.5034, 0.03), "coulomb": (20.3935, 0.03)}


def recording(folder: Path, name: str) -> Path:
    path = folder / name
    if not path.exists():
        pytest.skip(f"the recording {name} is missing from {folder}")
    return path


@pytest.mark.parametrize("window", [21, 51, 101, 151, 201])
def test_the_positioning_system_from_the_command_line(folder_of_recordings: Path, tmp_path: Path, window: int) -> None:
    command = [
        str(Path(sys.executable).with_name("tvident")),
        "identify",
        str(recording(folder_of_recordings, "emps.mat")),
    ]
    command += [
        "--angle",
        "qm",
        "--torque",
        "vir",
        "--torque-scale",
        "gtau",
        "--sample-rate",
        "1000",
        "--preset",
        "paper",
    ]
    command += [
        "--inertia",
        "constant",
        "--damping",
        "constant",
        "--stiffness",
        "0",
        "--term",
        "coulomb",
        "--term",
        "offset",
    ]
    command += ["--window-length", str(window), "-o", "result.csv", "--plot", "result.png"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    columns = recordings.read(tmp_path / "result.csv")
    for name, (published, tolerance) in EMPS.items():
        printed = re.search(rf"^{name} = (\S+) ±", done.stdout, re.MULTILINE)
        assert printed is not None
        assert float(printed[1]) == pytest.approx(published, rel=tolerance)
        assert recordings.channel(columns, name, "result.csv")[100] == pytest.approx(published, rel=tolerance)


@pytest.mark.parametrize("window", range(17, 33, 2))
def test_the_classic_angle_differentiated_twice(folder_of_recordings: Path, window: int) -> None:
    # A Savitzky-Golay filter tuned on this very truth reaches 4.2.
    channels = recordings.read(recording(folder_of_recordings, "pezzack.txt"))
    assert list(channels) == ["Time", "Raw", "Noisy", "Accel"]
    fit = tvident.fit_local_polynomials(channels["Raw"], window, sample_rate=49.75)
    interior = slice(window // 2, -(window // 2))
    error = (fit.derivatives[2] - channels["Accel"])[interior]
    assert np.sqrt(np.mean(error**2)) < 4.6
