"""Text as acquisition software writes it: no name, row or unit is lost, and what is dropped is said."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
import pytest

from tvident import recordings

GERMAN = """Messung 1
Datum: 05.01.2024

Zeit;Winkel;Drehmoment;Bemerkung
s;°;Nm;
0,000;1.234,50;-0,5;Start
0,001;1,5;-0,25;
0,002;2,5;1,0;

Ende der Messung
"""

LABVIEW = """LabVIEW Measurement\t
Separator\tTab
Decimal_Separator\t.
X_Columns\tOne
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t3\t3\t
Date\t2024/01/05\t2024/01/05\t
Y_Unit_Label\tdeg\tN·m\t
X_Dimension\tTime\tTime\t
X0\t0.0E+0\t0.0E+0\t
Delta_X\t0.001000\t0.001000\t
***End_of_Header***\t\t\t
X_Value\tAngle\tTorque\tComment
0.000000\t1.5\t2.0\t
0.001000\t2.5\t3.0\t
0.002000\t3.5\t4.0\t
"""

LABCHART = """Interval=\t0.001 s
ExcelDateTime=\t4.5e4
ChannelTitle=\tAngle\tTorque
Range=\t10.000 V\t5.000 mV
UnitName=\tdeg\tN·m
TopValue=\t10.000\t5.000
BottomValue=\t-10.000\t-5.000
0\t1\t2
0.001\t2\t3
"""

OPENSIM = """Coordinates
version=1
nRows=2
nColumns=4
inDegrees=yes
endheader
time\tknee_angle_r\tpelvis_tx\tknee_moment
0.0\t10\t0.5\t1
0.01\t11\t0.6\t2
"""


def read(path: Path) -> tuple[dict[str, list[float]], str]:
    """Give the channels, and all that was said."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = {name: values.tolist() for name, values in recordings.read(path).items()}
    return found, "; ".join(str(one.message) for one in said)


NAN = float("nan")

BIODEX = """Biodex System
Date:  1/5/2024

  Time   Torque  Position
 (mSec)  (FT-LBS) (DEG)
  0    0.5   1
  10   1.5   2
"""

CATMAN = """Messreihe: Test
T0 = 05.01.2024 10:00:00

"Zeit"	"Winkel"	"Drehmoment"
"s"	"Grad"	"Nm"
"Samplerate: 600 Hz"	"Samplerate: 600 Hz"	"Samplerate: 600 Hz"
0,00	1,5	2
0,01	2,5	3
"""


@pytest.mark.parametrize(
    ("content", "expected", "said"),
    [
        (
            GERMAN,
            {"Zeit [s]": [0, 0.001, 0.002], "Winkel [°]": [1234.5, 1.5, 2.5], "Drehmoment [Nm]": [-0.5, -0.25, 1]},
            "'Bemerkung': not read, it holds words: 'Start' in line 6; .*line 10 below the numbers: not read",
        ),
        (
            "Time,A\ns,deg\nfloat,float\n0,1\n1,2\n",
            {"Time [s]": [0, 1], "A [deg]": [1, 2]},
            "line 3 is not read as names",
        ),
        (
            "Group,Group\nTime,A\ns,deg\n0,1\n1,2\n",
            {"Time [s]": [0, 1], "A [deg]": [1, 2]},
            "line 1 is not read as names",
        ),
        ("s,deg\nTime,A\n0,1\n1,2\n", {"Time [s]": [0, 1], "A [deg]": [1, 2]}, "^$"),
        ("t,note\n0,on\n1,on\n2,off\n", {"t": [0, 1, 2]}, "column 'note': not read, it holds words"),
        ("t,x,note\n0,1,start\n1,2,\n2,3,\n", {"t": [0, 1, 2], "x": [1, 2, 3]}, "column 'note': not read"),
        (
            "t,x,note\n0,1,\n" + "1,2,\n" * 30 + "2,3,end\n",
            {"t": [0, *[1] * 30, 2], "x": [1, *[2] * 30, 3]},
            "'end' in line 33",
        ),
        ("t,x,note,\n0,1,ok,\n1,2,ok,\n", {"t": [0, 1], "x": [1, 2]}, "column 'note': not read"),
        ("t;note;x;\ns;;Nm;\n0;ok;1;\n1;ok;2;\n", {"t [s]": [0, 1], "x [Nm]": [1, 2]}, "column 'note': not read"),
        (",t,note\n0,1,ok\n1,2,ok\n", {"0": [0, 1], "t": [1, 2]}, "column 'note': not read"),
        ("Rate,1000\nt,x,note\n0,1,ok\n1,2,ok\n", {"t": [0, 1], "x": [1, 2]}, "column 'note': not read"),
        (
            "Time,x\n23:59:59.5,1\n00:00:00.25,2\n",
            {"Time [s]": [86399.5, 86400.25], "x": [1, 2]},
            "began again once",
        ),
        ("Time,x\n59:59.5,1\n00:00.25,2\n", {"Time [s]": [3599.5, 3600.25], "x": [1, 2]}, "began again once"),
        (
            "t,x\n2024-01-05T12:00:00.000000Z,1\n2024-01-05T12:00:00.000001Z,\n",
            {"t [s]": [0, 1e-6], "x": [1, NAN]},
            "seconds since 2024-01-05T12",
        ),
        (
            "t;x\n05.01.2024 12:00:00,123;1,5\n05.01.2024 12:00:00,124;1,25\n",
            {"t [s]": [0, 1e-3], "x": [1.5, 1.25]},
            "since",
        ),
        ("t,x\n1/5/2024 11:59:59.5 AM,1\n1/5/2024 12:00:00.5 PM,2\n", {"t [s]": [0, 1], "x": [1, 2]}, "since"),
        ("t,x\n1/13/2024,1\n1/14/2024,2\n", {"t [s]": [0, 86400], "x": [1, 2]}, "since"),
        ("2024-01-05 12:00:00\nt x\n0 1\n1 2\n2 3\n", {"t": [0, 1, 2], "x": [1, 2, 3]}, "line 1 is not read as names"),
        ('a,b\n"1,5","2,5"\n"2,5","3,5"\n', {"a": [1.5, 2.5], "b": [2.5, 3.5]}, "^$"),
        ('t,x\n0,"1,234.5"\n1,"2,345"\n', {"t": [0, 1], "x": [1234.5, 2345]}, "^$"),
        ("t;x\n0;1,000,000\n1;2\n", {"t": [0, 1], "x": [1e6, 2]}, "^$"),
        ("t;x\n0;1\n1;-2.000,5\n", {"t": [0, 1], "x": [1, -2000.5]}, "^$"),
        ("t;x\n0;1,234\n1;2,5\n", {"t": [0, 1], "x": [1.234, 2.5]}, "^$"),
        ("t;x\n0;1,234\n1;2.5\n", {"t": [0, 1], "x": [1234, 2.5]}, "^$"),
        ("t;x\n0;1.234\n1;2,5\n", {"t": [0, 1], "x": [1234, 2.5]}, "^$"),
        ("a,b\n1,2\n1 000,1'000.5\n", {"a": [1, 1000], "b": [2, 1000.5]}, "^$"),
        ("t,x\n0,1\n1,3\nMean,0.5,2\n", {"t": [0, 1], "x": [1, 3]}, "line 4 below the numbers: not read"),
        ("t;x\n0;1\n1;3\nMittelwert;0,5;2\nStd. Dev.:;1;1\n", {"t": [0, 1], "x": [1, 3]}, "lines 4 to 5 below"),
        ("t,x,note\ns,deg,\n0,1,0\n1,2,0\n", {"t [s]": [0, 1], "x [deg]": [1, 2], "note": [0, 0]}, "^$"),
        ("Run 7;;\nt;x;note\ns;deg;\n0;1;0\n1;2;0\n", {"t [s]": [0, 1], "x [deg]": [1, 2], "note": [0, 0]}, "^$"),
        ("t,x [deg],x [deg]\n0,1,2\n1,2,3\n", {"t": [0, 1], "x [deg]": [1, 2], "x_2 [deg]": [2, 3]}, "called x_2 .deg"),
        (
            "Model Outputs\n100\n,,S:Ankle,,S:Moment,\nFrame,Sub Frame,X,Y,X,Y\n,,deg,deg,N.mm,N.mm\n1,0,2,3,4,5\n2,0,2,3,4,5\n",
            {"time [s]": [0, 0.01], "Frame": [1, 2], "Sub Frame": [0, 0]}
            | {
                "S:Ankle.X [deg]": [2, 2],
                "S:Ankle.Y [deg]": [3, 3],
                "S:Moment.X [N.mm]": [4, 4],
                "S:Moment.Y [N.mm]": [5, 5],
            },
            "^$",
        ),
        (
            "angle,angle,torque,torque\nx,y,x,y\n1,2,3,4\n1,2,3,4\n",
            {"angle.x": [1, 1], "angle.y": [2, 2], "torque.x": [3, 3], "torque.y": [4, 4]},
            "^$",
        ),
        (BIODEX, {"Time [mSec]": [0, 10], "Torque [FT-LBS]": [0.5, 1.5], "Position [DEG]": [1, 2]}, "^$"),
        (
            CATMAN,
            {"Zeit [s]": [0, 0.01], "Winkel [Grad]": [1.5, 2.5], "Drehmoment [Nm]": [2, 3]},
            "line 6 is not read as names",
        ),
        (
            "Time,A,B\nSEC,Deg,state\n0,1,1\n1,2,1\n",
            {"Time [SEC]": [0, 1], "A [Deg]": [1, 2], "B [state]": [1, 1]},
            "^$",
        ),
        ("unit,ms,deg\nname,Time,A\n,1,2\n,2,3\n", {"name": [NAN, NAN], "Time [ms]": [1, 2], "A [deg]": [2, 3]}, "^$"),
        (
            "x-axis,1,2\nsecond,Volt,Volt\n0,1,2\n1,2,3\n",
            {"x-axis [second]": [0, 1], "1 [Volt]": [1, 2], "2 [Volt]": [2, 3]},
            "^$",
        ),
        (
            "t,left,left\n,angle,torque\n0,1,2\n1,2,3\n",
            {"t": [0, 1], "angle": [1, 2], "torque": [2, 3]},
            "line 1 is not",
        ),
        (
            "Angle\tTorque\nx [s]\ty [deg]\tx [s]\ty [Nm]\n0\t1\t0\t2\n1\t2\t1\t3\n",
            {"Angle.x [s]": [0, 1], "Angle.y [deg]": [1, 2], "Torque.x [s]": [0, 1], "Torque.y [Nm]": [2, 3]},
            "^$",
        ),
        *(
            (f"{mark} t a b\n0 1 2\n1 2 3\n", {"t": [0, 1], "a": [1, 2], "b": [2, 3]}, "^$")
            for mark in ("%", "!", "//", "#")
        ),
        ("%Time\tA\n%s\tdeg\n0\t1\n1\t2\n", {"Time [s]": [0, 1], "A [deg]": [1, 2]}, "^$"),
        ("Load A B\n% deg Nm\n0 1 2\n1 2 3\n", {"Load [%]": [0, 1], "A [deg]": [1, 2], "B [Nm]": [2, 3]}, "^$"),
        ("t [s] angle [deg]\n0 1\n1 2\n", {"t [s]": [0, 1], "angle [deg]": [1, 2]}, "^$"),
        ("   t      x  \n  [ms]  [N m]\n 0  1\n 1  2\n", {"t [ms]": [0, 1], "x [N m]": [1, 2]}, "^$"),
        ("Time (s)   POS (ANAT) (deg)\n0  1\n1  2\n", {"Time (s)": [0, 1], "POS (ANAT) (deg)": [1, 2]}, "^$"),
        (
            ",A,B,Note\n0,1,2\n1,2,3\n",
            {"A": [0, 1], "B": [1, 2], "Note": [2, 3]},
            "line 1 has 4 cells, .* 3: its names are taken one",
        ),
        ("t;x\n---;---\n0;1\n1;2\n", {"t": [0, 1], "x": [1, 2]}, ""),
        ("t;x\n0;1\n1;2\n;\n;\n", {"t": [0, 1], "x": [1, 2]}, "the last 2 rows hold nothing: not read"),
        (
            "t;x\n0;1\n1;2\n;\nSumme;3\n;\n",
            {"t": [0, 1], "x": [1, 2]},
            "the last row holds nothing: not read.*line 5 below",
        ),
        ("t,x\n0,---\n1,2\n2,-\n3,****\n", {"t": [0, 1, 2, 3], "x": [NAN, 2, NAN, NAN]}, "^$"),
        (
            "t;x\n10:00:00.123;1\n10:00:00.124;2\n",
            {"t [s]": [36000.123, 36000.124], "x": [1, 2]},
            "^.*: column 't' holds times[^;]*$",
        ),
        ("t,x\n05-Jan-2024 12:00:00.5,1\n05-Jan-2024 12:00:01,2\n", {"t [s]": [0, 0.5], "x": [1, 2]}, "since"),
        ("t,x\n20240105T120000.5+0100,1\n20240105T110001Z,2\n", {"t [s]": [0, 0.5], "x": [1, 2]}, "since"),
        ("t;x\n05.01.24 12:00:00,5;1,5\n05.01.24 12:00:01,0;2\n", {"t [s]": [0, 0.5], "x": [1.5, 2]}, "since"),
        (
            '"Time\n(s)","Angle\n(deg)","Torque\n\n(Nm)"\n0,1,2\n1,2,3\n',
            {"Time (s)": [0, 1], "Angle (deg)": [1, 2], "Torque  (Nm)": [2, 3]},
            "^$",
        ),
        ('t,x,note\n0,1,ok 5"\n1,2,ok 6"\n2,3,ok\n', {"t": [0, 1, 2], "x": [1, 2, 3]}, "column 'note': not read"),
        ("t|x\n0|1,5\n1|-2,5\n", {"t": [0, 1], "x": [1.5, -2.5]}, "^$"),
        (LABCHART, {"time [s]": [0, 0.001], "Angle [deg]": [1, 2], "Torque [N·m]": [2, 3]}, "^$"),
        (
            LABCHART.replace("UnitName=\tdeg\tN·m\n", "").replace("0\t1", "1").replace("0.001\t", ""),
            {"Angle [V]": [1, 2], "Torque [mV]": [2, 3]},
            "^$",
        ),
    ],
)
def test_nothing_is_lost_and_what_is_dropped_is_said(
    tmp_path: Path, content: str, expected: dict[str, list[float]], said: str
) -> None:
    for encoding in ("utf-8", "utf-16", "latin-1"):
        (tmp_path / "x.csv").write_bytes(content.encode(encoding))
        found, messages = read(tmp_path / "x.csv")
        assert list(found) == list(expected)
        for name, values in expected.items():
            np.testing.assert_array_equal(found[name], values)
        assert re.search(said, messages), messages


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            "t,x\n2024-01-05 12:00:00 CET,1\n2024-01-05 12:00:01 CET,2\n",
            "CET' in line 2 is no number, nor a time that is known",
        ),
        ("t,x\n0,1.5 V\n1,1.6 V\n", "'1.5 V' in line 2 is no number"),
        ("t,x\n01/05/2024,1\n01/06/2024,2\n", "must say what is the day and what the month"),
        ("t,x\n12:00:00,1\n12,2\n", "line 3 must hold a time in column 't'"),
        ("t,x\n0,1\n12:00:00,2\n", "line 3 must hold numbers; it has '12:00:00'"),
        ("t,x,y\n" + "0,1,\n" * 25 + "0,1,2\n0,1,bad\n", "line 28 must hold numbers; it has 'bad' in column 'y'"),
        ("t;x\n0;1,234\n1;1.234\n", "a comma in line 2 may be a decimal sign"),
        ("t,x\n" + "1.234,2.345\n" * 4 + '1.5,"1,5"\n', "numbers must have one decimal sign"),
        (
            "t,x\n" + "1.234,2.345\n" * 4 + '1.235,"1,5"\n',
            r"the '\.' in line 2 may be a decimal sign or separate thousands, as in 9",
        ),
        (
            "t;x\n" + "1,234;2,345\n" * 4 + "1,235;1.5\n",
            "the ',' in line 2 may be a decimal sign or separate thousands, as in 9",
        ),
        (
            "t;x\n" + "1,234;2,345\n" * 4 + "1.234;1.235\n" * 2 + "1,5;2\n",
            r"the '\.' in line 6 may be a decimal sign or separate thousands, as in 4 numbers, and 1 with",
        ),
        ("t;x\n0;1.234,5\n1;2.5\n", "one decimal sign; line 2 has a comma and line 3 a point"),
    ],
)
def test_what_may_mean_two_things_is_refused(tmp_path: Path, content: str, message: str) -> None:
    (tmp_path / "x.csv").write_text(content)
    with pytest.raises(recordings.FileError, match=message):
        recordings.read(tmp_path / "x.csv")


def test_numbers_with_the_decimal_sign_do_not_make_thousands_doubtful(tmp_path: Path) -> None:
    """Nine numbers were counted against the comma of `1,5`, eight of which have commas."""
    (tmp_path / "x.csv").write_text("t;x\n" + "1,234;2,345\n" * 4 + "1,5;1.234\n")
    found = recordings.read(tmp_path / "x.csv")
    assert list(found["t"]) == [1.234] * 4 + [1.5]
    assert list(found["x"]) == [2.345] * 4 + [1234]


def test_minus_signs_of_word_processors(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("t;x\n0;\N{MINUS SIGN}1,5\n1;2e\N{MINUS SIGN}1\n", encoding="utf-8")
    assert read(tmp_path / "x.csv") == ({"t": [0, 1], "x": [-1.5, 0.2]}, "")


def test_measurements_of_labview(tmp_path: Path) -> None:
    path = tmp_path / "x.lvm"
    path.write_text(LABVIEW)
    expected = {"X_Value [s]": [0, 0.001, 0.002], "Angle [deg]": [1.5, 2.5, 3.5], "Torque [N·m]": [2, 3, 4]}
    assert read(path) == (expected, "")
    numbers = LABVIEW.partition("Comment\n")[2]
    path.write_text(LABVIEW.replace(numbers, "\t1.5\t2\t\n\t2.5\t3\t\n\t3.5\t4\t\n"))
    assert read(path)[0] == expected
    path.write_text(path.read_text().replace("X_Value", ""))
    assert read(path)[0] == expected
    path.write_text(LABVIEW + "\nChannels" + LABVIEW.partition("Channels")[2].replace("X0\t0.0", "X0\t0.003"))
    found, said = read(path)
    assert found["Angle [deg]"] == [1.5, 2.5, 3.5] * 2
    assert "2 segments are read one after the other" in said
    path.write_text(LABVIEW[: LABVIEW.index("X0")])
    with pytest.raises(recordings.FileError, match="must have two headers"):
        recordings.read(path)


@pytest.mark.parametrize("first", ["X_Value", ""])
def test_measurements_of_labview_without_the_cells_of_comments(tmp_path: Path, first: str) -> None:
    """Rows end with their last number, and the first column may have neither a name nor times: names moved by one column."""
    path = tmp_path / "x.lvm"
    head = LABVIEW.partition("X_Value")[0] + f"{first}\tAngle\tTorque\tComment\n"
    expected = {"X_Value [s]": [0, 0.001, 0.002], "Angle [deg]": [1.5, 2.5, 3.5], "Torque [N·m]": [2, 3, 4]}
    rows = ["\t1.5\t2", "\t2.5\t3", "\t3.5\t4"]
    path.write_text(head + "\n".join(rows) + "\n")
    assert read(path) == (expected, "")
    path.write_text(head + "\n".join([rows[0] + "\tbegun", *rows[1:]]) + "\n")
    found, said = read(path)
    assert found == expected
    assert "'Comment': not read, it holds words" in said
    path.write_text((head + "\n".join(rows) + "\n").replace("\t", ","))
    assert read(path) == (expected, "")


def test_measurements_of_labview_with_times_for_each_channel(tmp_path: Path) -> None:
    path = tmp_path / "x.lvm"
    head, _, _ = LABVIEW.replace("X_Columns\tOne", "X_Columns\tMulti").partition("X_Value")
    head = head.replace("Y_Unit_Label\tdeg\tN·m", "Y_Unit_Label\tdeg\t\tN·m")
    rows = "".join(f"{t}\t{t + 1}\t{t}\t{t + 2}\n" for t in range(3))
    path.write_text(f"{head}X_Value\tAngle\tX_Value\tTorque\tComment\n{rows}")
    names = ["X_Value [s]", "Angle [deg]", "X_Value_2 [s]", "Torque [N·m]"]
    found, _ = read(path)
    assert list(found) == names
    assert found["Torque [N·m]"] == [2, 3, 4]


def test_measurements_of_labview_that_lost_rows_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.lvm"
    rows = LABVIEW.rstrip("\n").split("\n")
    for lost in (1, 2):
        path.write_text("\n".join(rows[:-lost]) + "\n")
        with pytest.raises(recordings.FileError, match=f"it says Samples 3, and there are {3 - lost}; copy it again"):
            recordings.read(path)
    # The first of two segments, and the second.
    second = "\nChannels" + LABVIEW.partition("Channels")[2]
    for damaged in ("\n".join(rows[:-1]) + "\n" + second, LABVIEW + "\n".join(second.split("\n")[:-2]) + "\n"):
        path.write_text(damaged)
        with pytest.raises(recordings.FileError, match="it says Samples 3, and there are 2"):
            recordings.read(path)
    # The channel with most samples has as many as there are rows; one header may serve what was appended later, or say nothing.
    expected = [1.5, 2.5, 3.5]
    for said in ("2\t3", "3\t2", "1\t1", "\t"):
        path.write_text(LABVIEW.replace("Samples\t3\t3", f"Samples\t{said}"))
        assert read(path)[0]["Angle [deg]"] == expected


@pytest.mark.parametrize("ending", [".mot", ".sto"])
def test_motions_and_storages_of_opensim(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"x{ending}"
    path.write_text(OPENSIM)
    found, _ = read(path)
    assert list(found) == ["time [s]", "knee_angle_r [deg]", "pelvis_tx [m]", "knee_moment [N m]"]
    assert found["knee_angle_r [deg]"] == [10, 11]
    # A storage of states: degrees are those of coordinates alone.
    tree = (
        "/jointset/knee/knee_r/value\t/jointset/knee/knee_r/speed\t/jointset/pelvis/pelvis_tx/value\t"
        "/forceset/soleus_r/activation\tground_torque_x\ttorque\n"
    )
    path.write_text(f"inDegrees=yes\nendheader\ntime\t{tree}0.0\t1\t2\t3\t4\t5\t6\n0.1\t1\t2\t3\t4\t5\t6\n")
    units = [name.rpartition("[")[2] if "[" in name else "" for name in read(path)[0]]
    assert units == ["s]", "deg]", "deg/s]", "m]", "", "N m]", "N m]"]
    path.write_text(OPENSIM.replace("nRows=2", "nRows=3"))
    with pytest.raises(recordings.FileError, match="it says nrows=3, and there are 2; copy it again"):
        recordings.read(path)


@pytest.mark.parametrize(("ending", "content"), [(".lvm", LABVIEW), (".mot", OPENSIM), (".sto", OPENSIM)])
def test_files_of_instruments_that_are_damaged_or_empty_are_refused(tmp_path: Path, ending: str, content: str) -> None:
    path = tmp_path / f"x{ending}"
    header = content.rindex("***End_of_Header***" if ending == ".lvm" else "endheader")
    names = content.index("\n", content.index("\n", header) + 1) + 1
    for nothing in ("", "\n\n", content[:header], content[:names]):
        path.write_text(nothing)
        with pytest.raises(recordings.FileError):
            recordings.read(path)
    # Cut within a row, a word for a number, a byte that is no text, and a row that is lost where the header counts them.
    rows = content.rstrip("\n").split("\n")
    damaged = {
        "every line must have 4 cells": content[: content.rstrip().rindex("\t")].encode(),
        "must hold numbers": "\n".join([*rows[:-1], rows[-1].replace("\t", "\tx", 1)]).encode(),
        "must not hold the character NUL": content[:names].encode() + b"\x00\xff" + content[names:].encode(),
    }
    said = "it says Samples 3, and there are 2" if ending == ".lvm" else "it says nrows=2, and there are 1"
    damaged[said] = "\n".join(rows[:-1]).encode()
    for message, left in damaged.items():
        path.write_bytes(left)
        with pytest.raises(recordings.FileError, match=message):
            recordings.read(path)


@pytest.mark.parametrize(
    ("above", "line"),
    [
        ("Unit of angle: deg\nUnit of torque: Nmm\n", 2),
        ("rig 4\n# Angle units = deg\n", 2),
        ("Einheit Moment,Nmm\n", 1),
        ("Unit under test: motor A\n", None),
        ("Unit: 5\nFiltered: none\n", None),
    ],
)
def test_units_in_words_above_the_names_are_not_lost_without_a_word(
    tmp_path: Path, above: str, line: int | None
) -> None:
    """Degrees and N mm were taken as rad and N m: the damping was 17 times too large."""
    path = tmp_path / "x.csv"
    path.write_text(above + "time,angle,torque\n0,1,2\n1,3,4\n2,5,6\n")
    found, said = read(path)
    assert list(found) == ["time", "angle", "torque"]
    assert ("units stand behind names, as in angle [deg]" in said) == (line is not None)
    assert line is None or f"line {line} is not read: '" in said
    path.write_text(above + "time [s],angle [deg],torque [Nmm]\n0,1,2\n1,3,4\n2,5,6\n")
    assert "units stand behind names" not in read(path)[1]
