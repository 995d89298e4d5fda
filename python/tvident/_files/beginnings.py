"""How files begin, which says what they are where their names say something else."""

from __future__ import annotations

import string
from pathlib import Path

_BEGINNINGS = {
    b"PK\x03\x04": ".npz",
    b"\x93NUMPY": ".npy",
    b"PAR1": ".parquet",
    b"ARROW1": ".feather",
    b"\x89HDF": ".h5",
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
    ".h5": (".hdf5", ".hdf"),
    ".mf4": (".mdf",),
    ".csv.gz": (".txt.gz", ".tsv.gz", ".dat.gz", ".asc.gz", ".xdfz", ".gz"),
    ".lvm": (".csv", ".txt", ".tsv", ".dat", ".asc"),
    ".csv": (".txt", ".tsv", ".dat", ".asc", ".lvm", ".mot", ".sto", ".uff", ".unv"),
}
"""What begins in the same way."""

_START = 512
_PRINTABLE = frozenset(string.printable.encode())


def ending_by(start: bytes) -> str:
    """Return the ending of files that begin so; nothing where none is known to."""
    return next((ending for magic, ending in _BEGINNINGS.items() if start.startswith(magic)), "")


def cure_of_name(path: Path, ending: str, said: str) -> str:
    """Return what to do about a file that begins as those with another ending; nothing where it begins as its name says, or it was said."""
    try:
        with path.open("rb") as file:
            start = file.read(_START)
    except OSError:
        return ""
    known = ending_by(start)
    if not known and start and _PRINTABLE.issuperset(start):
        known = ".csv"
    endings = (known, *_OTHER_ENDINGS.get(known, ()))
    if not known or ending.lower() in endings or known in said:
        return ""
    kind = "text does" if known == ".csv" else f"one that ends in {' or '.join(endings[:2])} does"
    return f"; it begins as {kind}: rename it to {path.stem}{known}, say"
