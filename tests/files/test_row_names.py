"""Tables whose rows have names, as R's write.table and pandas write them: the header has a name less than the rows have cells."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import tvident
from tvident import recordings
from tvident._command_line import main

TIME = np.arange(200) / 500
CHANNELS = {"time [s]": TIME, "angle [deg]": np.sin(30 * TIME), "torque": np.cos(30 * TIME)}


def table(between: str, *, quoted: bool, first: int = 1) -> str:
    """Return what write.table writes, which puts names in quotes unless quote=FALSE."""
    mark = '"' if quoted else ""
    lines = [between.join(f"{mark}{name}{mark}" for name in CHANNELS)]
    for row, values in enumerate(zip(*CHANNELS.values(), strict=True), first):
        lines.append(between.join([f"{mark}{row}{mark}", *map(repr, map(float, values))]))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("between", "quoted"),
    [(" ", True), ("\t", True), (",", True), (";", True), ("\t", False), (",", False), (";", False)],
)
def test_names_are_of_the_columns_behind_those_of_rows(tmp_path: Path, between: str, quoted: bool) -> None:
    """The names were lost, with times and units, or the file was refused."""
    (tmp_path / "x.txt").write_text(table(between, quoted=quoted))
    with pytest.warns(recordings.FileWarning, match="line 1 has a name less than the rows have cells"):
        found = tvident.read_recording(tmp_path / "x.txt")
    assert found.units == {"0": "", "time": "s", "angle": "deg", "torque": ""}
    assert found.sample_rate == 500
    for name, values in CHANNELS.items():
        np.testing.assert_array_equal(found[name], values)


def test_a_table_of_pandas_without_a_label_of_its_index_is_identified(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=4.0)
    frame = pd.DataFrame({"time": rig.time, "angle": rig.angle, "torque": rig.torque})
    frame.to_csv(tmp_path / "x.csv", index_label=False)
    arguments = ["--angle", "angle", "--torque", "torque", "--time", "time"]
    told = CliRunner().invoke(main, ["identify", str(tmp_path / "x.csv"), *arguments])
    assert told.exit_code == 0
    assert told.stdout.startswith("K(t) known to")


@pytest.mark.parametrize(
    "content",
    [
        # What counts the rows has a name, and the last column has none.
        "frame angle\n1 0.5 2.5\n2 0.6 2.6\n3 0.7 2.7\n",
        "sample\tangle\n1\t0.5\t2.5\n2\t0.6\t2.6\n3\t0.7\t2.7\n",
        # Times that are whole, beside an angle that comes and goes.
        "time angle\n1 0.5 2.5\n2 0.9 2.6\n3 0.7 2.7\n",
        # Nothing counts the rows.
        "angle torque\n1 0.5 2.5\n3 0.6 2.6\n4 0.7 2.7\n",
    ],
)
def test_other_tables_with_a_name_less_are_left_as_they_were(tmp_path: Path, content: str) -> None:
    (tmp_path / "x.txt").write_text(content)
    with pytest.warns(recordings.FileWarning, match="line 1 is not read as names"):
        found = recordings.read(tmp_path / "x.txt")
    assert list(found) == ["0", "1", "2"]


def test_commas_that_may_be_decimal_signs_are_refused_as_before(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("angle,torque\n1,5,2\n2,5,3\n3,5,4\n")
    with pytest.raises(recordings.FileError, match="nobody can tell which is which"), warnings.catch_warnings():
        recordings.read(tmp_path / "x.csv")


def test_units_below_names_without_one_of_the_times_are_no_names(tmp_path: Path) -> None:
    """A dynamometer's channels were called (N-M) and (DEGREES), in N m and rad whatever stood there, without times."""
    lines = [
        f"{place:9d} {place % 7 + 0.5:9.5f} {place % 9 + 0.5:10.5f} {place % 5 + 90.5:9.4f}" for place in range(50)
    ]
    header = [
        "Raw Data",
        "Subject: X",
        "",
        "     mSec    Torque  Position       POS",
        "           (FT-LBS)  (DEGREES)   (ANAT)",
    ]
    path = tmp_path / "biodex.txt"
    path.write_text("\n".join([*header, *lines]) + "\n")
    found = tvident.read_recording(path)
    assert found.sample_rate == 1000
    assert (found["Torque"].unit, found["Position"].unit) == ("FT-LBS", "DEGREES")
