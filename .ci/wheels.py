"""Build what is published, from the source distribution alone, and check it: ``make wheels``."""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import venv
import zipfile
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).parents[1]
LINUX = ("x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu")
GLIBC = "manylinux_2_17"
"""Linux of 2014 and later: zig links against that glibc, whatever the machine has."""

FREE_THREADED = ("python3.14t", "python3.13t")
TESTED_WITH = ("pytest", "hypothesis", "scipy", "click", "tqdm")
"""What the chosen tests need beside the wheel and NumPy, in the versions of requirements-development.txt."""

TESTS = (
    "tests/house/test_what_loads.py",
    "tests/derivatives/test_savitzky_golay.py",
    "tests/identify/test_small_cases.py",
    "tests/simulate",
)
"""A part of the tests that takes little beside NumPy and touches every room of the core."""

SIDE_BY_SIDE = (
    "--numprocesses=2",
    "--dist=worksteal",
    "--ignore=tests/house/test_parallel.py",
    "--ignore=tests/house/test_times.py",
)
"""Tests are run as `make test-python` runs them, without the slow ones, but for those that promise a time, which need a machine alone."""

MADE = ("__pycache__", ".git", ".venv*", ".*_cache", ".hypothesis", ".benchmarks", "target", "dist", "*.so")
"""What stands beside the sources but is made from them."""

MOST_BYTES = 20_000_000
"""Of a wheel: its library is stripped."""


def run(*command: str | Path, folder: Path = ROOT, **variables: str) -> str:
    """Run a program, which must succeed; return what it prints."""
    print("$", *command, flush=True)
    done = subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        env=os.environ | variables,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode:
        sys.exit(f"{done.stdout}\n{command[0]} failed with {done.returncode}")
    return done.stdout


def program(name: str) -> Path:
    """Return a program that is installed beside this interpreter."""
    return Path(sys.executable).with_name(name + (".exe" if os.name == "nt" else ""))


def source(out: Path, folder: Path) -> Path:
    """Make the source distribution, and unpack it where nothing else of the project is."""
    run(program("maturin"), "sdist", "--out", out)
    (archive,) = out.glob("tvident-*.tar.gz")
    with tarfile.open(archive) as packed:
        packed.extractall(folder, filter="data")
    (unpacked,) = folder.iterdir()
    return unpacked


def has_target(target: str) -> bool:
    """Return whether the compiler makes programs for a system, after asking for what it needs for that."""
    known = run("rustc", "--print", "target-libdir", "--target", target).strip()
    if Path(known).is_dir():
        return True
    # Without rustup the compiler came with the system, whose packages hold other targets.
    rustup = shutil.which("rustup")
    return rustup is not None and subprocess.run([rustup, "target", "add", target], check=False).returncode == 0


def build(unpacked: Path, out: Path, target: str | None, interpreter: str | None = None) -> Path:
    """Build one wheel from the unpacked source distribution."""
    before = set(out.glob("*.whl"))
    options: list[str | Path] = ["--release", "--locked", "--out", out]
    if target is not None:
        options += ["--target", target, "--zig", "--compatibility", GLIBC]
    if interpreter is not None:
        options += ["--interpreter", interpreter]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    run(
        program("maturin"),
        "build",
        *options,
        folder=unpacked,
        CARGO_TARGET_DIR=str(ROOT / "target" / "wheels"),
        PATH=path,
    )
    (made,) = set(out.glob("*.whl")) - before
    return made


def check(wheel: Path) -> None:
    """Check what a wheel holds, which systems and which Pythons take it."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (metadata,) = (name for name in names if name.endswith(".dist-info/METADATA"))
        text = archive.read(metadata).decode()
        bills = [json.loads(archive.read(name)) for name in names if re.search(r"\.dist-info/sboms/.*\.json$", name)]
    libraries = [name for name in names if name.endswith((".so", ".pyd", ".dylib", ".dll"))]
    components = {one["name"] for bill in bills for one in bill["components"]}
    problems = {
        "has one library": len(libraries) == 1,
        "says that it has types": {"tvident/py.typed", "tvident/_core.pyi", "tvident/_core_stubs/identification.pyi"}
        <= set(names),
        "holds the licences": sum("/licenses/" in name for name in names) >= 3,  # noqa: PLR2004 - both, and which is which
        "holds the page of reports": {"tvident/_report/page.html", "tvident/_report/page.js"} <= set(names),
        "holds no tests": not [name for name in names if name.startswith(("tests", "benches", "docs"))],
        "lists the Rust crates that it is made of": {"faer", "pyo3", "rayon"} <= components,
        f"is at most {MOST_BYTES} bytes": wheel.stat().st_size <= MOST_BYTES,
        "needs NumPy alone": re.findall(r"^Requires-Dist: ([\w-]+)(?!.*extra ==)[^;]*$", text, re.MULTILINE)
        == ["numpy"],
    }
    wrong = [words for words, holds in problems.items() if not holds]
    if wrong:
        sys.exit(f"{wheel.name}: a wheel {', and '.join(wrong)}; this one does not")
    if "-abi3-" in wheel.name:
        run(program("abi3audit"), "--strict", "--report", wheel)
    if "linux" in wheel.name:
        said = run(program("auditwheel"), "show", wheel)
        tag = re.search(r'following platform tag:\s+"manylinux_2_(\d+)_', said)
        if tag is None or int(tag[1]) > int(GLIBC.rpartition("_")[2]):
            sys.exit(f"{wheel.name} must run on {GLIBC}:\n{said}")
    print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB, {len(components)} components listed")


def _locked(names: Sequence[str]) -> list[str]:
    """Return requirements with the versions that the tests are run with elsewhere."""
    lines = (ROOT / "requirements-development.txt").read_text(encoding="utf-8").splitlines()
    return [line for line in lines if line.partition("==")[0] in names]


def try_out(wheel: Path, tests: Sequence[str], interpreter: str = sys.executable) -> None:
    """Install a wheel in an environment of its own, and run tests there from a folder without the package."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "environment"
        if interpreter == sys.executable:
            venv.create(place, with_pip=True)
        else:
            run(interpreter, "-m", "venv", place)
        python = place / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel)
        print(run(python, "-c", "import tvident; print(tvident.__version__, sorted(tvident.__all__))"))
        is_part = tests == TESTS
        needed = _locked(TESTED_WITH) if is_part else ["--requirement", "requirements-development.txt"]
        run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *needed)
        copied = Path(folder) / "project"
        # Some tests read the sources. The package that they import is the wheel's: that of the sources is not on the path.
        shutil.copytree(ROOT, copied, ignore=shutil.ignore_patterns(*MADE))
        options = ["--quiet", "-p", "no:cacheprovider", *(() if is_part else SIDE_BY_SIDE)]
        print(run(python, "-m", "pytest", *options, *tests, folder=copied).splitlines()[-1])


def _check_and_try(wheels: Sequence[Path], tests: Sequence[str], threads: str | None) -> None:
    """Check wheels, and run tests with those that this machine takes."""
    for wheel in wheels:
        check(wheel)
    machine = platform.machine().lower()
    for wheel in wheels:
        if "linux" in wheel.name and not wheel.stem.endswith(machine):
            print(f"{wheel.name}: checked, not run: this machine is {machine}")
        elif "-abi3-" not in wheel.name and threads is None:
            print(f"{wheel.name}: checked, not run: no free-threaded Python here")
        else:
            try_out(wheel, tests, sys.executable if "-abi3-" in wheel.name else str(threads))


def main() -> None:
    """Build and check everything that this machine can, or what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="folder for what is published")
    parser.add_argument(
        "--targets", nargs="*", help="Rust's names of systems; by default both of Linux, or this machine"
    )
    parser.add_argument(
        "--tests",
        nargs="*",
        default=TESTS,
        help="tests that the wheel of this machine must pass; `tests` is all of them",
    )
    parser.add_argument("--here", action="store_true", help="only a wheel for this machine")
    parser.add_argument(
        "--built", action="store_true", help="check and try the wheels that are in the folder, build none"
    )
    given = parser.parse_args()
    if given.built:
        wheels = sorted(given.out.glob("*.whl"))
        if not wheels:
            sys.exit(f"{given.out} holds no wheels; build them first")
        _check_and_try(wheels, given.tests, next((one for one in FREE_THREADED if shutil.which(one)), None))
        return
    is_linux = platform.system() == "Linux"
    every = [one for one in LINUX if not given.here or one.startswith(platform.machine())]
    targets = given.targets or (every if is_linux else [None])
    if is_linux and find_spec("ziglang") is None:
        sys.exit("wheels for Linux need zig: pip install 'maturin[zig]'")
    shutil.rmtree(given.out, ignore_errors=True)
    given.out.mkdir(parents=True)
    with tempfile.TemporaryDirectory() as folder:
        unpacked = source(given.out.resolve(), Path(folder))
        absent = [target for target in targets if target and not has_target(target)]
        if absent and given.targets:
            sys.exit(
                f"Rust's standard library for {', '.join(absent)} is missing: rustup target add {' '.join(absent)}"
            )
        wheels = [build(unpacked, given.out.resolve(), target) for target in targets if target not in absent]
        threads = next((one for one in FREE_THREADED if shutil.which(one)), None)
        if threads is not None:
            target = next((one for one in targets if one and one.startswith(platform.machine())), None)
            wheels.append(build(unpacked, given.out.resolve(), target, threads))
    _check_and_try(wheels, given.tests, threads)
    for target in absent:
        print(
            f"No wheel for {target}: rustup could not fetch Rust's standard library for it, which needs a network: "
            f"rustup target add {target}, then make wheels again"
        )
    if threads is None:
        print(f"No free-threaded Python here ({' or '.join(FREE_THREADED)}): no wheel for it")


if __name__ == "__main__":
    main()
