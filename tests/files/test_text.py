"""Text as programs and people write it: read as it is meant, or refused with line, rule and cure; never other numbers."""

from __future__ import annotations

import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import tvident
from tvident import recordings

NAN = float("nan")


def read(folder: Path, content: str | bytes) -> dict[str, list[float]]:
    path = folder / "x.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return {name: values.tolist() for name, values in recordings.read(path).items()}


def assert_reads(folder: Path, content: str | bytes, expected: dict[str, list[float]]) -> None:
    found = read(folder, content)
    assert list(found) == list(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)


def refusal(folder: Path, content: str | bytes) -> str:
    with pytest.raises(recordings.FileError) as refused:
        read(folder, content)
    message = str(refused.value)
    assert len(message) < 1000
    assert message.isprintable()
    assert "; " in message  # the rule and the cure
    return message


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ('"a","b"\n"1","2"\n"3","4"\n', {"a": [1, 3], "b": [2, 4]}),
        ("'a','b'\n'1','2'\n'3','4'\n", {"a": [1, 3], "b": [2, 4]}),
        ('"a,x";"b;y"\n1;2\n3;4\n', {"a,x": [1, 3], "b;y": [2, 4]}),
        ('"a,x","say ""b"""\n1,2\n3,4\n', {"a,x": [1, 3], 'say "b': [2, 4]}),
        ('"a"\t"b"\n"1"\t"2"\n"3"\t\n', {"a": [1, 3], "b": [2, NAN]}),
        ('"a x"  "b y"\n1 2\n3 4\n', {"a x": [1, 3], "b y": [2, 4]}),
        ("t;x\n0;1\n1;1,5\n2;2\n", {"t": [0, 1, 2], "x": [1, 1.5, 2]}),
        ("t;x\n0;-1,5e-3\n1;,5\n2;2,\n", {"t": [0, 1, 2], "x": [-1.5e-3, 0.5, 2]}),
        ("t\tx\n0,5\t1,25\n1,5\t2\n", {"t": [0.5, 1.5], "x": [1.25, 2]}),
        ("t x\n0,5 1,25\n1,5 2\n", {"t": [0.5, 1.5], "x": [1.25, 2]}),
        ('t;x\n"0,5";"1,250"\n"1,5";"2,750"\n', {"t": [0.5, 1.5], "x": [1.25, 2.75]}),
        ("a,b\n1,2,\n3,4,\n", {"a": [1, 3], "b": [2, 4]}),
        ("a,b,\n1,2,\n3,,\n", {"a": [1, 3], "b": [2, NAN]}),
        ("1;2;\n3;4;\n", {"0": [1, 3], "1": [2, 4]}),
        ("a,b\n1,2\n,\n3,4\n", {"a": [1, NAN, 3], "b": [2, NAN, 4]}),
        ("a,b\n,\n1,2\n3,4\n", {"a": [NAN, 1, 3], "b": [NAN, 2, 4]}),
        ("a,b\n1,NA\nn/a,nan\n#N/A,null\n1.#QNAN,-1.#IND\n", {"a": [1, NAN, NAN, NAN], "b": [NAN] * 4}),
        ("a,b\n1,inf\n-Inf,1.#INF\n", {"a": [1, -np.inf], "b": [np.inf, np.inf]}),
        ("a,b\n1,2\n# a comment, here\n3,4 # and here\n", {"a": [1, 3], "b": [2, 4]}),
        ("a,b\n1,2\n\n\n3,4\n\n\n", {"a": [1, 3], "b": [2, 4]}),
        ("x\n1\nnan\n3\n\n\n", {"x": [1, NAN, 3]}),
        ("a,b\r1,2\r3,4\r", {"a": [1, 3], "b": [2, 4]}),
        ("a,b\n1,2\n3,4".encode("utf-16"), {"a": [1, 3], "b": [2, 4]}),
        (b"\xff\xfe" + "a,b\r\n1,2\r\n3,4\r\n".encode("utf-16-le"), {"a": [1, 3], "b": [2, 4]}),
        ("a,b\n1,2\n3,4".encode("utf-32"), {"a": [1, 3], "b": [2, 4]}),
        ("t,x\ns,m/s^2\n0,1\n1,2\n", {"t [s]": [0, 1], "x [m/s^2]": [1, 2]}),
        ("t;x\n(ms);(V)\n\n0;1\n1;2\n", {"t [ms]": [0, 1], "x [V]": [1, 2]}),
        ("".join(f"line {i}\n" for i in range(300)) + "a,b\n1,2\n3,4\n", {"a": [1, 3], "b": [2, 4]}),
        ("sep=;\na;b\n1;2\n3;4\n", {"a": [1, 3], "b": [2, 4]}),
        ("a study\n1996\n\na,b\n1,2\n3,4\n", {"a": [1, 3], "b": [2, 4]}),
        ("1,2.5\n3,4\n", {"0": [1, 3], "1": [2.5, 4]}),
        ("t;x\n1;1.000\n2;0.500\n", {"t": [1, 2], "x": [1, 0.5]}),
        ("a,b\n+1,2E3\n.5,4.\n", {"a": [1, 0.5], "b": [2000, 4]}),
    ],
)
def test_read_as_it_is_meant(tmp_path: Path, content: str | bytes, expected: dict[str, list[float]]) -> None:
    assert_reads(tmp_path, content, expected)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            "angle\n3,14\n2,72\n1,41\n",
            "the line above the numbers must name every column; line 1 has 1, and there are 2",
        ),
        ("a,b\n1,5,2,5\n2,5,3,5\n", "line 1 has 2, and there are 4; export the channels .* with a point"),
        ("# measured\nangle\n# again\n3,14\n2,72\n", "line 2 has 1, and there are 2"),
        ("3,05\n3,14\n", "'05' in line 1, which may follow a decimal comma"),
        ("3,14\n2,72\n1,41\n1,05\n", "'05' in line 4, which may follow a decimal comma"),
        ("angle\n3,14\n2\n1,41\n", "line 1 has 1, and there are 2"),
        ('a,b\n"1,000","2,000"\n"3,000","4,000"\n', "a comma in line 2 may be a decimal sign or separate thousands"),
        ('a,b\n1,2\n"3,000",4\n', "a comma in line 3 may be a decimal sign or separate thousands"),
        ("t;x\n0;1,000\n1;2,500\n", "a comma in line 2 may be a decimal sign or separate thousands"),
        ("t;x\n" + "0;1\n" * 200 + "1;2,500\n", "a comma in line 202 may be a decimal sign or separate thousands"),
        ("t;x\n0;1.5\n1;2,5\n", "numbers must have one decimal sign; line 3 has a comma and line 2 a point"),
        ("t;x\n0;1,5\n1;2.5\n", "numbers must have one decimal sign; line 2 has a comma and line 3 a point"),
        ("a,b\n1,2\nbad,5\n3,4\n", "line 3 must hold numbers; it has 'bad' in column 'a'"),
        ("a,b\n1,2\n3,bad\n", "line 3 must hold numbers; it has 'bad' in column 'b'"),
        ("a,b\nbad,5\n1,2\n", "line 2 must hold numbers; it has 'bad'"),
        ("a,b\n1,2\nstopped\n3,4\n", "line 3 must hold numbers; it has 'stopped'; .*; line 4 has numbers again"),
        ("a,b\n1,2\n3,4\nc,d\n5,6\n", "line 4 must hold numbers; it has 'c,d'"),
        ("a,b\n1,2\n1_000,4\n", "it has '1_000' in column 'a'"),
        ("a,b\n1,2\n0x10,4\n", "it has '0x10' in column 'a'"),
        ("a,b\n1,2\n1e999,4\n", "it has '1e999' in column 'a'"),
        ("a,b\n1,2\n1.5 V,4\n", "it has '1.5 V' in column 'a'"),
        ("a,b\n1,2\n٣,4\n", "it has '٣' in column 'a'"),
        ("a,b\n1,2\n3\n", "every line must have 2 cells; line 3 has 1: '3'"),
        ("a,b\n" + "1,2\n" * 10 + "1\n" * 3000 + "1,2,3\n" * 3000, "every line must have 2 cells; line 12 has 1"),
        ("a b\n1 2\n3 4 5\n", "every line must have 2 cells; line 3 has 3"),
        ("a,b,c\n1,2\n3,4\n", "line 1 has 3, and there are 2"),
        ("x\n1\n\n3\n", "must have a number in every line; line 3 is empty; write nan"),
        (b"a,b\n1,2\n\0\0,3\n4,5\n", "must not hold the character NUL; line 3 does"),
        (b"\0" * 5000, "must not hold the character NUL; line 1 does"),
        (b"\xff\xfea\0,\0b\0\n\0" + b"\x00\xd8" * 3, "begins as utf-16 must end so"),
        (b"\x1f\x8b\x08\0", "this is a gzip file; unpack it"),
        (",".join(["1"] * 20_000) + "\n", "at most 10000 channels; this one has 20000"),
        ("x" * 1_500_000 + ",b\n1,2\n", "a line must have at most 1000000 characters; line 1 has more"),
        ("a,b\n1,2\n" + "3" * 3_000_000, "line 3 has more"),
        ("\x1b[31ma,b\n1,2\n3,\x1b[2Jbad\n", r"it has '\\x1b\[2Jbad'"),
    ],
)
def test_refused_with_the_line_the_rule_and_the_cure(tmp_path: Path, content: str | bytes, message: str) -> None:
    with pytest.raises(recordings.FileError, match=message):
        read(tmp_path, content)
    refusal(tmp_path, content)


@pytest.mark.parametrize(
    ("content", "expected", "message"),
    [
        (
            "a,b\n1,2\n3,4\nend of file\n",
            {"a": [1, 3], "b": [2, 4]},
            "line 4 below the numbers: not read.*'end of file'",
        ),
        ("a;b\n1;2\n3;4\n\nrows: 2\nend\n", {"a": [1, 3], "b": [2, 4]}, "lines 5 to 6 below the numbers: not read"),
        ("a,a,b,a\n1,2,3,4\n", {"a": [1], "a_2": [2], "b": [3], "a_3": [4]}, "column 1 is called a_2"),
        ("a,a_2,a\n1,2,3\n", {"a": [1], "a_2": [2], "a_3": [3]}, "column 2 is called a_3"),
        ("t,10,20\n0,1,2\n1,3,4\n", {"t": [0, 1], "10": [1, 3], "20": [2, 4]}, "line 1 is read as names"),
        (",0,1\n0,5,6\n1,7,8\n", {"column_0": [0, 1], "0": [5, 7], "1": [6, 8]}, "line 1 is read as names"),
        ("a study in 1996\n1 2\n3 4\n", {"0": [1, 3], "1": [2, 4]}, "line 1 is not read as names: it has 4 cells"),
    ],
)
def test_what_is_not_read_as_it_stands_is_said(
    tmp_path: Path, content: str, expected: dict[str, list[float]], message: str
) -> None:
    with pytest.warns(recordings.FileWarning, match=message):
        assert_reads(tmp_path, content, expected)


CELLS = st.one_of(
    st.integers(-10_000, 10_000).map(float),
    st.floats(-1e6, 1e6).map(lambda value: round(value, 4)),
    st.floats(allow_nan=False, allow_infinity=False),
    st.just(NAN),
)
"""Small integers, numbers with few digits, any numbers, none."""


# What hypothesis draws.
@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.lists(CELLS, min_size=3, max_size=3), min_size=2, max_size=12),
    st.sampled_from([",", ";", "\t", ", ", " ; "]),
    st.sampled_from([".", ","]),
    st.sampled_from(["", '"']),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"]),
    st.booleans(),
)
def test_numbers_are_those_that_were_written_or_refused(
    tmp_path: Path,
    rows: list[list[float]],
    separator: str,
    decimal: str,
    quote: str,
    newline: str,
    encoding: str,
    trailing: bool,
) -> None:
    def cell(value: float) -> str:
        return "" if np.isnan(value) else f"{quote}{value!r}{quote}".replace(".", decimal)

    end = separator.strip(" ") if trailing else ""
    lines = ["a°,b,c".replace(",", separator), *(separator.join(map(cell, row)) for row in rows)]
    content = newline.join(line + end for line in lines) + newline
    path = tmp_path / "x.csv"
    path.write_bytes(content.encode(encoding))
    hollow = next((place for place, row in enumerate(reversed(rows)) if not np.isnan(row).all()), len(rows))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            found = np.array(list(recordings.read(path).values())).T
        except recordings.FileError:
            # A comma that separates is no decimal sign, missing values alone are no numbers, and 1,234 has two meanings.
            assert decimal == "," or np.isnan(rows).all()
            return
    # Rows of separators alone at the end are said to be left out, nothing else is; a number far from the others may be asked about.
    left_out = [str(one.message) for one in said if "not read" in str(one.message)]
    assert [one.endswith("nothing: not read") for one in left_out] == [True] * (hollow > 0)
    np.testing.assert_array_equal(found, rows[: len(rows) - hollow])


@pytest.mark.slow
def test_long_texts_are_read_in_pieces_whose_seams_nobody_sees(tmp_path: Path) -> None:
    generator = np.random.default_rng(0)
    expected = generator.standard_normal((400_000, 2))
    lines = [f"{a!r},{b!r}" for a, b in expected.tolist()]
    assert_reads(tmp_path, "a,b\n" + "\n".join(lines), {"a": expected[:, 0].tolist(), "b": expected[:, 1].tolist()})
    lines[350_000] += ",1"
    assert "every line must have 2 cells; line 350002 has 3" in refusal(tmp_path, "a,b\n" + "\n".join(lines))
    lines[350_000] = "1,\0"
    assert "NUL; line 350002 does" in refusal(tmp_path, "a,b\n" + "\n".join(lines))
    # Latin-1 that looks like UTF-8 for millions of characters.
    lines[350_000] = "1,2 # °"
    expected[350_000] = 1, 2
    content = "a,b\n" + "\n".join(lines)
    found = read(tmp_path, content.encode("latin-1"))
    np.testing.assert_array_equal(found["b"], expected[:, 1])


def test_a_file_of_nothing_but_a_hole_is_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    with path.open("wb") as file:
        file.truncate(2_000_000_000)
    with pytest.raises(recordings.FileError, match="line 1 has more"):
        recordings.read(path)


@pytest.mark.slow
def test_thousands_of_cells_of_which_no_two_lines_have_as_many_are_refused_soon(tmp_path: Path) -> None:
    content = "\n".join(",".join(["1"] * (7_000 + 37 * line)) for line in range(60))
    started = time.process_time()
    assert "every line must have 7000 cells; line 2 has 7037" in refusal(tmp_path, content)
    assert time.process_time() - started < 2.0  # 8 s where every line was looked at from all lines above


@pytest.mark.parametrize("count", [300, 60_000])
@pytest.mark.parametrize(
    ("cut", "why"),
    [
        (0, None),
        (1, "fewer digits in its last cell"),
        (6, "fewer digits in its last cell"),
        (8, "nothing in its last cell"),
        (9, "2 of 3 cells"),
        (18, "1 of 3 cells"),
    ],
)
def test_a_last_line_within_which_writing_stopped_is_not_read(
    tmp_path: Path, cut: int, why: str | None, count: int
) -> None:
    """A number that was cut was another one, without a word."""
    drawn = np.random.default_rng(17040).uniform(0, 9.9, (count, 2))
    text = "t,a,b\n" + "\n".join(f"{i / 1000:.3f},{a:.6f},{b:.6f}" for i, (a, b) in enumerate(drawn))
    path = tmp_path / "x.csv"
    path.write_text(text[: len(text) - cut])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = recordings.read(path)
    assert len(found["t"]) == count - (why is not None)
    words = [str(one.message) for one in said]
    if why is None:
        assert not words
    else:
        assert len(words) == 1
        assert f"line {count + 1} has no end and {why}" in words[0]


def test_a_last_line_that_was_cut_is_not_read_piece_by_piece(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=2.0, seed=17040)
    rows = [f"{angle:.9f};{torque:.6f}" for angle, torque in zip(rig.angle, rig.torque, strict=True)]
    (tmp_path / "x.csv").write_text("a;b\n" + "\n".join(rows)[:-3])
    with pytest.warns(recordings.FileWarning, match="may have been cut there"):
        tvident.identify_file(
            tmp_path / "x.csv", tmp_path / "found.npy", angle="a", torque="b", sample_rate=1000, method="paper"
        )
    assert np.load(tmp_path / "found.npy").size == rig.angle.size - 1


def test_a_last_line_without_an_end_may_be_whole(tmp_path: Path) -> None:
    drawn = np.random.default_rng(17041)
    for write in ("%.4f", "%g", "%r", "%.3e", "%d"):
        for _ in range(20):
            rows = drawn.normal(0, 50, (400, 2)).tolist()
            (tmp_path / "x.csv").write_text("\n".join(f"{write % a},{write % b}" for a, b in rows))
            assert len(recordings.read(tmp_path / "x.csv")["0"]) == 400
