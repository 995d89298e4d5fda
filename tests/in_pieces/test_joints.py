"""``tvident identify --joint NAME --in-pieces``: joints of logs as in memory, whatever their channels are called."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pytest
from click.testing import CliRunner
from pyarrow import parquet

import tvident
from tvident._command_line import main

RIG = tvident.simulate_torsional_rig(duration=5.0, sample_rate=500.0)


def _csv(folder: Path) -> str:
    columns = {"t_us": RIG.time * 1e6, "/arm/wrist/position": RIG.torque, "/arm/wrist/effort": RIG.angle}
    columns |= {"/arm/elbow/position": RIG.angle, "/arm/elbow/effort": RIG.torque}
    header = ",".join(columns)
    np.savetxt(folder / "run.csv", np.stack(list(columns.values()), 1), delimiter=",", header=header, comments="")
    return str(folder / "run.csv")


def _hdf5(folder: Path) -> str:
    with h5py.File(folder / "run.h5", "w") as file:
        file.attrs["sample_rate"] = 500.0
        file["state/elbow/q"], file["state/elbow/tau"], file["state/elbow/dq"] = RIG.angle, RIG.torque, RIG.angle
    return str(folder / "run.h5")


def _parquet(folder: Path) -> str:
    columns = {"log_time": RIG.time, "q_elbow": RIG.angle, "tau_elbow": RIG.torque, "tau_wrist": RIG.angle}
    parquet.write_table(pa.table(columns), folder / "run.parquet")
    return str(folder / "run.parquet")


@pytest.mark.parametrize("made", [_csv, _hdf5, _parquet])
def test_a_joint_is_all_that_is_named(tmp_path: Path, made: Callable[[Path], str]) -> None:
    """'elbow.position' was asked for."""
    file, out = made(tmp_path), str(tmp_path / "out.npy")
    done = CliRunner().invoke(
        main, ["identify", file, "--joint", "elbow", "--in-pieces", "--method", "paper", "-o", out]
    )
    assert done.exit_code == 0, done.output
    expected: Any = tvident.identify(RIG.angle, RIG.torque, sample_rate=500.0, method="paper")
    np.testing.assert_allclose(np.load(out)["stiffness"], expected.stiffness, rtol=1e-6)
    assert ("state.elbow.dq is not used: --in-pieces takes angle and torque" in done.stderr) is file.endswith(".h5")


def test_a_joint_that_is_not_there_lists_those_that_are(tmp_path: Path) -> None:
    file = _csv(tmp_path)
    call = ["identify", file, "--joint", "knee", "--in-pieces", "-o", str(tmp_path / "out.npy")]
    done = CliRunner().invoke(main, call)
    assert done.exit_code == 2
    assert "has no joint 'knee'; it has arm.wrist, arm.elbow; name one of these" in done.output
