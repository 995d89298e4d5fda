from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from click.testing import CliRunner

import tvident
from parameters import long
from tvident import Status
from tvident._command_line import main
from tvident._files import copy_text
from tvident._in_pieces import copied as copied_module

pytestmark = pytest.mark.usefixtures("small_pieces")

SAMPLES = 70_001
"""Four pieces of the tests, the last of another length."""
MOST_DIFFERENCE = 1.0
"""Of a standard error. Neighbours count twice in the short pieces of these tests, and windows are chosen from parts. An estimate with
twice the variance of a better one differs from it by one of its errors: the variance of a difference is that of the variances."""


def columns_of(path: Path | str) -> dict[str, npt.NDArray[Any]]:
    """Read a result as others would."""
    match Path(path).suffix:
        case ".npy":
            rows = np.load(path, mmap_mode="r")
            return {name: rows[name] for name in rows.dtype.names}
        case ".parquet":
            from pyarrow import parquet  # noqa: PLC0415 - as users do

            table = parquet.read_table(path)
            return {name: table.column(name).to_numpy() for name in table.column_names}
        case ".zarr":
            import zarr  # noqa: PLC0415 - as users do

            return {name: np.asarray(one) for name, one in zarr.open_group(str(path), mode="r").arrays()}
        case _:
            channels = tvident.read_recording(path)
            return {name: np.asarray(channels[name]) for name in channels}


def write(path: str, angle: npt.NDArray[Any], torque: npt.NDArray[Any]) -> str:
    """Write a recording as others would, with names where the file has any."""
    match Path(path).suffix:
        case ".npy":
            np.save(path, np.rec.fromarrays([angle, torque], dtype=[("angle", angle.dtype), ("torque", torque.dtype)]))
        case ".parquet":
            import pyarrow as pa  # noqa: PLC0415 - as users do
            from pyarrow import parquet  # noqa: PLC0415 - likewise

            parquet.write_table(pa.table({"angle": angle, "torque": torque}), path, row_group_size=17_000)
        case ".h5":
            import h5py  # noqa: PLC0415 - as users do

            with h5py.File(path, "w") as file:
                file["angle"], file["torque"] = angle, torque
        case ".zarr":
            import zarr  # noqa: PLC0415 - as users do

            group = zarr.open_group(path, mode="w")
            for name, values in (("angle", angle), ("torque", torque)):
                group.create_array(name, shape=values.shape, dtype=values.dtype, chunks=(9_000,))[:] = values
        case _:
            head = "angle,torque"
            np.savetxt(path, np.stack([angle, torque], axis=1), delimiter=",", header=head, comments="", fmt="%.17g")
    return path


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("ending", "step"), [("npy", 1), ("npy", 7), ("parquet", 3), ("h5", 1), ("zarr", 1), ("csv", 100)]
)
def test_windows_have_the_bits_of_one_call_in_memory(rig: tvident.Recording, ending: str, step: int) -> None:
    source, target = write(f"in.{ending}", rig.angle, rig.torque), f"out.{ending}"
    found = tvident.identify_file(
        source, target, angle="angle", torque="torque", sample_rate=1000, method="paper", step=step
    )
    whole = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper", step=step)
    written, expected = columns_of(target), whole.columns()
    assert found.rows == whole.time.size
    for name, values in written.items():
        assert np.array_equal(values, expected[name], equal_nan=True), name
    assert {"time", "inertia", "stiffness_stderr", "status"} <= set(written)
    assert found.settings == whole.settings
    assert sorted(path.name for path in Path.cwd().iterdir()) == sorted([source, target])


def test_terms_lags_and_windows_of_other_lengths_have_them_too(rig: tvident.Recording) -> None:
    source = write("in.npy", np.round(rig.angle / 1e-4) * 1e-4, rig.torque)
    angle = np.load(source)["angle"]
    options: dict[str, Any] = {
        "method": tvident.StrongForm(window_length=151, regression_window=333, selection="pooled"),
        **dict.fromkeys(("inertia", "stiffness"), "windowed"),
        "damping": 0.01,
        "terms": [("offset", "windowed")],
        "sample_rate": 1000,
    }
    tvident.identify_file(source, "out.npy", angle="angle", torque="torque", **options)
    whole = tvident.identify(angle, rig.torque, **options).columns()
    for name, values in columns_of("out.npy").items():
        assert np.array_equal(values, whole[name], equal_nan=True), name


def test_windows_beside_missing_samples_have_the_bits_of_one_call_in_memory(rig: tvident.Recording) -> None:
    angle, torque = np.array(rig.angle), np.array(rig.torque)
    torque[30_000:30_050] = angle[7::997] = np.nan
    source = write("in.npy", angle, torque)
    more: dict[str, Any] = {"sample_rate": 1000, "method": "paper"}
    found = tvident.identify_file(source, "out.npy", angle="angle", torque="torque", **more)
    written, whole = columns_of("out.npy"), tvident.identify(angle, torque, **more)
    for name, values in written.items():
        assert np.array_equal(values, whole.columns()[name], equal_nan=True), name
    assert found.settings["stderr_factors"] == whole.settings["stderr_factors"]
    assert (written["status"][30_000:30_050] & Status.GAP != 0).all()


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("choose", [True, False])
def test_the_weak_form_finds_what_one_call_in_memory_finds(rig: tvident.Recording, choose: bool) -> None:
    source = write("in.npy", rig.angle, rig.torque)
    whole = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    settings = None if choose else whole.settings
    found = tvident.identify_file(
        source, "out.npy", angle="angle", torque="torque", sample_rate=1000, settings=settings
    )
    written = columns_of("out.npy")
    for name, (value, error) in whole.constants.items():
        assert abs(found.constants[name][0] - value) < 3 * MOST_DIFFERENCE * error, name
    difference = (written["stiffness"] - whole.stiffness) / whole.stderr["stiffness"]
    assert np.sqrt(np.nanmean(difference**2)) < MOST_DIFFERENCE
    ratio = written["stiffness_stderr"] / whole.stderr["stiffness"]
    assert 0.8 < np.nanmedian(ratio) < 1.25
    assert np.ptp(written["inertia"]) == 0
    assert written["inertia"][0] == found.constants["inertia"][0]
    assert found.record_status == whole.record_status


@pytest.mark.slow
def test_weights_are_a_channel_of_the_file(rig: tvident.Recording) -> None:
    # Noise is ten times as large from 20 s on, and from 50 s on, in all of the last piece, nothing counts.
    weights = np.repeat([1.0, 0.01, 0.0], [20_000, 30_000, SAMPLES - 50_000])
    more = np.where(weights < 1, 10.0, 1.0)
    angle = np.asarray(rig.true_angle + more * (rig.angle - rig.true_angle))
    torque = np.asarray(rig.true_torque + more * (rig.torque - rig.true_torque))
    kind = [(name, float) for name in ("angle", "torque", "weights")]
    np.save("in.npy", np.rec.fromarrays([angle, torque, weights], dtype=kind))
    whole = tvident.identify(angle, torque, sample_rate=1000, weights=weights)
    (Path("s.json")).write_text(json.dumps(whole.settings), "utf-8")
    options = ["--angle", "angle", "--torque", "torque", "--sample-rate", "1000", "--settings", "s.json", "--in-pieces"]
    done = CliRunner().invoke(main, ["identify", "in.npy", *options, "--weights", "weights", "-o", "out.npy"])
    assert done.exit_code == 0, done.output
    found = columns_of("out.npy")
    for name, (value, error) in whole.constants.items():
        assert abs(found[name][0] - value) < 3 * MOST_DIFFERENCE * error, name
        # Three pieces of which each tells its noise by itself, and counts some of its neighbours.
        assert 0.7 < found[f"{name}_stderr"][0] / error < 1.4, name
    there = weights > 0
    difference = ((found["stiffness"] - whole.stiffness) / whole.stderr["stiffness"])[there]
    assert np.sqrt(np.nanmean(difference**2)) < MOST_DIFFERENCE
    assert (found["status"][53_000:] & Status.INVALID != 0).all()
    # In strong form windows of pieces are those of the whole record to rounding.
    paper: dict[str, Any] = {"sample_rate": 1000, "method": "paper", "step": 50}
    tvident.identify_file("in.npy", "paper.npy", angle="angle", torque="torque", weights="weights", **paper)
    of_pieces, of_whole = columns_of("paper.npy"), tvident.identify(angle, torque, weights=weights, **paper)
    away = (of_pieces["stiffness"] - of_whole.stiffness) / of_whole.stderr["stiffness"]
    assert np.nanmax(np.abs(away)) < 1e-6


def test_a_constant_that_drifts_from_piece_to_piece_is_contradicted(rig: tvident.Recording) -> None:
    torque = np.array(rig.torque)
    acceleration = tvident.fit_local_polynomials(rig.angle, 101, sample_rate=1000).derivatives[2]
    torque += np.repeat([0.0, 0.002], [40_000, SAMPLES - 40_000]) * acceleration
    source = write("in.npy", rig.angle, torque)
    earlier = tvident.identify(rig.angle[:8000], rig.torque[:8000], sample_rate=1000)
    found = tvident.identify_file(
        source,
        "out.npy",
        angle="angle",
        torque="torque",
        sample_rate=1000,
        method=tvident.WeakForm(window_length=41, exponent=9),
        inertia="constant",
        damping="constant",
        settings=earlier.settings,
    )
    # What is given goes before what an earlier result chose.
    assert (earlier.settings["window_length"], found.settings["window_length"]) == (33, 41)
    assert found.record_status & Status.KIND_CONTRADICTED
    assert any("inertia" in line for line in found.advice)
    inertia = columns_of("out.npy")["inertia"]
    assert inertia[-1] - inertia[0] == pytest.approx(0.002, rel=0.2)


class StopError(Exception):
    """What a caller raises to interrupt the work."""


@pytest.mark.parametrize("method", ["paper", *long("auto")])
def test_interrupted_work_leaves_no_result_and_goes_on(rig: tvident.Recording, method: str) -> None:
    source = write("in.npy", rig.angle, rig.torque)
    options: dict[str, Any] = {"angle": "angle", "torque": "torque", "sample_rate": 1000, "method": method}
    if method == "auto":
        some = tvident.identify(rig.angle[:8000], rig.torque[:8000], sample_rate=1000)
        options["settings"] = some.settings
    tvident.identify_file(source, "whole.npy", **options)
    seen: list[int] = []

    def stop(done: int, total: int) -> None:
        seen.append(done)
        assert total == SAMPLES
        if done > SAMPLES // 2:
            raise StopError

    with pytest.raises(StopError):
        tvident.identify_file(source, "out.npy", **options, progress=stop)
    assert not Path("out.npy").exists()
    rows = Path(".out.npy.tvident/rows").stat().st_ino
    resumed: list[int] = []
    tvident.identify_file(source, "out.npy", **options, progress=lambda done, _: resumed.append(done))
    assert min(resumed) > SAMPLES // 5  # the first pieces were done
    assert Path("out.npy").read_bytes() == Path("whole.npy").read_bytes()
    # Windows need nothing of other pieces: kept rows are the result as they are. Constants of all pieces change them.
    assert (Path("out.npy").stat().st_ino == rows) == (method == "paper")
    assert not Path(".out.npy.tvident").exists()


def test_one_call_at_a_time_writes_a_result(rig: tvident.Recording) -> None:
    source = write("in.npy", rig.angle, rig.torque)
    options: dict[str, Any] = {"angle": "angle", "torque": "torque", "sample_rate": 1000, "method": "paper"}
    refused: list[str] = []

    def again(_done: int, _total: int) -> None:
        # A call with other settings would remove what the first has kept.
        with pytest.raises(BlockingIOError, match=r"one call at a time") as raised:
            tvident.identify_file(source, "out.npy", **options, step=2)
        refused.append(str(raised.value))

    tvident.identify_file(source, "out.npy", **options, progress=again)
    assert refused
    assert not Path(".out.npy.tvident").exists()
    # An error lets the next call go on, even while its traceback is kept.
    with pytest.raises(KeyError) as raised:
        tvident.identify_file(source, "out.npy", **(options | {"angle": "none"}))
    tvident.identify_file(source, "out.npy", **options)
    assert raised.tb is not None


def test_interrupted_work_goes_on_with_columns_where_rows_are_no_result(rig: tvident.Recording) -> None:
    source = write("in.npy", rig.angle, rig.torque)
    options: dict[str, Any] = {"angle": "angle", "torque": "torque", "sample_rate": 1000, "method": "paper", "step": 3}

    def stop(done: int, _: int) -> None:
        if done > SAMPLES // 2:
            raise StopError

    with pytest.raises(StopError):
        tvident.identify_file(source, "out.parquet", **options, progress=stop)
    # What an interrupted call wrote beyond what it noted is written again.
    with Path(".out.parquet.tvident/rows").open("ab") as rows:
        rows.write(bytes(1000))
    resumed: list[int] = []
    tvident.identify_file(source, "out.parquet", **options, progress=lambda done, _: resumed.append(done))
    assert min(resumed) > SAMPLES // 5
    tvident.identify_file(source, "whole.npy", **options)
    found, whole = columns_of("out.parquet"), np.load("whole.npy")
    for name in whole.dtype.names:
        assert np.array_equal(found[name], whole[name], equal_nan=True), name


def test_a_result_takes_the_place_and_the_mode_of_another_through_links(rig: tvident.Recording) -> None:
    source = write("in.npy", rig.angle[:9000], rig.torque[:9000])
    Path("old.npy").touch(mode=0o600)
    Path("out.npy").symlink_to("old.npy")
    found = tvident.identify_file(source, "out.npy", angle="angle", torque="torque", sample_rate=1000, method="paper")
    assert Path("out.npy").is_symlink()
    assert Path("old.npy").stat().st_mode & 0o777 == 0o600
    assert np.load("old.npy").size == found.rows == 9000


def test_what_another_input_left_is_not_used(rig: tvident.Recording) -> None:
    options: dict[str, Any] = {"angle": "angle", "torque": "torque", "sample_rate": 1000, "method": "paper"}

    def stop(done: int, _: int) -> None:
        if done > SAMPLES // 2:
            raise StopError

    with pytest.raises(StopError):
        tvident.identify_file(write("in.npy", rig.angle, rig.torque), "out.npy", **options, progress=stop)
    tvident.identify_file(write("in.npy", rig.angle, -rig.torque), "out.npy", **options)
    whole = tvident.identify(rig.angle, -rig.torque, sample_rate=1000, method="paper")
    assert np.array_equal(np.load("out.npy")["stiffness"], whole.stiffness, equal_nan=True)


@pytest.mark.parametrize("ending", ["npy", "csv", "zarr"])
def test_a_recording_that_is_written_to_while_it_is_read_gives_no_result(
    rig: tvident.Recording, ending: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = write(f"in.{ending}", rig.angle, rig.torque)
    changed = (
        next(one for one in sorted(Path(source).rglob("*")) if one.is_file()) if ending == "zarr" else Path(source)
    )

    def append(*_: object) -> None:
        with changed.open("ab") as file:
            file.write(b"0.1,0.")

    def copied(*given: Any) -> Any:
        append()
        return copy_text(*given)

    monkeypatch.setattr(copied_module, "copy_text", copied)
    options: dict[str, Any] = {"angle": "angle", "torque": "torque", "sample_rate": 1000, "method": "paper", "step": 50}
    with pytest.raises(tvident.recordings.FileError, match=rf"in\.{ending}.*must stay as it is while it is read"):
        tvident.identify_file(source, "out.npy", **options, progress=None if ending == "csv" else append)
    assert not Path("out.npy").exists()


def test_units_and_times_of_the_file_are_used(rig: tvident.Recording) -> None:
    time = 5 + np.arange(SAMPLES) / 1000
    text = np.stack([time, np.degrees(rig.angle), 1000 * rig.torque], axis=1)
    np.savetxt("in.csv", text, delimiter=",", header="time [s],angle [deg],torque [N mm]", comments="", fmt="%.12g")
    tvident.identify_file("in.csv", "out.npy", angle="angle", torque="torque", method="paper")
    recording = tvident.read_recording("in.csv")
    whole = tvident.identify(recording["angle"], recording["torque"], t=recording.time, method="paper")
    written = columns_of("out.npy")
    assert np.array_equal(written["stiffness"], whole.stiffness, equal_nan=True)
    assert np.allclose(written["time"], time, rtol=0, atol=1e-9)  # times are written with twelve digits


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"angle": "angel"}, KeyError, "has no channel 'angel'"),
        ({"output": "out.xlsx"}, ValueError, "out.xlsx"),
        ({"output": "nowhere/out.npy"}, FileNotFoundError, "no such folder"),
        ({"output": "in.npy"}, ValueError, "must not replace"),
        ({"path": "gone.npy"}, tvident.recordings.FileError, "no such file"),
        ({"path": "in.mat"}, tvident.recordings.FileError, "in.mat"),
        ({"sample_rate": None}, TypeError, "no channel of times"),
        ({"inertia": np.ones(SAMPLES)}, TypeError, "give a number"),
        ({"step": 0}, ValueError, "step"),
        ({"weights": "heavy"}, KeyError, "has no channel 'heavy'"),
    ],
)
def test_a_wrong_call_says_what_would_be_right(
    rig: tvident.Recording, change: dict[str, Any], error: type[Exception], words: str
) -> None:
    write("in.npy", rig.angle, rig.torque)
    Path("in.mat").touch()
    options = {"path": "in.npy", "output": "out.npy", "angle": "angle", "torque": "torque", "sample_rate": 1000}
    with pytest.raises(error, match=words):
        tvident.identify_file(**{**options, "method": "paper", **change})
    assert not Path("out.npy").exists()
    assert not list(Path.cwd().glob(".*"))


def test_times_that_are_not_uniform_are_named(rig: tvident.Recording) -> None:
    time = np.arange(SAMPLES) / 1000
    time[44_444] += 2e-4
    np.save(
        "in.npy",
        np.rec.fromarrays([time, rig.angle, rig.torque], dtype=[(name, float) for name in ("time", "angle", "torque")]),
    )
    with pytest.raises(ValueError, match="sample 44444"):
        tvident.identify_file("in.npy", "out.npy", angle="angle", torque="torque")


def peak_of(arguments: list[str]) -> int:
    """Return the bytes that a process of its own held at most beyond what its imports need."""
    command = [sys.executable, str(Path(__file__).with_name("peak_of_file.py")), *arguments]
    return int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="only Linux keeps the most memory held")
@pytest.mark.parametrize(("method", "most"), [("paper", 120), *long(("given", 200))])
def test_memory_does_not_grow_with_the_recording(method: str, most: int) -> None:
    # What pieces of 262 144 samples need, and of a million in weak form, the longest there are, in MiB.
    rig = tvident.simulate_torsional_rig(duration=500, sample_rate=1000, seed=1)
    angle, torque = (np.tile(one, 1 if method == "paper" else 2) for one in (rig.angle, rig.torque))
    write("in.npy", angle, torque)
    assert peak_of(["in.npy", "out.npy", method]) < most * 2**20


def test_the_command_goes_from_file_to_file(rig: tvident.Recording) -> None:
    write("in.npy", rig.angle, rig.torque)
    options = ["--angle", "angle", "--torque", "torque", "--sample-rate", "1000", "--method", "paper", "--step", "5"]
    done = CliRunner().invoke(main, ["identify", "in.npy", *options, "-o", "out.npy", "--in-pieces"])
    assert done.exit_code == 0, done.output
    assert "14001 rows in out.npy" in done.output
    whole = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper", step=5)
    assert np.array_equal(np.load("out.npy")["stiffness"], whole.stiffness, equal_nan=True)
    refused = CliRunner().invoke(
        main, ["identify", "in.npy", *options, "-o", "o.npy", "--plot", "o.png", "--in-pieces"]
    )
    assert refused.exit_code == 2
    assert "--plot needs the whole recording" in refused.output
