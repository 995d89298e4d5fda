"""Without an extra the rest is there, and what is missing says what to install."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import tvident

TVIDENT = str(Path(sys.executable).with_name("tvident"))
IDENTIFY = ("identify", "rig.csv", "--angle", "angle", "--torque", "torque", "--sample-rate", "1000")


@pytest.mark.slow
def test_without_matplotlib_all_but_pictures_is_there(tmp_path: Path) -> None:
    tvident.simulate_torsional_rig(5.0, seed=3).save(tmp_path / "rig.csv")
    # A module of that name that cannot be imported stands for one that is not installed.
    (tmp_path / "absent").mkdir()
    (tmp_path / "absent" / "matplotlib.py").write_text("raise ImportError")
    paths = [str(tmp_path / "absent"), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}

    def run_without(*arguments: object) -> subprocess.CompletedProcess[str]:
        command = [TVIDENT, *map(str, arguments)]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

    done = run_without(*IDENTIFY, "-o", "result.csv")
    assert done.returncode == 0, done.stderr
    refused = run_without(*IDENTIFY, "-o", "other.csv", "--plot", "picture.png")
    assert refused.returncode == 2
    assert "pip install 'tvident[plot]'" in refused.stderr
    assert not (tmp_path / "other.csv").exists()
    demo = run_without("demo")
    assert demo.returncode == 2
    assert "stiffness  N m/rad" in demo.stdout
    assert "pip install 'tvident[plot]'" in demo.stderr
    assert {path.name for path in (tmp_path / "tvident-demo").iterdir()} == {
        "recording.csv",
        "result.csv",
        ".tvident-demo.json",
    }


@pytest.mark.slow
def test_without_what_the_command_is_made_with_the_library_is_there(tmp_path: Path) -> None:
    for name in ("click", "tqdm"):
        (tmp_path / f"{name}.py").write_text("raise ImportError")
    paths = [str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}

    def run_without(*command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

    refused = run_without(TVIDENT, "info", "x.csv")
    assert refused.returncode == 1
    assert refused.stderr.splitlines() == [
        "Error: the command tvident needs click, which is not installed; install it with: pip install 'tvident[cli]'"
    ]
    # Where the program is not on the path, it is asked for as a module.
    as_module = run_without(sys.executable, "-m", "tvident", "demo")
    assert (as_module.returncode, as_module.stderr) == (1, refused.stderr)
    program = "import tvident; fit = tvident.fit_local_polynomials([1.0] * 99, 21, progress={}); print(fit.order.size)"
    assert run_without(sys.executable, "-c", program.format("None")).stdout == "99\n"
    refused = run_without(sys.executable, "-c", program.format("True"))
    assert refused.stderr.splitlines()[-1] == (
        "ImportError: progress=True needs tqdm, which is not installed; install it with: pip install 'tvident[cli]', "
        "or pass a function of (done, total)"
    )
