"""What older programs and spreadsheets write: inch signs, alphabets without a mark, Fortran's exponents, errors in cells, compression."""

from __future__ import annotations

import gzip
import warnings
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import tvident
from tvident import recordings
from tvident._command_line import main
from tvident._files import unpacked


def read(folder: Path, content: str) -> dict[str, list[float]]:
    (folder / "x.csv").write_text(content)
    return {name: values.tolist() for name, values in recordings.read(folder / "x.csv").items()}


@pytest.mark.parametrize("title", ['Rig 3" shaft', 'stroke 3",,', 'Rig 3 " shaft'])
def test_an_inch_sign_begins_no_name_in_quotes(tmp_path: Path, title: str) -> None:
    """It was taken for the beginning of a name, and those below, over several lines, were refused."""
    found = read(tmp_path, f'{title}\n"angle\ndeg","torque\nNm"\n1,2\n3,4\n')
    assert found == {"angle deg": [1, 3], "torque Nm": [2, 4]}


def test_a_name_in_quotes_may_hold_an_inch_sign(tmp_path: Path) -> None:
    found = read(tmp_path, '"stroke 3"" [mm]\nraw","torque\nNm"\n1,2\n3,4\n')
    assert list(found) == ['stroke 3" [mm] raw', "torque Nm"]
    assert list(read(tmp_path, 't,stroke 3",force\n1,2,3\n3,4,5\n')) == ["t", "stroke 3", "force"]


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("names", ["Winkel [°];M/Nm", "角度;トルク"])
def test_utf_16_is_known_without_a_mark(tmp_path: Path, encoding: str, names: str) -> None:
    """It was refused for the character NUL."""
    (tmp_path / "x.csv").write_bytes(f"{names}\n1,5;2\n3;4,25\n".encode(encoding))
    found = recordings.read(tmp_path / "x.csv")
    assert list(found) == names.split(";")
    assert [values.tolist() for values in found.values()] == [[1.5, 3], [2, 4.25]]
    (tmp_path / "x.csv").write_bytes("a;b\n1;2\n".encode(encoding)[:-1])
    with pytest.raises(recordings.FileError, match=f"a text that begins as {encoding} must end so"):
        recordings.read(tmp_path / "x.csv")


def test_numbers_that_fill_their_columns_are_asked_for_a_blank(tmp_path: Path) -> None:
    """A first row of them was left out as one that holds no names, a last one as words."""
    rows = [" 1.0D+00-2.0D+00", " 1.0D+00 2.0D+00", " 1.5D+00 3.0D+00"]
    for place, cure in (
        (0, "write a blank before every sign"),
        (1, "every line must have 2 cells"),
        (2, "every line must"),
    ):
        lines = rows[1:]
        lines.insert(place, rows[0])
        with pytest.raises(recordings.FileError, match=cure):
            read(tmp_path, "\n".join(lines) + "\n")


def test_a_comment_may_be_about_values_that_are_missing(tmp_path: Path) -> None:
    """It was refused as a row in which words stand."""
    found = read(tmp_path, "#NV, not available\nt,x\n1,2\n#NV, a sensor fell off\n#NV,#NV\n3,4\n")
    np.testing.assert_equal(found, {"t": [1, np.nan, 3], "x": [2, np.nan, 4]})
    # Rows are no comments, whatever separates their cells, and what may be a wrong number is refused.
    for row in ("#NV 3", "#NV\t3", "#NV;3"):
        separator = row[3]
        assert len(read(tmp_path, f"t{separator}x\n1{separator}2\n{row}\n2{separator}3\n")["x"]) == 3
    for wrong in ("#NV,bad", "#NV,0x10"):
        with pytest.raises(recordings.FileError, match="line 3 must hold numbers"):
            read(tmp_path, f"t,x\n1,2\n{wrong}\n2,3\n")
    with pytest.raises(recordings.FileError, match="line 3 must hold numbers"):
        read(tmp_path, "t,x,y\n1,2,3\n#N/A,ERR,ERR\n2,3,4\n")
    with pytest.warns(recordings.FileWarning, match="'state': not read"):
        assert len(read(tmp_path, "t,x,state\n1,2,a\n2,3,b\n#NV,#NV,b\n3,4,c\n")["t"]) == 4


def test_a_file_that_was_appended_to_says_so(tmp_path: Path) -> None:
    """The cure was to write numbers without separators of thousands."""
    block = "t;x\ns;Grad\n0,5;1,5\n0,6;1,7\n"
    with pytest.raises(
        recordings.FileError, match="line 6 repeats what stands above the numbers, 't;x', and numbers go on in line 8"
    ):
        read(tmp_path, block + "\n" + block)


def test_fortran_writes_d_before_exponents(tmp_path: Path) -> None:
    assert read(tmp_path, " 1.0D+03  2.5d-01\n 3.0D+00  -.5D-002\n") == {"0": [1000, 3], "1": [0.25, -0.005]}
    assert read(tmp_path, "a,b\n0.1D+01,1.5\n0.2D+01,2.5\n,1E3\n")["a"][:2] == [1, 2]
    # What may be no number at all stays none.
    (tmp_path / "x.csv").write_text("t,id\n1,1D3\n2,2D4\n")
    with pytest.raises(recordings.FileError, match="'1D3' in line 2 is no number"):
        recordings.read(tmp_path / "x.csv")


@pytest.mark.parametrize(
    ("content", "expected", "said"),
    [
        (
            "a,b\n1,#DIV/0!\n2,3\n#N/A,4\n5,#REF!\n",
            [[1, 2, None, 5], [None, 3, 4, None]],
            "2 cells hold errors .*'#DIV/0!' in line 2",
        ),
        (
            "a;b\n1;2,5\n2;#WERT!\n3;1\n",
            [[1, 2, 3], [2.5, None, 1]],
            "one cell holds an error .*'#WERT!' in line 3, column 'b'",
        ),
        ("a;b\n#BEZUG!;1\n2;#¡DIV/0!\n3;#NV\n", [[None, 2, 3], [1, None, None]], "2 cells hold errors"),
    ],
)
def test_errors_of_spreadsheets_are_missing_and_counted(
    tmp_path: Path, content: str, expected: list[list[float | None]], said: str
) -> None:
    """`#REF!` began a comment, before which a cell was missing. `#N/A` is what a sheet writes for a missing value on purpose."""
    with pytest.warns(recordings.FileWarning, match=said):
        found = read(tmp_path, content)
    np.testing.assert_array_equal(list(found.values()), np.array(expected, dtype=float))


@pytest.mark.parametrize("row", ["#N/A,#N/A", "#DIV/0!,#DIV/0!", "#DIV/0!,"])
def test_a_first_row_of_errors_is_a_row_and_no_names(tmp_path: Path, row: str) -> None:
    """The row was gone, or its errors took the names' place."""
    (tmp_path / "x.csv").write_text(f"angle [rad],torque [Nm]\n{row}\n1.5,2.5\n3.5,4.5\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", recordings.FileWarning)
        found = recordings.read(tmp_path / "x.csv")
    assert [name.partition(" ")[0] for name in found] == ["angle", "torque"]
    np.testing.assert_array_equal(list(found.values()), [[np.nan, 1.5, 3.5], [np.nan, 2.5, 4.5]])


def test_what_only_begins_as_an_error_is_a_comment(tmp_path: Path) -> None:
    content = "#N/A means missing\na,b\n1,2 #REF! to another sheet\n3,4#note\n"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read(tmp_path, content) == {"a": [1, 3], "b": [2, 4]}


def test_packed_text_is_read_as_what_it_holds(tmp_path: Path) -> None:
    tvident.simulate_torsional_rig(duration=2.0).save(tmp_path / "rig.csv")
    whole = (tmp_path / "rig.csv").read_bytes()
    (tmp_path / "rig.csv.gz").write_bytes(gzip.compress(whole))
    found, expected = recordings.read(tmp_path / "rig.csv.gz"), recordings.read(tmp_path / "rig.csv")
    assert list(found) == list(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)
    for place in ("rig.csv", "rig.csv.gz"):
        tvident.identify_file(
            tmp_path / place,
            tmp_path / f"{place}.npy",
            angle="angle",
            torque="torque",
            sample_rate=1000,
            stiffness="constant",
        )
    np.testing.assert_array_equal(np.load(tmp_path / "rig.csv.npy"), np.load(tmp_path / "rig.csv.gz.npy"))
    packed, plain = (CliRunner().invoke(main, ["info", "-"], input=one) for one in (gzip.compress(whole), whole))
    assert packed.exit_code == 0
    assert packed.stdout == plain.stdout


def test_a_packed_text_is_whole_and_of_a_size_that_recordings_have(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    packed = gzip.compress(b"a,b\n" + b"1,2\n" * 100_000)
    place = tmp_path / "x.csv.gz"
    for content in (packed[:-20], packed + b"more", packed[:40] + b"\xff\xff" + packed[42:]):
        place.write_bytes(content)
        with pytest.raises(recordings.FileError, match=r"as \.csv\.gz: a packed file must be whole; .*; copy it again"):
            recordings.read(place)
    place.write_bytes(packed)
    monkeypatch.setattr(unpacked, "_LARGE", 100_000)
    with pytest.raises(recordings.FileError, match=r"at most 200 times its size, .*; unpack it yourself"):
        recordings.read(place)
    place.write_bytes(b"a,b\n1,2\n")  # a browser may have unpacked it already
    assert list(recordings.read(place)) == ["a", "b"]
    place.write_bytes(gzip.compress(packed))
    with pytest.raises(recordings.FileError, match=r"this is a gzip file; unpack it$"):
        recordings.read(place)


@pytest.mark.parametrize(
    ("encoding", "name", "words"),
    [
        (
            "shift_jis",
            "角度",
            r"'\\x8ap\\x93x \[deg\]' is neither in UTF-8 nor .*: it may be '角度 \[deg\]' in Shift-JIS or .*; save the file as UTF-8",
        ),
        ("gbk", "扭矩", r"'扭矩 \[deg\]' in GB 18030 or"),
        ("euc_kr", "토크", r" or '토크 \[deg\]' in EUC-KR"),
        ("cp1251", "угол", r"'угол \[deg\]' in Windows-1251"),
        ("cp1252", "Winkel\u2013", "nor in Latin-1: it may be 'Winkel\u2013 \\[deg\\]' in Windows-1252; save"),
    ],
)
def test_names_in_another_alphabet_are_said(tmp_path: Path, encoding: str, name: str, words: str) -> None:
    place = tmp_path / "x.csv"
    place.write_bytes(f"t [s],{name} [deg]\n0,1\n1,2\n".encode(encoding))
    with pytest.warns(recordings.FileWarning, match=words):
        np.testing.assert_array_equal(list(recordings.read(place).values()), [[0, 1], [1, 2]])


@pytest.mark.parametrize("name", ["Größe [°]", "créée [µm]", "Trägheit [N·m²]", "Winkel\u00a0[°]", "Moment ± [Nm]"])
def test_western_names_are_read_without_a_word(tmp_path: Path, name: str) -> None:
    place = tmp_path / "x.csv"
    place.write_bytes(f"t [s],{name}\n0,1\n1,2\n".encode("latin-1"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert list(recordings.read(place)) == ["t [s]", name]


@pytest.mark.parametrize("has_blank", [False, True])
def test_scopes_of_twincat_say_before_each_pair_what_a_line_holds(tmp_path: Path, *, has_blank: bool) -> None:
    """Channels were called Unit, deg, Unit_2 and Nm, and a line of tabs below them was a sample."""
    lines = ["Name\tRotor\t\t", "Name\tPos\tName\tTrq", "Data-Type\tREAL64\tData-Type\tREAL64"]
    lines += ["SampleTime[ms]\t1\tSampleTime[ms]\t1", "Unit\tdeg\tUnit\tNm", *(["\t\t\t"] if has_blank else [])]
    lines += [f"{k}\t{k / 7:.5f}\t{k}\t{k / 3:.5f}" for k in range(50)]
    path = tmp_path / "scope.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = tvident.read_recording(path)
    units = {name: values.unit for name, values in found.items()}
    assert units == {"time": "ms", "Pos": "deg", "time_2": "ms", "Trq": "Nm"}
    np.testing.assert_allclose(found["Trq"], np.arange(50) / 3, atol=1e-5)
    assert any("the first row holds nothing" in str(one.message) for one in said) == has_blank


def of_pairs(path: Path, head: list[str]) -> dict[str, str]:
    """Write lines above pairs of times and samples, and return the units of the columns."""
    pairs = max(line.count("\t") + 1 for line in head) // 2
    path.write_text("\n".join([*head, *("\t".join([f"{k}", f"{k / 7:.5f}"] * pairs) for k in range(50))]) + "\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", recordings.FileWarning)
        return {name: values.unit for name, values in tvident.read_recording(path).items()}


SCOPE = ["Name\tPos", "Data-Type\tREAL64", "SampleTime[ms]\t1", "Unit\tdeg"]


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        (SCOPE, {"time": "ms", "Pos": "deg"}),
        (["Name\tRig", "File\tx", *SCOPE, "ScaleFactor\t1"], {"time": "ms", "Pos": "deg"}),
        (SCOPE[:3], {"time": "ms", "Pos": ""}),
        ([f"{line}\t{line}" for line in SCOPE[:3]], {"time": "ms", "Pos": "", "time_2": "ms", "Pos_2": ""}),
        (
            ["Name\tPos\tName\tTrq", "SampleTime[ms]\t1\tSampleTime[us]\t9", "Unit\tdeg\tUnit\tNm"],
            {"time [ms]": "ms", "Pos": "deg", "time [us]": "us", "Trq": "Nm"},
        ),
    ],
)
def test_scopes_of_twincat_with_one_channel_without_units_or_with_two_rates(
    tmp_path: Path, head: list[str], expected: dict[str, str]
) -> None:
    assert of_pairs(tmp_path / "scope.csv", head) == expected


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        (
            ["Name\tRotor\tName\tMotor", "time [s]\tangle [deg]\ttime [s]\ttorque [Nmm]"],
            {"Name.time": "s", "Rotor.angle": "deg", "Name.time_2": "s", "Motor.torque": "Nmm"},
        ),
        (["name\tleft\tname\tright"], dict.fromkeys(["name", "left", "name_2", "right"], "")),
        (["Name\tPos", "Unit\tdeg"], {"Name": "", "Pos": "deg"}),
        # Below what a scope says names are nearer.
        (
            [f"{line}\t{line}" for line in SCOPE] + ["t\tangle [rad]\tt\ttorque [Nmm]"],
            {"t": "ms", "angle": "rad", "t_2": "ms", "torque": "Nmm"},
        ),
    ],
)
def test_other_lines_that_begin_pairs_with_one_word_are_of_no_scope(
    tmp_path: Path, head: list[str], expected: dict[str, str]
) -> None:
    """Names and units below such a line were lost, without a word."""
    assert of_pairs(tmp_path / "x.tsv", head) == expected


@pytest.mark.parametrize("separator", ["\t", ";", ","])
def test_separators_alone_below_the_names_are_no_sample(tmp_path: Path, separator: str) -> None:
    """They were a first sample in which nothing was measured, and all others came later."""
    rows = [f"{k}{separator}{k}.5" for k in range(30)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([f"time [ms]{separator}angle", separator, separator, *rows]) + "\n", encoding="utf-8")
    with pytest.warns(recordings.FileWarning, match="the first 2 rows hold nothing: not read"):
        found = recordings.read(path)
    np.testing.assert_array_equal(found["angle"], np.arange(30) + 0.5)


@pytest.mark.parametrize(
    ("cells", "seconds"),
    [
        (["0 sec", "0.002 sec", "0.004 sec"], [0, 0.002, 0.004]),
        (["0 ms", "2 ms", "4 ms"], [0, 0.002, 0.004]),
        (["58 sec", "1 min", "1.5 min"], [58, 60, 90]),
        (["-1 hr", "0 hr", "1 day"], [-3600, 0, 86_400]),
    ],
)
def test_durations_of_matlab_are_times(tmp_path: Path, cells: list[str], seconds: list[float]) -> None:
    """What writetimetable writes was refused: "'0 sec' is no number, nor a time that is known"."""
    (tmp_path / "x.csv").write_text("Time,angle\n" + "".join(f"{cell},{place}.5\n" for place, cell in enumerate(cells)))
    with pytest.warns(recordings.FileWarning, match="column 'Time' holds times"):
        found = tvident.read_recording(tmp_path / "x.csv")
    np.testing.assert_allclose(found["Time"], seconds, rtol=1e-12)
    assert found.units["Time"] == "s"
