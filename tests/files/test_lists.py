"""Lists of numbers in cells of text: a column for each number, and what only looks like a list stays what it is."""

from __future__ import annotations

import gzip
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tvident
from tvident import recordings

COUNT = 3000
T = np.arange(COUNT) / 500
FIRST, SECOND = np.sin(9 * T), 1e-7 * np.cos(7 * T)


@pytest.mark.parametrize(
    "pattern", ["[{:.9g}, {:.9g}]", "[{:.9g} {:.9g}]", "({:.9g}, {:.9g})", "array('d', [{:.9g}, {:.9g}])"]
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_list_in_a_cell_is_a_column_for_each_number(tmp_path: Path, pattern: str, separator: str) -> None:
    """Columns were "not read, it holds words"."""
    path = tmp_path / "states.csv"
    cells = [pattern.format(*both) for both in zip(FIRST, SECOND, strict=True)]
    table = pd.DataFrame(
        {"time": T, "position": cells, "effort [N m]": [f"[{one:.9g}]" for one in FIRST], "seq": range(COUNT)}
    )
    table.to_csv(path, sep=separator, index=False)
    with pytest.warns(
        recordings.FileWarning, match=r"cells of .position., .effort.* hold lists: each of their numbers is a column"
    ):
        found = tvident.read_recording(path)
    assert found.sample_rate == pytest.approx(500)
    np.testing.assert_allclose(found["position.0"], FIRST, rtol=1e-8)
    np.testing.assert_allclose(found["position.1"], SECOND, rtol=1e-8)
    np.testing.assert_array_equal(found["seq"], np.arange(COUNT))
    assert found["effort.0"].unit == "N m"
    assert len(found) == 5


def test_lists_are_read_piece_by_piece_too(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=4.0)
    path = tmp_path / "states.csv.gz"
    lines = [
        f'{place},"[{angle!r}, None]","({torque!r}, 1e-3)"'
        for place, (angle, torque) in enumerate(zip(rig.angle.tolist(), rig.torque.tolist(), strict=True))
    ]
    path.write_bytes(gzip.compress("\n".join(["seq,position,effort", *lines]).encode()))
    with pytest.warns(recordings.FileWarning, match="hold lists"):
        found = tvident.identify_file(
            path, tmp_path / "out.csv", angle="position.0", torque="effort.0", sample_rate=1000.0
        )
    whole = tvident.identify(rig.angle, rig.torque, sample_rate=1000.0)
    assert found.samples == rig.angle.size
    assert found.constants["inertia"][0] == pytest.approx(whole.value("inertia").value, rel=0.01)


def test_units_below_the_names_are_those_of_every_number(tmp_path: Path) -> None:
    path = tmp_path / "states.csv"
    rows = [
        f'{time!r},"[{one!r}, {other!r}]"'
        for time, one, other in zip(T.tolist(), FIRST.tolist(), SECOND.tolist(), strict=True)
    ]
    path.write_text("\n".join(["# robot 7", "time,position", "s,deg", *rows]) + "\n")
    with pytest.warns(recordings.FileWarning, match="hold lists"):
        found = tvident.read_recording(path)
    assert (found["position.0"].unit, found["position.1"].unit) == ("deg", "deg")
    np.testing.assert_array_equal(found["position.1"], SECOND)


def test_lists_of_other_lengths_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "states.csv"
    path.write_text("time,position\n" + '0.1,"[1, 2]"\n' * 5 + '0.2,"[1, 2, 3]"\n')
    with pytest.raises(recordings.FileError, match="every line must have 3 cells; line 7 has 4"):
        tvident.read_recording(path)


@pytest.mark.parametrize("cell", ["(12.5)", "[1]"])
def test_one_number_in_brackets_below_no_other_is_no_list(tmp_path: Path, cell: str) -> None:
    path = tmp_path / "states.csv"
    path.write_text(f"time,{cell}\n0.1,1\n0.2,2\n0.3,4\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error", recordings.FileWarning)
        assert len(tvident.read_recording(path)) == 2
