"""Columns of Parquet files give any samples, whether they are kept or decoded again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tvident
from tvident import recordings
from tvident._in_pieces import row_groups
from tvident._in_pieces.row_groups import ParquetColumn, ParquetRows

SAMPLES = 9000


@pytest.mark.parametrize("kept", [0, SAMPLES])
@pytest.mark.parametrize("group", [700, SAMPLES])
def test_any_samples_in_any_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kept: int, group: int) -> None:
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    generator = np.random.default_rng(3)
    values = generator.standard_normal(SAMPLES)
    counts: list[int | None] = list(range(SAMPLES))
    # From here on whole numbers are floats, with NaN in the place of what is missing.
    counts[6000] = None
    table = pa.table({"angle": values, "count": pa.array(counts)})
    parquet.write_table(table, tmp_path / "in.parquet", row_group_size=group)
    monkeypatch.setattr(row_groups, "_KEPT", kept)
    monkeypatch.setattr(row_groups, "_BATCH", 256)
    rows = ParquetRows(tmp_path / "in.parquet")
    assert rows.samples == SAMPLES
    expected = {"angle": values, "count": np.array([np.nan if one is None else one for one in counts])}
    columns = {name: ParquetColumn(rows, name) for name in expected}
    spans = [(0, 1), (0, 300), (250, 900), (4000, 4100), (4050, 6001), (8990, SAMPLES), (10, 5000), (0, SAMPLES)]
    spans += [(int(first), int(first + length)) for first, length in generator.integers(1, 4000, (30, 2))]
    for first, end in spans:
        for name, column in columns.items():
            assert np.array_equal(column.read(first, end), expected[name][first:end], equal_nan=True), (name, first)
    rows.close()


def test_on_the_way_within_a_row_group_nothing_is_decoded_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pa.table({"angle": np.arange(float(SAMPLES))}), tmp_path / "in.parquet")
    monkeypatch.setattr(row_groups, "_KEPT", 0)
    monkeypatch.setattr(row_groups, "_BATCH", 100)
    begun: list[int] = []
    batches = ParquetRows.batches

    def noted(rows: ParquetRows, name: str, first: int) -> object:
        begun.append(first)
        return batches(rows, name, first)

    monkeypatch.setattr(ParquetRows, "batches", noted)
    column = ParquetColumn(ParquetRows(tmp_path / "in.parquet"), "angle")
    for first in range(0, 8000, 2000):
        assert column.read(first, first + 10)[0] == first
    assert begun == [0]
    assert column.read(0, 10)[0] == 0
    assert begun == [0, 0]


def test_a_short_column_is_decoded_once_and_not_copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    values = np.arange(float(SAMPLES))
    parquet.write_table(pa.table({"angle": values}), tmp_path / "in.parquet", row_group_size=700)
    decoded: list[str] = []
    whole = ParquetRows.whole

    def noted(rows: ParquetRows, name: str) -> object:
        decoded.append(name)
        return whole(rows, name)

    monkeypatch.setattr(ParquetRows, "whole", noted)
    column = ParquetColumn(ParquetRows(tmp_path / "in.parquet"), "angle")
    later, all_of_it = column.read(8000, 8010), column.read(0, SAMPLES)
    assert decoded == ["angle"]
    assert np.array_equal(all_of_it, values)
    assert np.shares_memory(later, all_of_it)


def test_a_damaged_number_in_parquet_is_found(tmp_path: Path) -> None:
    """A byte of a page was another number, without a word: pages had no checksums, and nobody looked at them."""
    pytest.importorskip("pyarrow")
    rig = tvident.simulate_torsional_rig(duration=2.0)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, stiffness="constant")
    rig.save(tmp_path / "rig.parquet")
    result.save(tmp_path / "result.parquet")
    call: dict[str, Any] = {"angle": "angle", "torque": "torque", "sample_rate": 1000, "stiffness": "constant"}
    tvident.identify_file(tmp_path / "rig.parquet", tmp_path / "out.parquet", **call)
    for name, values in (("rig", rig.angle), ("result", result.status), ("out", rig.time)):
        path = tmp_path / f"{name}.parquet"
        content = bytearray(path.read_bytes())
        place = content.find(np.ascontiguousarray(values)[5:8].tobytes())
        place = place if place > 0 else 200  # packed: any byte of the first column
        content[place] ^= 1
        path.write_bytes(content)
        read = tvident.load if name == "result" else recordings.read
        with pytest.raises(recordings.FileError, match=r"must be whole; .*; copy it again"):
            read(path)
    with pytest.raises(recordings.FileError, match=r"must be whole; pyarrow says: .*; copy it again"):
        tvident.identify_file(tmp_path / "rig.parquet", tmp_path / "again.npy", **call)
