"""What stopped or misled somebody who had the README alone and files of other programs: each is told, or works."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

import tvident
from commands import run

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
    assert "uniform: 0.5 per unit, 500 Hz" in run("info", "messung.csv").stdout


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("command", ["identify", "compare", "report"])
def test_the_channel_of_times_is_named_where_none_was_given(command: str) -> None:
    done = run(command, "messung.csv", "--angle", "Winkel", "--torque", "Drehmoment")
    assert done.returncode == 2
    assert "give --sample-rate, --delta or --time; it may be --time Zeit" in done.stderr


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


@pytest.mark.usefixtures("folder")
def test_a_member_of_a_structure_is_found_by_the_name_that_it_is_listed_with() -> None:
    call = "identify run.mat --angle angle_deg --torque torque_Nmm --time t --stiffness constant"
    done = run(*call.split(), "--time-unit", "ms")
    assert done.returncode == 0, done.stderr
    assert "degrees?" not in done.stdout + done.stderr
    wrong = run(*call.split())
    assert (
        "is the time in milliseconds? Then give time_unit='ms' with t or delta, --time-unit ms on the command"
        in wrong.stdout
    )
