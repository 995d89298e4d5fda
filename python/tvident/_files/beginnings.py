"""How files begin, which says what they are where their names say something else."""

from __future__ import annotations

import codecs
import re
import string
from pathlib import Path

_BEGINNINGS = {
    b"PK\x03\x04": ".npz",
    b"\x93NUMPY": ".npy",
    b"PAR1": ".parquet",
    b"ARROW1": ".feather",
    b"\x89HDF": ".h5",
    b"CDF\x01": ".nc",
    b"CDF\x02": ".nc",
    b"MATLAB": ".mat",
    b"TDSm": ".tdms",
    b"MDF     ": ".mf4",
    b"XDF:": ".xdf",
    b"\x89MCAP": ".mcap",
    b"#ROSBAG": ".bag",
    b"LabVIEW": ".lvm",
    b"\x1f\x8b": ".csv.gz",
}
"""How files begin."""

_OTHER_ENDINGS = {
    ".npz": (".xlsx", ".xlsm"),
    ".feather": (".arrow",),
    ".h5": (".hdf5", ".hdf", ".nc", ".nc4", ".cdf"),
    ".nc": (".nc4", ".cdf"),
    ".mf4": (".mdf",),
    ".csv.gz": (".txt.gz", ".tsv.gz", ".dat.gz", ".asc.gz", ".log.gz", ".xdfz", ".gz"),
    ".lvm": (".csv", ".txt", ".tsv", ".dat", ".asc", ".log"),
    ".jsonl": (".ndjson", ".json"),
    ".csv": (".txt", ".tsv", ".dat", ".asc", ".log", ".lvm", ".mot", ".sto", ".uff", ".unv"),
}
"""What begins in the same way."""

_OF_JSON = re.compile(rb"\s*(?:\{\s*[\"}]|\[\s*[\[{\]\"0-9-])")
"""How objects and lists begin."""

_OF_OBJECT = re.compile(rb"\s*\[?\s*\{\s*\"[^\"\n]{0,200}\"\s*:")
"""How an object with members begins, or a list of them."""

_START = 512
_PRINTABLE = frozenset(string.printable.encode())
_OF_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_LETTERS = 0.2
"""Of the bytes of a text, at most, that are no ASCII where it is not UTF-8: umlauts, signs of degrees."""


def ending_by(start: bytes) -> str:
    """Return the ending of files that begin so; nothing where none is known to."""
    found = next((ending for magic, ending in _BEGINNINGS.items() if start.startswith(magic)), "")
    return found or (".jsonl" if _OF_OBJECT.match(start) else "")


def _is_text(start: bytes) -> bool:
    """Return whether a file begins as text of any alphabet does."""
    if start.startswith(_OF_UTF_16):
        return True
    others = [byte for byte in start if byte not in _PRINTABLE]
    if not start or any(byte < 0x80 for byte in others):  # noqa: PLR2004 - the first that is no ASCII
        return False
    try:
        # The last letter may be cut.
        codecs.getincrementaldecoder("utf-8")().decode(start)
    except UnicodeDecodeError:
        return len(others) <= _LETTERS * len(start)
    return True


def cure_of_name(path: Path, ending: str, said: str) -> str:
    """Return what to do about a file that begins as those with another ending; nothing where it begins as its name says, or it was said."""
    try:
        with path.open("rb") as file:
            start = file.read(_START)
    except OSError:
        return ""
    known = ending_by(start)
    if not known and _is_text(start):
        known = ".jsonl" if _OF_JSON.match(start) else ".csv"
    endings = (known, *_OTHER_ENDINGS.get(known, ()))
    if not known or ending.lower() in endings or known in said:
        return ""
    kind = "text does" if known == ".csv" else f"one that ends in {' or '.join(endings[:2])} does"
    return f"; it begins as {kind}: rename it to {path.stem}{known}, say"
