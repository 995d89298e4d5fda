"""``tvident identify --in-pieces`` keeps what is there, and says what the command says in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tvident
from commands import run

IDENTIFY = ("identify", "--angle", "angle", "--torque", "torque", "--in-pieces", "--no-progress", "--method", "paper")


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rig = tvident.simulate_torsional_rig(duration=2.0)
    recording = np.empty(rig.time.size, [("time", float), ("angle", float), ("torque", float)])
    recording["time"], recording["angle"], recording["torque"] = rig.time, rig.angle, rig.torque
    np.save("rig.npy", recording)


def zarr_recording() -> None:
    zarr = pytest.importorskip("zarr")
    recording = np.load("rig.npy")
    group = zarr.open_group("rig.zarr", mode="w")
    for name in recording.dtype.names:
        group.create_array(name, data=np.ascontiguousarray(recording[name]))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("-o", "out.npy", "--settings-output", "out.npy"), "the settings of this run and results must be two files"),
        (("-o", "old.npz", "--settings", "old.npz"), "results must not replace earlier settings"),
        (("-o", "out.npy", "--settings", "old.npz", "--settings-output", "old.npz"), "must not replace earlier"),
        (("-o", "rig.npy"), "results must not replace the recording"),
    ],
)
def test_no_output_replaces_another_file_of_the_call(options: tuple[str, ...], message: str) -> None:
    """Settings were written over the results of an hour."""
    Path("old.npz").write_bytes(b"settings")
    before = Path("rig.npy").read_bytes()
    done = run(*IDENTIFY, "rig.npy", *options)
    assert done.returncode == 2
    assert message in done.stderr
    assert Path("rig.npy").read_bytes() == before
    assert Path("old.npz").read_bytes() == b"settings"
    assert not Path("out.npy").exists()


def test_a_recording_in_a_folder_is_not_replaced_either() -> None:
    """The arrays of Zarr were gone: a folder counted as something that nothing could replace."""
    zarr_recording()
    call = {"angle": "angle", "torque": "torque", "method": "paper"}
    with pytest.raises(ValueError, match=r"the output must not replace the recording; got 'rig\.zarr' for both"):
        tvident.identify_file("rig.zarr", "rig.zarr", **call)  # type: ignore[arg-type] # of the mapping
    Path("all.zarr").mkdir()
    Path("all.zarr/zarr.json").touch()
    Path("rig.zarr").rename("all.zarr/rig.zarr")
    with pytest.raises(ValueError, match=r"the output must not replace the recording; got 'all\.zarr' for both"):
        tvident.identify_file("all.zarr/rig.zarr", "all.zarr", **call)  # type: ignore[arg-type] # of the mapping
    assert Path("all.zarr/rig.zarr/angle").is_dir()


def test_results_do_not_lie_in_the_recording() -> None:
    """A folder was left there."""
    zarr_recording()
    before = sorted(Path("rig.zarr").rglob("*"))
    done = run(*IDENTIFY, "rig.zarr", "-o", "rig.zarr/sub.zarr")
    assert done.returncode == 2
    words = "must not lie in the folder of the recording; got 'rig.zarr/sub.zarr' in 'rig.zarr'; give another place"
    assert words in done.stderr
    assert sorted(Path("rig.zarr").rglob("*")) == before


def test_results_in_a_folder_are_replaced_by_those_of_another_run() -> None:
    pytest.importorskip("zarr")
    for output in ("out.zarr", "out.zarr", "out.zarr/"):  # with a slash as shells complete it
        assert run(*IDENTIFY, "rig.npy", "-o", output).returncode == 0
    Path("mine.zarr").mkdir()
    done = run(*IDENTIFY, "rig.npy", "-o", "mine.zarr")
    assert done.returncode == 1
    assert "only a Zarr group is replaced; mine.zarr is something else; give another name" in done.stderr


def test_units_that_nobody_said_are_named_as_in_memory() -> None:
    done = run(*IDENTIFY, "rig.npy", "-o", "out.npy")
    assert (
        "Units: none said of angle and torque, taken as rad and N m; if they are others, give --angle-unit"
        in done.stderr
    )
    assert (
        "Units" not in run(*IDENTIFY, "rig.npy", "-o", "out.npy", "--angle-unit", "rad", "--torque-unit", "mN m").stderr
    )


def test_no_usable_result_is_an_exit_status() -> None:
    recording = np.load("rig.npy")
    recording["angle"] = np.nan
    np.save("nothing.npy", recording)
    done = run(*IDENTIFY, "nothing.npy", "-o", "out.npy")
    assert done.returncode == 1
    constants = run(*IDENTIFY, "nothing.npy", "-o", "out.npy", "--method", "auto")
    assert constants.returncode == 1
    assert "inertia = none kg m^2" in constants.stdout
    assert "nan" not in constants.stdout


def test_a_pipe_is_not_read_in_pieces() -> None:
    done = run(*IDENTIFY, "-", "-o", "out.npy")
    assert "--in-pieces goes from a FILE to a file; got a pipe; name the file, and give -o" in " ".join(
        done.stderr.split()
    )
