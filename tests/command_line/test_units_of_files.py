"""Units of headers and of options, from the file to the summary."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import tvident
from commands import run

RIG = tvident.simulate_torsional_rig(duration=3.0, pattern="constant", seed=3)
COLUMNS = np.column_stack([1e3 * RIG.time, np.rad2deg(RIG.angle), 1e3 * RIG.torque])


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("t/ms,angle [deg],torque (Nmm)", ""),
        ("t,angle,torque", "--angle-unit deg --torque-unit N-mm --time-unit ms"),
        ("t [ms],angle [V],torque [V]", "--angle-unit ° --torque-unit mNm"),
    ],
)
def test_the_summary_is_that_of_rad_and_newton_metres(tmp_path: Path, header: str, options: str) -> None:
    np.savetxt(tmp_path / "x.csv", COLUMNS, delimiter=",", header=header, comments="")
    call = f"identify {tmp_path}/x.csv --angle angle --torque torque --time t --stiffness constant {options}"
    done = run(*call.split())
    assert done.returncode == 0, done.stderr
    expected = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, stiffness="constant")
    last = done.stdout.split("inertia = ")[1].split()
    assert float(last[0]) == pytest.approx(expected.constants["inertia"][0], rel=1e-6)
    assert "?" not in done.stdout + done.stderr


def test_units_that_cannot_be_converted_are_a_line_and_a_status(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "x.csv", COLUMNS, delimiter=",", header="t [ms],angle [deg],torque [V]", comments="")
    call = f"identify {tmp_path}/x.csv --angle angle --torque torque --time t"
    done = run(*call.split())
    assert done.returncode == 2
    assert "the torque must be in a unit that can be converted to N m; got 'V'; write one of" in done.stderr
    # Both units are named where they belong to different axes, one of the header, one of an option.
    (tmp_path / "y.csv").write_text((tmp_path / "x.csv").read_text().replace("[V]", "[N mm]"))
    other = run(*call.replace("x.csv", "y.csv").split(), "--angle-unit", "mm")
    assert other.returncode == 2
    assert (
        "got 'mm' and 'N mm'; give --torque-unit N, say, if the axis slides and this is a force, or --angle-unit deg"
        in other.stderr
    )
    # A scale is known by whoever gives it: the unit of the header is no longer that of the numbers.
    scaled = run(*call.split(), "--torque-scale", "0.001", "--stiffness", "constant")
    assert scaled.returncode == 0, scaled.stderr
    times = run(*f"derivatives {tmp_path}/x.csv --channel angle --time t -o {tmp_path}/y.csv".split())
    assert times.returncode == 0, times.stderr
    assert np.loadtxt(tmp_path / "y.csv", delimiter=",", skiprows=1)[1, 0] == pytest.approx(0.001)


def test_the_unit_of_a_channel_that_is_multiplied_is_kept_or_asked_for(tmp_path: Path) -> None:
    """--torque-scale -1, which advice names, took mN m for N m: an inertia of 12.3 kg m^2 for 0.0123, without a word."""
    table = np.column_stack([COLUMNS[:, :2], -1e3 * RIG.torque])
    np.savetxt(tmp_path / "x.csv", table, delimiter=",", header="t [ms],angle [deg],torque [mN m]", comments="")
    call = f"identify {tmp_path}/x.csv --angle angle --torque torque --time t --stiffness constant".split()
    done = run(*call, "--torque-scale", "-1")
    assert done.returncode == 0, done.stderr
    expected = tvident.identify(RIG.angle, RIG.torque, sample_rate=1000, stiffness="constant").constants["inertia"][0]
    assert float(done.stdout.split("inertia = ")[1].split()[0]) == pytest.approx(expected, rel=1e-6)
    # What converts the unit has converted it.
    converted = run(*call, "--torque-scale", "-1", "--angle-scale", "0.0174533")
    assert float(converted.stdout.split("inertia = ")[1].split()[0]) == pytest.approx(expected, rel=1e-4)
    asked = run(*call, "--torque-scale", "-0.5")
    assert asked.returncode == 2
    assert (
        "the torque is in 'mN m' and multiplied by -0.5; give --torque-unit 'mN m', or --torque-unit 'N m'"
        in asked.stderr
    )
    half = run(*call, "--torque-scale", "-0.5", "--torque-unit", "mN m")
    assert float(half.stdout.split("inertia = ")[1].split()[0]) == pytest.approx(expected / 2, rel=1e-6)
    compared = run("compare", *call[1:], "--torque-scale", "-1")
    assert f"{expected:.3g}" in compared.stdout


@pytest.mark.slow
def test_methods_are_compared_in_the_units_of_a_truth(tmp_path: Path) -> None:
    """Beside degrees every method was 98 % off, and so is a rate of times in ms."""
    columns = [1e3 * RIG.time, np.rad2deg(RIG.angle), RIG.torque, RIG.inertia, RIG.damping, RIG.stiffness]
    header = "t [ms],angle [deg],torque [N m],inertia,damping,stiffness"
    np.savetxt(tmp_path / "x.csv", np.column_stack(columns), delimiter=",", header=header, comments="")
    call = ["compare", "x.csv", "--methods", "--angle", "angle", "--torque", "torque", "--time", "t", "--json"]
    done = run(*call, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    first = json.loads(done.stdout)["methods"][0]
    assert first["method"] == "tvident"
    assert max(value for name, value in first.items() if name in {"inertia", "damping", "stiffness"}) < 5
