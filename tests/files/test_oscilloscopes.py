"""Exports of oscilloscopes: Tektronix (keys above, or beside the samples), Yokogawa, and Rigol, whose rows count samples."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import tvident
from tvident import recordings

COUNT = 200
TIME = np.round(-0.1 + np.arange(COUNT) / 1000, 6)
FIRST, SECOND = np.sin(30 * TIME), np.cos(30 * TIME)

TEKTRONIX = """Model,MSO58
Firmware Version,1.26
{label}
Waveform Type,ANALOG,ANALOG
Horizontal Units,s,
Sample Interval,0.001,
Record Length,200,
Vertical Units,V,A
,,
TIME,CH1,CH2
"""

YOKOGAWA = """"Model Name","DL850"
"BlockNumber","1"
"TraceName","CH1","CH2"
"BlockSize","200","200"
"VUnit","deg","N m"
"SampleRate","1.0E+03","1.0E+03"
"HResolution","1.0E-03","1.0E-03"
"HOffset","-0.1","-0.1"
"HUnit","s","s"

"""

RIGOL = """X,CH1,CH2,Start,Increment,
Sequence,Volt,Volt,-1.0e-01,1.0e-03
"""

SIGLENT = """Record Length,Analog:200
Sample Interval,Analog:1.000000E-03
Vertical Units,{units}
Vertical Scale,0.5
Vertical Offset,0.0
Horizontal Units,s
Horizontal Scale,0.01
Model Number,SDS1104X-E
Source,{names}
Second,{words}
"""

BESIDE = [
    ("Record Length", "200"),
    ("Sample Interval", "1e-3"),
    ("Trigger Point", "1e2"),
    ("", ""),
    ("Source", "CH1"),
    ("Vertical Units", "V"),
    ("Horizontal Units", "s"),
    ("Model Number", "TDS2014"),
]


def read(folder: Path, content: str) -> tvident.FileRecording:
    (folder / "scope.csv").write_text(content)
    return tvident.read_recording(folder / "scope.csv")


def rows(*columns: object) -> str:
    return "".join(f"{','.join(map(str, row))}\n" for row in zip(*columns, strict=True))


@pytest.mark.parametrize(
    ("label", "names"),
    [("Label,,", ["CH1", "CH2"]), ("Label,angle,torque", ["CH1.angle", "CH2.torque"]), ("Gating,0,1", ["CH1", "CH2"])],
)
def test_keys_of_tektronix_say_units_and_labels(tmp_path: Path, label: str, names: list[str]) -> None:
    """Both were said not to be read, and the units were none."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = read(tmp_path, TEKTRONIX.format(label=label) + rows(TIME, FIRST, SECOND))
    assert found.units == {"TIME": "s", **dict(zip(names, ("V", "A"), strict=True))}
    assert found.sample_rate == 1000
    np.testing.assert_array_equal(found[names[0].rpartition(".")[2]], FIRST)


def test_names_of_yokogawa_stand_behind_a_key(tmp_path: Path) -> None:
    """They were HUnit, s and s_2."""
    found = read(tmp_path, YOKOGAWA + rows([""] * COUNT, FIRST, SECOND))
    assert found.units == {"CH1": "deg", "CH2": "N m"}
    assert found.sample_rate == 1000
    np.testing.assert_array_equal(found["CH2"], SECOND)


@pytest.mark.parametrize("end", ["", ",", ",,"])
def test_rows_of_rigol_that_count_samples_have_times(tmp_path: Path, end: str) -> None:
    """The file was refused: its header has more cells than its rows."""
    content = RIGOL + rows(range(COUNT), FIRST, SECOND).replace("\n", f"{end}\n")
    with pytest.warns(recordings.FileWarning, match="X counts samples: its times are -0.1 s and 0.001 s more for each"):
        found = read(tmp_path, content)
    assert found.units == {"time": "s", "CH1": "Volt", "CH2": "Volt"}
    np.testing.assert_allclose(found["time"], TIME, atol=1e-12)
    np.testing.assert_array_equal(found["CH1"], FIRST)
    assert found.sample_rate == 1000
    with pytest.raises(recordings.FileError, match="line 2 must have the start and the increment"):
        read(tmp_path, content.replace("1.0e-03", "none"))
    with pytest.raises(recordings.FileError, match="line 9 must hold numbers; it has 'x' in column 'CH1"):
        read(tmp_path, content.replace(f"\n6,{FIRST[6]}", "\n6,x"))


@pytest.mark.parametrize("channels", [1, 2])
def test_keys_beside_the_samples_are_no_samples(tmp_path: Path, channels: int) -> None:
    """The file was refused for its words."""
    content = ""
    for row in range(COUNT):
        for place, samples in enumerate((FIRST, SECOND)[:channels]):
            key, value = BESIDE[row] if row < len(BESIDE) else ("", "")
            value = f"CH{place + 1}" if key == "Source" else value
            content += f"{',' if place else ''}{key},{value},,{TIME[row]},{samples[row]},"
        content += "\n"
    found = read(tmp_path, content)
    assert found.units == {"time": "s", "CH1": "V"} | ({"CH2": "V"} if channels > 1 else {})
    np.testing.assert_array_equal(found["time"], TIME)
    np.testing.assert_array_equal(found[f"CH{channels}"], (FIRST, SECOND)[channels - 1])
    assert found.sample_rate == 1000


@pytest.mark.parametrize("channels", [1, 2])
def test_sources_of_siglent_are_names(tmp_path: Path, channels: int) -> None:
    """Times were called Source, and units in two lines were said not to be read."""
    names, units, words = ("CH1", "CH2")[:channels], ("V", "A")[:channels], ("Volt", "Ampere")[:channels]
    header = SIGLENT.format(names=",".join(names), units=",".join(units), words=",".join(words))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = read(tmp_path, header + rows(TIME, *(FIRST, SECOND)[:channels]))
    assert found.units == {"time": "s", **dict(zip(names, units, strict=True))}
    assert found.sample_rate == 1000
    np.testing.assert_array_equal(found["CH1"], FIRST)


@pytest.mark.parametrize("header", ["in s,C1 in V,C2 in A", '"in s","C1 in V","C2 in A"'])
def test_rohde_and_schwarz_call_times_by_their_unit_alone(tmp_path: Path, header: str) -> None:
    """No channel of times was found."""
    found = read(tmp_path, f"{header}\n{rows(TIME, FIRST, SECOND)}")
    assert found.units == {"time": "s", "C1": "V", "C2": "A"}
    assert found.sample_rate == 1000
