"""What stopped or misled somebody who had the README alone and files of other programs: each is told, or works."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from scipy.io import savemat

import tvident
from commands import run
from tvident._command_line.compare import compare
from tvident._command_line.derivatives import derivatives
from tvident._command_line.identify import identify
from tvident._commands import in_options

RIG = tvident.simulate_torsional_rig(duration=3.0, sample_rate=500, seed=4, pattern="constant")
MILLISECONDS, DEGREES, NEWTON_MILLIMETRES = 1e3 * RIG.time, np.rad2deg(RIG.angle), 1e3 * RIG.torque


def comma(value: float) -> str:
    return f"{value:.6f}".replace(".", ",")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    rows = zip(MILLISECONDS, DEGREES, NEWTON_MILLIMETRES, strict=True)
    lines = ["Messung 7;Prüfstand B;", "", "Zeit;Winkel;Drehmoment;Bemerkung", "ms;°;Nmm;"]
    lines += [";".join([*map(comma, row), ""]) for row in rows]
    (tmp_path / "messung.csv").write_text("\n".join(lines), encoding="latin-1")
    columns = {"t": MILLISECONDS, "angle_deg": DEGREES, "torque_Nmm": NEWTON_MILLIMETRES}
    savemat(tmp_path / "run.mat", {"data": {name: values[:, None] for name, values in columns.items()}})
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("folder")
def test_times_in_milliseconds_are_shown_in_hertz() -> None:
    words = run("info", "messung.csv").stdout
    assert "uniform: 500 Hz" in words
    assert words.splitlines()[-1].split(maxsplit=4) == ["Bemerkung", "float64", "1500", "1500", "holds no numbers"]
    assert "nan" not in words


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("command", ["identify", "compare", "report"])
def test_the_channel_of_times_is_named_where_none_was_given(command: str) -> None:
    done = run(command, "messung.csv", "--angle", "Winkel", "--torque", "Drehmoment")
    assert done.returncode == 2
    assert "give --sample-rate, --delta or --time; it may be --time Zeit" in done.stderr


@pytest.mark.parametrize(
    ("words", "typed"),
    [
        ("the angle reaches 160: degrees? If so, give angle_unit='deg'", "give --angle-unit deg"),
        ("give terms=['offset', ('coulomb', 'windowed')].", "give --term offset --term coulomb:windowed."),
        ("Is the torque late (lag='auto')? A controller (instrument=)?", "(--lag auto)? A controller (--instrument)?"),
        (
            "try stiffness=0, lag=-0.0021; or torque_unit='N mm'",
            "try --stiffness 0, --lag -0.0021; or --torque-unit 'N mm'",
        ),
        ("if it is the reaction, pass -torque", "give --torque-scale -1"),
        ("method=tvident.WeakForm(window_length=9), share=('inertia',)", "tvident.WeakForm(window_length=9), share=("),
        ("noise (p = 0.19), K=4 and C=3", "(p = 0.19), K=4 and C=3"),
        ("there is no 'delta=5'; give delta=0.001", "there is no 'delta=5'; give --delta 0.001"),
        ("there is no 'my lag=5'; give lag=0.1", "there is no 'my lag=5'; give --lag 0.1"),
        (
            "masses' names: 'the driver's step=3', \"it's lag='auto'\" or 'pass -torque t=(t, t)'; give step=2",
            "masses' names: 'the driver's step=3', \"it's lag='auto'\" or 'pass -torque t=(t, t)'; give --step 2",
        ),
        ("a body's lag='auto' and a rod's step=2", "a body's --lag auto and a rod's --step 2"),
        ("times of its own: t=(t, t), which", "times of its own: --torque-time with the channel of --time, which"),
    ],
)
def test_the_cure_can_be_typed(words: str, typed: str) -> None:
    with click.Context(identify):
        assert typed in in_options(words)
    assert in_options(words) == words  # in Python


def test_clocks_of_channels_are_given_to_a_command_that_takes_them() -> None:
    with click.Context(derivatives):
        assert in_options("give t=(t, t)") == "give --torque-time of tvident identify with the channel of --time"
    with click.Context(compare):
        assert in_options("give t=(t, t)") == "give --torque-time with the channel of --time"


@pytest.mark.usefixtures("folder")
def test_what_python_refuses_is_said_with_options() -> None:
    call = "identify volts.npz --angle angle --torque torque --sample-rate 500"
    tvident.FileRecording({"angle [rad]": RIG.angle, "torque [V]": RIG.torque}).write("volts.npz")
    done = run(*call.split())
    assert done.returncode == 2
    assert "or give --torque-unit 'N m' if the numbers are in N m" in done.stderr
    np.savez("reaction.npz", angle=RIG.angle, torque=-RIG.torque)
    call = call.replace("volts", "reaction")
    assert "if it is the reaction to it, give --torque-scale -1" in run(*call.split()).stdout
    done = run(*call.split(), "--torque-scale", "-1")
    assert done.stdout.startswith("K(t) known"), done.stdout


@pytest.mark.usefixtures("folder")
def test_a_channel_that_was_recorded_more_slowly_than_its_rows_gets_times_of_its_own() -> None:
    torque = RIG.torque.copy()
    torque[np.arange(torque.size) % 2 == 0] = np.nan
    tvident.FileRecording({"t [s]": RIG.time, "angle [rad]": RIG.angle, "torque [N m]": torque}).write("slow.csv")
    call = "identify slow.csv --angle angle --torque torque --time t --stiffness constant"
    refused = run(*call.split())
    assert refused.returncode == 2
    assert (
        "it has one in every 2 only, as if recorded at 250 Hz; give it times of its own: --torque-time"
        in refused.stderr
    )
    in_pieces = run(*call.split(), "--in-pieces", "-o", "slow.npy")
    assert "in every 2 only, as if recorded at 250 Hz; resample it, or identify a part" in in_pieces.stderr
    done = run(*call.split(), "--torque-time", "t")
    assert done.returncode == 0, done.stderr
    expected = tvident.identify(RIG.angle, RIG.torque, sample_rate=500, stiffness="constant").value("stiffness")
    found = float(done.stdout.rsplit("stiffness = ", 1)[1].split()[0])
    # Half of the torque has 1.4 times its error.
    assert found == pytest.approx(expected.value, abs=4 * np.sqrt(2) * expected.stderr)


@pytest.mark.usefixtures("folder")
def test_capitals_do_not_matter_where_they_tell_nothing_apart() -> None:
    call = "identify messung.csv --angle winkel --torque DREHMOMENT --time zeit --stiffness constant"
    done = run(*call.split())
    assert done.returncode == 0, done.stderr
    expected = tvident.identify(RIG.angle, RIG.torque, sample_rate=500, stiffness="constant").constants["inertia"][0]
    assert float(done.stdout.rsplit("inertia = ", 1)[1].split()[0]) == pytest.approx(expected, rel=1e-3)
    np.savez("two.npz", Angle=DEGREES, angle=DEGREES, torque=NEWTON_MILLIMETRES)
    both = run("identify", "two.npz", "--angle", "ANGLE", "--torque", "torque", "--sample-rate", "500")
    assert both.returncode == 2
    assert "must have one channel 'ANGLE'; it has Angle, angle; name one of these" in both.stderr


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_a_member_of_a_structure_is_found_by_the_name_that_it_is_listed_with() -> None:
    call = "identify run.mat --angle angle_deg --torque torque_Nmm --time t --stiffness constant"
    done = run(*call.split(), "--time-unit", "ms")
    assert done.returncode == 0, done.stderr
    assert "degrees?" not in done.stdout + done.stderr
    savemat("bare.mat", {"Fs": 500.0, "angle": RIG.angle, "torque": RIG.torque})
    asked = run("identify", "bare.mat", "--angle", "angle", "--torque", "torque")
    assert "give --sample-rate, --delta or --time; it may be --sample-rate 500, as Fs says" in asked.stderr
    channels: dict[str, Any] = {"Fs [deg]": 3.0, "fs [kHz]": 0.5, "angle": RIG.angle, "torque": RIG.torque}
    np.savez("bare.npz", **channels)
    asked = run("identify", "bare.npz", "--angle", "angle", "--torque", "torque")
    assert "it may be --sample-rate 500, as fs [kHz] says" in asked.stderr
    np.savez("bare.npz", **channels | {"dt": 0.001})
    asked = run("identify", "bare.npz", "--angle", "angle", "--torque", "torque")
    assert "dt says 1000 Hz: give --sample-rate with the right one" in asked.stderr
    assert "it may be" not in asked.stderr
    said: dict[str, Any] = {"dt": 0.002, "Ts [ms]": 2.0, "trial.fs": np.array([500.0, 500.0])}
    for name, value in said.items():
        beside: dict[str, Any] = {"angle": np.ones(9), "torque": np.ones(9), name: value}
        np.savez("rate.npz", **beside)
        asked = run("identify", "rate.npz", "--angle", "angle", "--torque", "torque")
        assert f"it may be --sample-rate 500, as {name} says" in asked.stderr, name
    wrong = run(*call.split())
    assert "is the time in milliseconds? Then give --time-unit ms with --time or --delta" in wrong.stdout


def test_python_runs_the_command_where_the_program_is_not_on_the_path() -> None:
    command = [sys.executable, "-m", "tvident", "--version"]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.split() == [tvident.__version__]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("command", ["identify", "compare", "report"])
def test_channels_of_the_file_are_listed_where_none_was_named(command: str) -> None:
    done = run(command, "messung.csv", "--time", "Zeit")
    assert done.returncode == 2
    assert (
        "'--angle'; messung.csv has Zeit [ms], Winkel [°], Drehmoment [Nmm], Bemerkung; name the channel" in done.stderr
    )


@pytest.mark.usefixtures("folder")
def test_a_plan_says_which_file_it_goes_on_from() -> None:
    refused = run("plan", "messung.csv")
    assert refused.returncode == 2
    assert (
        "a plan goes on from a result; got 'messung.csv'; identify a recording with tvident identify" in refused.stderr
    )
    nothing = run("plan")
    assert nothing.returncode == 2
    assert "got neither; give --inertia, --damping" in nothing.stderr
    call = "identify messung.csv --angle Winkel --torque Drehmoment --time Zeit --stiffness constant -o result.npz"
    assert run(*call.split()).returncode == 0
    assert "stiffness within 2 %" in run("plan", "result.npz").stdout


@pytest.fixture
def bare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Write degrees and N mm without a word about units, names with blanks beside them, and times with three digits at 512 Hz."""
    rig = tvident.simulate_torsional_rig(duration=3.0, sample_rate=512, seed=4, pattern="constant")
    rows = zip(rig.time, np.rad2deg(rig.angle), 1e3 * rig.torque, strict=True)
    lines = [f"{time:.3f},{angle:.4f},{torque:.2f}" for time, angle, torque in rows]
    (tmp_path / "bare.csv").write_text("\n".join(["Rig B, test 12", "", "Time,Angle,Torque", *lines]))
    (tmp_path / "named.csv").write_text("\n".join(["Time (s),Crank angle (deg),Motor torque (N mm)", *lines]))
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
@pytest.mark.usefixtures("bare")
@pytest.mark.parametrize("command", ["identify", "report"])
def test_units_that_nobody_said_are_told(command: str) -> None:
    names = "--angle Angle --torque Torque --time Time"
    call = [command, "bare.csv", *names.split(), "--stiffness", "constant"]
    call += ["-o", "page.html"] if command == "report" else []
    none = run(*call)
    said = (
        "Units: none said of angle, torque and time, taken as rad, N m and s; if they are others, give --angle-unit, "
    )
    assert f"{said}--torque-unit and --time-unit\n" in none.stderr
    one = run(*call, "--angle-unit", "deg", "--time-unit", "s")
    assert "Units: none said of torque, taken as N m; if they are others, give --torque-unit\n" in one.stderr
    slides = run(*call, "--angle-unit", "mm")
    assert "Units: none said of torque and time, taken as N and s;" in slides.stderr
    scaled = run(*call, "--angle-unit", "deg", "--torque-scale", "0.001", "--time-unit", "s")
    assert "Units:" not in scaled.stderr
    named = [command, "named.csv", "--angle", "Crank angle", "--torque", "Motor torque", "--time", "Time"]
    done = run(*named, *call[8:])
    assert done.returncode == 0
    assert "Units:" not in done.stderr
    assert (
        done.stdout.splitlines()[:9]
        == run(*call, "--angle-unit", "deg", "--torque-unit", "Nmm").stdout.splitlines()[:9]
    )


@pytest.mark.usefixtures("bare")
def test_a_name_with_a_blank_is_put_in_quotes() -> None:
    words = "identify named.csv --angle Crank angle --torque Motor torque --time Time"
    done = run(*words.split())
    assert done.returncode == 2
    assert (
        "unexpected extra arguments (angle torque); a name that has blanks needs quotes: --angle 'crank angle'"
        in done.stderr
    )


@pytest.mark.usefixtures("bare")
def test_times_that_scatter_are_shown_in_hertz() -> None:
    words = run("info", "named.csv").stdout
    assert "increasing: 512.0" in words
    assert " Hz, steps scatter by 0.2" in words
    assert "Hz" not in run("info", "bare.csv").stdout
