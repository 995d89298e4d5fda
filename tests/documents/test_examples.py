"""Every example runs as a user would run it, and finds what is true."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples"


def run(name: str, folder: Path) -> str:
    """Run an example in an empty folder and give what it prints."""
    binaries = Path(sys.executable).parent
    environment = os.environ | {"PATH": f"{binaries}{os.pathsep}{os.environ['PATH']}", "MPLBACKEND": "agg"}
    program = "/bin/sh" if name.endswith(".sh") else sys.executable
    command = [program, str(FOLDER / name)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert "Warning" not in done.stderr
    return done.stdout


def numbers(text: str, pattern: str) -> list[float]:
    """Give the groups of the only place where a pattern is found."""
    found = re.findall(pattern, text)
    assert len(found) == 1, f"{pattern} in\n{text}"
    return [float(group) for group in (found[0] if isinstance(found[0], tuple) else [found[0]])]


def test_every_example_is_run_here_and_listed() -> None:
    scripts = {path.name for path in FOLDER.iterdir()} - {"README.md"}
    listed = set(re.findall(r"\]\(([a-z_.]+)\)", (FOLDER / "README.md").read_text()))
    run_here = set(re.findall(r'run\("([a-z_.]+)"', Path(__file__).read_text()))
    assert scripts == listed == run_here


def test_derivatives(tmp_path: Path) -> None:
    printed = run("derivatives.py", tmp_path)
    # sigma of a window of 125 samples is known to 1/√250; its median over 1000 samples, some 8 windows, to a third of that.
    assert numbers(printed, r"noise: (\S+) rad") == pytest.approx([0.002], rel=0.1)
    ours, plain = numbers(printed, r"acceleration: (\S+)% \(.*: (\S+)%\)")
    assert ours < 2
    assert plain > 100


@pytest.mark.slow
def test_torsional_rig(tmp_path: Path) -> None:
    printed = run("torsional_rig.py", tmp_path)
    (default,), (paper,), (known,) = (
        numbers(printed, rf"{how}: +stiffness within (\S+)%")
        for how in ("by default", "as in the paper", "inertia known")
    )
    assert default < 0.5
    assert 5 < paper < 10
    assert known < 0.5
    assert (tmp_path / "torsional-rig.csv").stat().st_size > 0


def test_friction(tmp_path: Path) -> None:
    printed = run("friction.py", tmp_path)
    for name in ("inertia", "damping", "coulomb", "offset"):
        value, error, truth = numbers(printed, rf"{name} +(\S+) ± (\S+) +\(truth (\S+)\)")
        # Rows are independent here, as the torque's noise is and the angle's hardly counts; errors are printed to 1e-4.
        assert abs(value - truth) < 4 * error + 1e-4


@pytest.mark.slow
def test_reflex(tmp_path: Path) -> None:
    printed = run("reflex.py", tmp_path)
    for name in ("inertia", "damping", "stiffness", "reflex", "reflex.delay", "reflex.corner"):
        value, error, truth = numbers(printed, rf"{name} +(\S+) ± (\S+) +\(truth (\S+)\)")
        # The delay was 3 ms off, 32 standard errors, while a corner that is wrong made up for it.
        assert abs(value - truth) < 4 * error + 1e-4, name


def test_own_file(tmp_path: Path) -> None:
    printed = run("own_file.py", tmp_path)
    # 19 samples are missing, and so are equations whose test function, at most a sixteenth of the record, holds one of them.
    (bridged,) = numbers(printed, r"(\d+) samples around the gap")
    assert 19 < bridged <= 19 + 10_000 / 16
    assert (tmp_path / "identified.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_from_the_shell(tmp_path: Path) -> None:
    printed = run("from_the_shell.sh", tmp_path)
    assert "uniform: 1000 Hz" in printed
    time, stiffness, error = map(float, printed.splitlines()[-1].split(","))
    assert time == pytest.approx(9.9)
    assert 10 < stiffness < 20
    assert error < 0.1
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {
        "rig.csv",
        "derivatives.csv",
        "result.csv",
        "result.csv.settings.json",
        "result.png",
        "known.npz",
    }
