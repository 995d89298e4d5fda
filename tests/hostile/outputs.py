"""Outputs that name inputs or each other, full disks and signals: nothing that was there is lost, and nothing is left behind."""

from __future__ import annotations

import hashlib
import os
import resource
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

import tvident

TVIDENT = str(Path(sys.executable).with_name("tvident"))
COMMAND = (
    "identify",
    "rig.csv",
    "--angle",
    "angle",
    "--torque",
    "torque",
    "--time",
    "time",
    "--mask",
    "mask.csv",
    "--no-progress",
)
INPUTS = ("rig.csv", "mask.csv")
ENDINGS = {"-o": (".csv", ".npz"), "--settings-output": (".json", ".csv"), "--plot": (".png",)}


def case(seed: int) -> None:
    generator = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _fill(folder)
        before = {one: _content(folder / one) for one in INPUTS}
        names = _places(generator, folder)
        options = [part for option, place in names.items() for part in (option, place)]
        modes = {
            place: stat.S_IMODE((folder / place).stat().st_mode) for place in names.values() if _is_file(folder / place)
        }
        links = [one.name for one in folder.iterdir() if one.is_symlink()]
        kind = ("plain", "full", "ended")[int(generator.integers(3))]
        status = _run(folder, [*COMMAND, *options], kind, generator)
        context = f"{options} {kind}: {status}"
        assert {one: _content(folder / one) for one in INPUTS} == before, context
        assert not [one.name for one in folder.iterdir() if one.name.startswith(".")], context
        assert all((folder / one).is_symlink() for one in links), context
        for place, mode in modes.items():
            assert stat.S_IMODE((folder / place).stat().st_mode) == mode, context
            if status and kind != "ended":
                # One output may be whole where another failed.
                kept = _content(folder / place) in {hashlib.sha256(b"old").hexdigest(), *before.values()}
                assert kept or len(names) > 1, context


def _fill(folder: Path) -> None:
    tvident.simulate_torsional_rig(1.0).save(folder / "rig.csv")
    np.savetxt(folder / "mask.csv", np.ones(1000), header="m", comments="")


def _places(generator: np.random.Generator, folder: Path) -> dict[str, str]:
    """Return a name for each of some outputs: an input, a link, an old file or a new one."""
    chosen = [option for option in ENDINGS if generator.random() < (0.8 if option == "-o" else 0.3)] or ["-o"]
    places = {}
    for option in chosen:
        ending = str(generator.choice(ENDINGS[option]))
        name = f"{'ab'[int(generator.integers(2))]}{ending}"
        place = folder / name
        kind = int(generator.integers(6))
        if not os.path.lexists(place):
            if kind == 0:
                place.symlink_to(str(generator.choice(INPUTS)))
            elif kind == 1:
                place.hardlink_to(folder / str(generator.choice(INPUTS)))
            elif kind == 2:
                place.write_bytes(b"old")
                place.chmod(int(generator.choice([0o600, 0o640, 0o666])))
            elif kind == 3:
                (folder / "target").mkdir(exist_ok=True)
                place.symlink_to(f"target/{name}")
            elif kind == 4 and ending == ".csv":
                name = str(generator.choice(["rig.csv", "./mask.csv", "target/../rig.csv"]))
        places[option] = name
    return places


def _run(folder: Path, arguments: list[str], kind: str, generator: np.random.Generator) -> int:
    prepare: Callable[[], object] | None = None
    if kind == "full":
        size = int(generator.integers(1, 50_000))
        prepare = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (size, size))
    process = subprocess.Popen(
        [TVIDENT, *arguments],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=prepare,  # noqa: PLW1509 - no threads here
    )
    with process:
        if kind == "ended":
            time.sleep(float(generator.uniform(0.2, 1.5)))
            process.send_signal(generator.choice([signal.SIGTERM, signal.SIGINT, signal.SIGHUP]))
        _, said = process.communicate(timeout=50)
    assert "Traceback" not in said or kind == "ended", (
        said
    )  # Python itself may still be starting when it is told to end
    return process.returncode


def _is_file(place: Path) -> bool:
    return place.is_file() and not place.is_symlink()


def _content(place: Path) -> str:
    return hashlib.sha256(place.read_bytes()).hexdigest()
