"""Text that nobody should have to read: every number of it is the one that stands there, or the file is refused in one short line."""

from __future__ import annotations

import math
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

from tvident import recordings

LONGEST, MOST_SECONDS = 2000, 2.0
"""Characters of a message; processor time of a file."""

NAN = math.nan

TOKENS: dict[str, float | None] = {
    "": NAN,
    "nan": NAN,
    "NA": NAN,
    "#N/A": NAN,
    "1.#QNAN": NAN,
    "-inf": -math.inf,
    "1e5": 1e5,
    "+.5": 0.5,
    '"2"': 2.0,
    "'2'": 2.0,
    " 7 ": 7.0,
    "007": 7.0,
    "1,5": 1.5,
    "-0,25": -0.25,
    '"1,5"': 1.5,
    "1,234": 1.234,
    "1.234,5": 1234.5,
    "1,234,567": 1234567.0,
    "1'000": 1000.0,
    "1 000": 1000.0,
    "1_000": None,
    "0x10": None,
    "1e999": None,
    "bad": None,
    "#DIV/0!": NAN,
    "1.5V": None,
    "٣": None,
    "\u22121": -1.0,
    "1\x00": None,
    "\x1b[31m1": None,
    "--": NAN,
    "1..2": None,
    "12:30": None,
    "True": None,
}
"""What may stand in a cell, and what it means; None: nothing."""

SEPARATORS = (",", ";", "\t", " ", ", ", "; ")
ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "utf-32", "latin-1")
NEWLINES = ("\n", "\r\n", "\r")


def case(seed: int) -> None:
    generator = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.csv"
        if seed % 3:
            _one_odd_cell(generator, path)
        else:
            _odd_bytes(generator, path)


def read(path: Path) -> dict[str, list[float]] | None:
    """Read a file, or return None if it is refused as it should be."""
    started = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", recordings.FileWarning)
            return {name: np.ravel(values).tolist() for name, values in recordings.read(path).items()}
    except recordings.FileError as error:
        message = str(error)
    finally:
        assert time.process_time() - started < MOST_SECONDS, "it takes too long"
    assert len(message) < LONGEST
    assert message.isprintable(), ascii(message)
    assert "; " in message, message  # the rule and the cure
    return None


def _one_odd_cell(generator: np.random.Generator, path: Path) -> None:
    """Put something odd into one cell of a table."""
    rows, columns = int(generator.integers(3, 40)), int(generator.integers(2, 5))
    table = np.round(generator.standard_normal((rows, columns)) * 100, int(generator.integers(0, 5)))
    separator, newline = (str(generator.choice(choices)) for choices in (SEPARATORS, NEWLINES))
    decimal = "," if separator.strip() != "," and generator.random() < 0.3 else "."
    token = list(TOKENS)[int(generator.integers(len(TOKENS)))]
    row, column = int(generator.integers(rows)), int(generator.integers(columns))
    cells = [[repr(value).replace(".", decimal) for value in line] for line in table.tolist()]
    cells[row][column] = token
    lines = [separator.join(line) for line in cells]
    if generator.random() < 0.7:
        lines.insert(0, separator.join("abcde"[:columns]))
    encoding = str(generator.choice(ENCODINGS))
    path.write_bytes((newline.join(lines) + newline).encode(encoding, errors="replace"))

    found = read(path)
    if found is None:
        return
    meant = TOKENS[token]
    if meant == TOKENS["1,234"] and decimal == "." and not (np.abs(table) >= 1000).any():
        meant = 1234.0  # the points of the others are decimal signs, so a comma separates thousands
    if token in {"٣", "\u22121"} and encoding == "latin-1":
        # Written as question marks, of which one alone says that a value is missing.
        meant = {"٣": math.nan}.get(token)
    assert meant is not None, f"{token!r} was read: {list(found.values())[column]}"
    expected = table.copy()
    expected[row, column] = meant
    context = f"{separator!r} {decimal!r} {token!r} at {row}, {column}"
    np.testing.assert_array_equal(np.array(list(found.values())).T, expected, context)


def _odd_bytes(generator: np.random.Generator, path: Path) -> None:
    """Damage a table, or write what is none."""
    table = np.round(generator.standard_normal((int(generator.integers(1, 3000)), 3)), 6).tolist()
    content = bytearray(("a,b,c\n" + "".join(f"{a!r},{b!r},{c!r}\n" for a, b, c in table)).encode())
    kind = int(generator.integers(5))
    if kind == 0:
        for place in generator.integers(len(content), size=int(generator.integers(1, 20))):
            content[place] = int(generator.integers(256))
    elif kind == 1:
        content = bytearray(generator.bytes(int(generator.integers(5000))))
    elif kind == 2:
        content = content[: int(generator.integers(len(content)))] * int(generator.integers(1, 4))
    elif kind == 3:
        alphabet = np.array(
            [b"1", b"2", b".", b",", b";", b"\t", b" ", b"\n", b"\r", b'"', b"#", b"-", b"e", b"a", b"\0"]
        )
        content = bytearray(b"".join(alphabet[generator.integers(len(alphabet), size=int(generator.integers(4000)))]))
    else:
        cell = str(generator.choice(["1", '"', ",", "#", "a", " ", "\n", "1,", "1,2;", '"1"', "nan,"]))
        content = bytearray((cell * int(generator.integers(1, 2_000_000 // len(cell)))).encode())
    path.write_bytes(content)
    read(path)
