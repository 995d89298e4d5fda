"""What older programs and spreadsheets write: inch signs, alphabets without a mark, Fortran's exponents, errors in cells, compression."""

from __future__ import annotations

from pathlib import Path

import pytest

from tvident import recordings


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
