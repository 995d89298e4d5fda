from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import calls
import tvident
from commands import run, run_program
from tvident import recordings


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "rig.csv"
    done = run("simulate", path, "--duration", 5, "--seed", 3)
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    return path


def test_the_demo_prints_a_table_and_writes_pictures(tmp_path: Path) -> None:
    done = run_program("demo", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "stiffness  N m/rad" in done.stdout
    written = {path.name for path in (tmp_path / "tvident-demo").iterdir()}
    pictures = {"recording.png", "window.png", "window-with-noise.png", "parameters.png", "parameters-paper.png"}
    assert written == pictures | {"recording.csv", "result.csv", ".tvident-demo.json"}
    for name in pictures:
        assert (tmp_path / "tvident-demo" / name).read_bytes().startswith(b"\x89PNG")


def test_a_simulated_recording_is_the_librarys(recording: Path) -> None:
    expected = tvident.simulate_torsional_rig(5.0, seed=3)
    channels = recordings.read(recording)
    assert list(channels)[:3] == ["time [s]", "angle [rad]", "torque [N m]"]
    np.testing.assert_array_equal(channels["angle [rad]"], expected.angle)
    np.testing.assert_array_equal(channels["stiffness [N m/rad]"], expected.stiffness)


def test_info_lists_the_channels(recording: Path) -> None:
    done = run("info", recording)
    assert done.returncode == 0
    assert "uniform: 1000 Hz" in done.stdout
    assert "angle [rad]" in done.stdout


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_results_are_the_librarys_with_names_and_units(recording: Path, tmp_path: Path, ending: str) -> None:
    output, picture = tmp_path / f"result.{ending}", tmp_path / "result.png"
    done = run(
        *("identify", recording, "--angle", "angle", "--torque", "torque", "--time", "time"),
        *("--window-length", 101, "--damping", 0, "--term", "offset", "-o", output, "--plot", picture),
        *("--method", "strong", "--regression-window", "0.3 s", "--inertia", "windowed", "--quantisation", 0),
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "stiffness  windowed" in done.stdout
    channels = recordings.read(recording)
    expected = tvident.identify(
        channels["angle [rad]"],
        channels["torque [N m]"],
        t=channels["time [s]"],
        **calls.paper(window_length=101, regression_window=300, damping=0, terms=["offset"]),
    )
    found = recordings.read(output)
    np.testing.assert_array_equal(found["stiffness [N m/rad]"], expected.stiffness)
    np.testing.assert_array_equal(found["stiffness_stderr [N m/rad]"], expected.stderr["stiffness"])
    np.testing.assert_array_equal(found["offset [N m]"], expected.terms["offset"])
    np.testing.assert_array_equal(found["status"], expected.status)
    np.testing.assert_array_equal(found["record_status"], np.full(expected.time.size, expected.record_status))
    np.testing.assert_array_equal(found["trusted"], expected.trusted)
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_derivatives_of_a_channel(recording: Path, tmp_path: Path) -> None:
    output, picture = tmp_path / "d.csv", tmp_path / "d.svg"
    done = run(
        *("derivatives", recording, "--channel", "angle", "--window-length", "0.1 s", "--sample-rate", 1000),
        *("--step", 5, "-o", output, "--plot", picture),
    )
    assert done.returncode == 0, done.stderr
    expected = tvident.fit_local_polynomials(recordings.read(recording)["angle [rad]"], 101, sample_rate=1000, step=5)
    found = recordings.read(output)
    np.testing.assert_array_equal(found["derivative_2 [rad/s^2]"], expected.derivatives[2])
    np.testing.assert_array_equal(found["derivative_1_stderr [rad/s]"], expected.stderr[1])
    np.testing.assert_array_equal(found["order"], expected.order)
    np.testing.assert_allclose(found["time [s]"], np.arange(0, 5, 0.005))
    assert "<svg" in picture.read_text()


def test_results_may_go_to_standard_output(recording: Path) -> None:
    done = run("identify", recording, "--angle", "angle", "--torque", "torque", "--sample-rate", 1000, "-o", "-")
    assert done.returncode == 0
    rows = list(csv.reader(done.stdout.splitlines()))
    assert rows[0][:2] == ["time [s]", "inertia [kg m^2]"]
    assert len(rows) == 5001
    assert "stiffness  windowed" in done.stderr


def test_two_files_of_one_channel_each(recording: Path, tmp_path: Path) -> None:
    channels = recordings.read(recording)
    np.save(tmp_path / "a.npy", channels["angle [rad]"])
    np.save(tmp_path / "t.npy", channels["torque [N m]"] / 2)
    done = run(
        *(
            "identify",
            "--angle",
            "a.npy",
            "--torque",
            "t.npy",
            "--torque-scale",
            2,
            "--sample-rate",
            1000,
            "-o",
            "r.npz",
        ),
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    expected = tvident.identify(channels["angle [rad]"], channels["torque [N m]"], sample_rate=1000)
    found = recordings.read(tmp_path / "r.npz")
    np.testing.assert_allclose(found["inertia [kg m^2]"], expected.inertia)


def test_known_parameters_may_be_channels_and_kinds_may_be_given(recording: Path) -> None:
    common = ("identify", recording, "--angle", "angle", "--torque", "torque", "--sample-rate", 1000)
    kinds = ("--stiffness", "stiffness", "--inertia", "constant", "--damping", "constant", "--term", "offset:constant")
    done = run(*common, *kinds)
    assert done.returncode == 0, done.stderr
    inertia = next(line for line in done.stdout.splitlines() if line.startswith("inertia ="))
    assert abs(float(inertia.split()[2]) / 0.0123 - 1) < 0.01


@pytest.mark.slow
def test_every_setting_has_an_option_and_may_be_kept_in_a_file(recording: Path, tmp_path: Path) -> None:
    channels = recordings.read(recording)
    angle, torque = channels["angle [rad]"], channels["torque [N m]"]
    usable = (np.arange(angle.size) < 2000) | (np.arange(angle.size) > 2200)
    np.save(tmp_path / "usable.npy", usable.astype(float))
    weights = np.linspace(1, 2, angle.size)
    np.save(tmp_path / "weights.npy", weights)
    common = ("identify", recording, "--angle", "angle", "--torque", "torque", "--sample-rate", 1000)
    done = run(
        *(
            *common,
            "--method",
            "weak",
            "--exponent",
            8,
            "--window-length",
            161,
            "--variation",
            "constant",
            "--lag",
            0.0005,
        ),
        *(
            "--regression-window",
            900,
            "--no-averaging",
            "--mask",
            "usable.npy",
            "--weights",
            "weights.npy",
            "--term",
            "none",
            "--inertia",
            "varying",
        ),
        *("--settings-output", "chosen.json", "-o", "one.npz"),
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    expected = tvident.identify(
        angle,
        torque,
        sample_rate=1000,
        **calls.weak(
            exponent=8,
            window_length=161,
            variation="constant",
            regression_window=900,
            averaging=False,
            lag=0.0005,
            mask=usable,
            weights=weights,
            terms=(),
            inertia="varying",
        ),
    )
    found = recordings.read(tmp_path / "one.npz")
    np.testing.assert_array_equal(found["stiffness [N m/rad]"], expected.stiffness)
    assert "offset [N m]" not in found

    files = ("--mask", "usable.npy", "--weights", "weights.npy")
    again = run(*common, "--settings", "chosen.json", *files, "-o", "two.npz", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    np.testing.assert_array_equal(recordings.read(tmp_path / "two.npz")["stiffness [N m/rad]"], expected.stiffness)

    strong = ("--method", "strong", "--filter-torque", "--selection", "pooled", "--max-order", 9, "--criterion", "bic")
    done = run(*common, *strong, "-o", "three.npz", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    smoothed = tvident.identify(
        angle,
        torque,
        sample_rate=1000,
        **calls.strong(filter_torque=True, selection="pooled", max_order=9, criterion="bic"),
    )
    found = recordings.read(tmp_path / "three.npz")
    np.testing.assert_array_equal(found["inertia [kg m^2]"], smoothed.inertia)


@pytest.mark.slow
def test_lag_quantisation_and_missing_values_have_options(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=10, encoder_counts=4096)
    angle, torque = rig.angle[2:].copy(), rig.torque[:-2]  # the torque comes two samples late
    angle[3000:3010] = np.nan
    np.savez(tmp_path / "rig.npz", angle=angle, torque=torque)
    common = ("identify", "rig.npz", "--angle", "angle", "--torque", "torque", "--sample-rate", 1000)
    step = 2 * np.pi / 4096
    for policy in ("omit", "propagate"):
        options = ("--lag", "auto", "--quantisation", step, "--nan-policy", policy)
        done = run(*common, *options, "--settings-output", "chosen.json", "-o", "result.npz", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        expected = tvident.identify(angle, torque, sample_rate=1000, lag="auto", quantisation=step, nan_policy=policy)
        found = recordings.read(tmp_path / "result.npz")
        np.testing.assert_array_equal(found["stiffness [N m/rad]"], expected.stiffness)
        assert json.loads((tmp_path / "chosen.json").read_text())["lag"] == pytest.approx(expected.settings["lag"])
    refused = run(*common, "--nan-policy", "raise", cwd=tmp_path)
    assert refused.returncode == 2
    assert "angle" in refused.stderr


GOOD = ("--angle", "angle", "--torque", "torque", "--sample-rate", "1000")


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (("identify", "FILE", *GOOD, "--window-length", "200"), 2, "window_length must be odd"),
        (("identify", "FILE", *GOOD, "--window-length", "9999"), 2, "less than or equal to the length of the record"),
        (("identify", "FILE", *GOOD[:4], "--sample-rate", "-1"), 2, "sample_rate must be positive and finite; got -1"),
        (("identify", "FILE", *GOOD[:4]), 2, "needs the sample period"),
        (
            ("identify", "FILE", "--angle", "angel", *GOOD[2:]),
            2,
            "has no channel 'angel'; it has time [s], angle [rad]",
        ),
        (
            ("identify", "FILE", *GOOD, "--term", "friction"),
            2,
            "a term must be 'offset', 'coulomb', 'cubic', 'preload', 'gravity', 'viscous_asymmetric', 'quadratic_drag' or 'stribeck'",
        ),
        (("identify", "FILE", *GOOD, "--stiffness", "nonsense"), 2, "has no channel 'nonsense'"),
        (("identify", "FILE", *GOOD, "-o", "result.ods"), 2, "files that end in .csv, .npz"),
        (("identify", "FILE", *GOOD, "--plot", "result.gif"), 2, "--plot must end in .png, .pdf or .svg"),
        (("identify", "FILE", *GOOD, "--method", "magic"), 2, "'magic' is not"),
        (("identify", "FILE", *GOOD, "--no-such-option"), 2, "No such option"),
        (("identify", "FILE", *GOOD, "--settings", "broken.npz"), 1, "broken.npz: must be whole"),
        (("identify", "FILE", *GOOD, "--settings", "few.npz", "--method", "paper"), 2, "--settings hold a method"),
        (("identify", "FILE", *GOOD, "--settings-output", "no/such/s.json"), 1, "no/such: there is no such folder"),
        (
            ("identify", "FILE", *GOOD, "--settings", "few.npz", "--exponent", "7"),
            2,
            "hold a method; got --exponent too",
        ),
        (
            ("identify", "FILE", *GOOD, "--filter-torque"),
            2,
            "--filter-torque belongs to --method strong; got it with weak",
        ),
        (
            ("identify", "FILE", *GOOD, "--method", "strong", "--exponent", "7"),
            2,
            "--exponent belongs to --method weak",
        ),
        (
            ("identify", "FILE", *GOOD, "--method", "paper", "--max-order", "7"),
            2,
            "--method paper has all its settings",
        ),
        (("identify", "FILE", *GOOD, "--lag", "soon"), 2, "such as '2 ms', or 'auto'; got 'soon'"),
        (("identify", *GOOD), 2, "channel 'angle' needs a FILE"),
        (("identify", "missing.csv", *GOOD), 1, "missing.csv: there is no such file"),
        (("identify", "FILE", *GOOD, "--time", "time"), 2, "only one of --sample-rate, --delta, --time; got"),
        (("identify", "FILE", *GOOD, "-o", "FILE"), 2, "results must not replace the recording"),
        (("identify", "FILE", *GOOD, "-o", "no/such/folder/r.csv"), 1, "no/such/folder: there is no such folder"),
        (("identify", "FILE", *GOOD, "--plot", "no/such/folder/r.png"), 1, "no/such/folder: there is no such folder"),
        (("identify", "FILE", *GOOD, "-o", "folder.csv"), 2, "'folder.csv' is a directory"),
        (("identify", "FILE", *GOOD, "--angle-scale", "0,5"), 2, "or write a number with a point, as 0.5"),
        (
            ("identify", "FILE", *GOOD, "--stiffness", "konstant"),
            2,
            "or write one of windowed, constant, auto, varying",
        ),
        (
            ("identify", "FILE", *GOOD, "--sample-rate", "500,0"),
            2,
            "write 500 or '0.5 kHz'; the decimal sign is a point",
        ),
        (("identify", "FILE", *GOOD, "--sample-rate", "5 ms"), 2, "'5 ms' is no number that is known; write 500 or"),
        (("plan", "--sample-rate", "fast"), 2, "'fast' is no number that is known"),
        (("live", "FILE", "--angle", "a", "--torque", "b"), 2, "live takes what is piped in, as -; got"),
        (("identify", "FILE", *GOOD, "--angle-scale", "inf"), 2, "a scale must be finite; got inf"),
        (("identify", "few.npz", *GOOD, "--angle-scale", "few"), 2, "'few' has 3 values for 300 samples"),
        (("identify", "FILE", *GOOD, "--step", "99999999999999999999"), 2, "step must be less than 2^63"),
        (("info", "folder.csv"), 1, "folder.csv: this is a folder; name a file in it"),
        (("info", "folder"), 1, "folder: this is a folder; name a file in it"),
        (("info", "decimal-commas.csv"), 1, "with a point as the decimal sign"),
        (("info", "broken.npz"), 1, "broken.npz: cannot be read as .npz"),
        (("info", "nothing.xyz"), 1, "the ending must be one of"),
        (
            ("derivatives", "FILE", "--channel", "angle", "--order", "16", "--delta", "1"),
            2,
            "order must be at most 15; got 16",
        ),
        (
            ("derivatives", "FILE", "--channel", "angle", "--time", "angle"),
            2,
            "the time must be in a unit that can be converted to s; got",
        ),
        (("simulate", "rig.txt"), 2, "files that end in .csv, .npz"),
        (("simulate", "rig.csv", "--duration", "-3"), 2, "duration must be positive"),
        (("simulate", "rig.csv", "--duration", "1e12"), 2, "duration times sample_rate must be at most 1e+08 samples"),
        (("simulate", "no/such/folder/rig.csv"), 1, "no/such/folder: there is no such folder"),
        (("demo", "--folder", "broken.npz/demo"), 1, "broken.npz/demo: Not a directory"),
    ],
)
def test_misuse_is_one_line_and_a_status(
    recording: Path, tmp_path: Path, arguments: tuple[str, ...], status: int, message: str
) -> None:
    (tmp_path / "broken.npz").write_bytes(b"nonsense")
    (tmp_path / "decimal-commas.csv").write_text("a,b\n1,5,2,5\n2,5,3,5\n")
    np.savez(tmp_path / "few.npz", angle=np.arange(300.0), torque=np.arange(300.0), few=np.arange(3.0))
    for folder in ("folder", "folder.csv"):
        (tmp_path / folder).mkdir()
    before = {path.name for path in tmp_path.iterdir()}
    done = run(*(recording if argument == "FILE" else argument for argument in arguments), cwd=tmp_path)
    assert done.returncode == status, done.stderr
    assert message in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert {path.name for path in tmp_path.iterdir()} == before


def test_a_channel_is_found_beside_a_file_of_its_name(recording: Path, tmp_path: Path) -> None:
    (tmp_path / "angle").write_text("not a recording")
    done = run("identify", recording, *GOOD, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("rate", ["1000 Hz", "1kHz", "1e3"])
def test_a_sample_rate_may_have_its_unit(recording: Path, rate: str) -> None:
    """'1 kHz' was "not a valid float"."""
    plain, said = (
        run("identify", recording, "--angle", "angle", "--torque", "torque", "--sample-rate", one).stdout
        for one in ("1000", rate)
    )
    assert plain == said != ""


def test_derivatives_take_the_unit_of_times(tmp_path: Path) -> None:
    """They said "give time_unit='ns'", which no option was."""
    stamps = 1_600_000_000_000_000_000 + np.arange(2000, dtype=np.int64) * 1_000_000
    np.savez(tmp_path / "echo.npz", time=stamps, x=np.sin(np.arange(2000) / 50))
    call = ("derivatives", tmp_path / "echo.npz", "--channel", "x", "--window-length", "101")
    asked = run(*call, "--time", "time")
    assert "or give --time-unit ns" in asked.stderr
    output = tmp_path / "d.csv"
    for given in (("--time", "time", "--time-unit", "ns"), ("--delta", "1", "--time-unit", "ms")):
        done = run(*call, *given, "-o", output)
        assert done.returncode == 0, done.stderr
        slopes = recordings.read(output)["derivative_1"]
        assert np.max(slopes) == pytest.approx(20, rel=0.01)
