"""Files whose names say another kind than their first bytes."""

from __future__ import annotations

from pathlib import Path

import pytest

import tvident


@pytest.mark.parametrize(
    ("kind", "name", "cure"),
    [
        ("csv", "rig.npy", "it begins as text does: rename it to rig.csv, say"),
        ("csv", "rig.npz", "it begins as text does: rename it to rig.csv, say"),
        ("npz", "rig.csv", "it begins as one that ends in .npz or .xlsx does: rename it to rig.npz, say"),
        ("npz", "rig.npy", "it begins as one that ends in .npz or .xlsx does: rename it to rig.npz, say"),
        ("csv.gz", "rig.npy", "it begins as one that ends in .csv.gz or .txt.gz does: rename it to rig.csv.gz, say"),
        ("csv.gz", "rig.csv", "unpack it, or let its name end in .csv.gz$"),
    ],
)
def test_a_name_that_says_another_kind_hears_the_right_one(tmp_path: Path, kind: str, name: str, cure: str) -> None:
    """A text called .npy heard "check that it is whole, or save it again"."""
    whole = tmp_path / f"whole.{kind.removesuffix('.gz')}"
    tvident.simulate_torsional_rig(duration=1.0).save(whole)
    content = whole.read_bytes()
    if kind.endswith(".gz"):
        import gzip  # noqa: PLC0415 - of these cases alone

        content = gzip.compress(content)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(tvident.recordings.FileError, match=cure):
        tvident.read_recording(tmp_path / name)


def test_a_damaged_file_is_not_called_another_kind(tmp_path: Path) -> None:
    place = tmp_path / "rig.npz"
    tvident.simulate_torsional_rig(duration=1.0).save(place)
    place.write_bytes(place.read_bytes()[:2000])
    with pytest.raises(tvident.recordings.FileError) as caught:
        tvident.read_recording(place)
    assert "it begins as" not in str(caught.value)
    (tmp_path / "rig.csv").write_text("a,b\n1,2\n3,x4\n5\n")
    with pytest.raises(tvident.recordings.FileError) as caught:
        tvident.read_recording(tmp_path / "rig.csv")
    assert "it begins as" not in str(caught.value)


@pytest.mark.parametrize("alphabet", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
@pytest.mark.parametrize("ending", [".npy", ".xlsx", ".tdms"])
def test_text_of_any_alphabet_is_text(tmp_path: Path, alphabet: str, ending: str) -> None:
    """Only ASCII was, and a text called .tdms "holds no numbers"."""
    place = tmp_path / f"rig{ending}"
    place.write_bytes("Zeit [s];Winkel [°];Änderung\n0;1;2\n1;2;3\n".encode(alphabet))
    with pytest.raises(tvident.recordings.FileError, match=r"it begins as text does: rename it to rig\.csv, say"):
        tvident.read_recording(place)
    place.write_text("a,b\n1,2\n3,4\n")
    with pytest.raises(tvident.recordings.FileError, match=r"it begins as text does: rename it to rig\.csv, say"):
        tvident.read_recording(place)


def test_endings_in_capitals_are_those_of_results(tmp_path: Path) -> None:
    """A result was saved as U.NPZ without what brings it back."""
    rig = tvident.simulate_torsional_rig(duration=2.0)
    result = tvident.identify(rig.angle, rig.torque, sample_rate=1000)
    for name in ("U.NPZ", "U.Parquet"):
        result.save(tmp_path / name)
        assert repr(tvident.load(tmp_path / name)) == repr(result)
