"""What a program waits for that takes the package: rooms are entered when they are needed, and so are libraries."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

SLOW = {
    "asyncio",
    "concurrent.futures",
    "hashlib",
    "importlib.metadata",
    "inspect",
    "logging",
    "multiprocessing",
    "subprocess",
    "tempfile",
    "unittest",
    "zipfile",
}
"""Of the standard library, by half a millisecond to thirty each; NumPy takes some of them itself."""

CALL = "t = numpy.arange(2000) / 1000; tvident.identify(numpy.sin(9 * t), numpy.cos(20 * t * t), sample_rate=1000)"

LATER = {"difflib", "html", "numpy.polynomial"}
"""What mistakes, notebooks and other families of functions need."""

READERS = {"tvident._files.recorded", "tvident._files.recordings", "tvident._files.text"}
"""What reads files: arrays need none of it."""

OPTIONAL = {"click", "matplotlib", "pandas", "plotly", "polars", "pyarrow", "scipy", "tqdm", "xarray"}


@pytest.mark.parametrize(
    ("code", "forbidden"),
    [
        ("import tvident", {"numpy", "tvident._core", *SLOW, *OPTIONAL}),
        ("import numpy; before |= set(sys.modules); import tvident; tvident.identify", {*SLOW, *OPTIONAL, *READERS}),
        ("import numpy; before |= set(sys.modules); import tvident; tvident.read_recording", {*SLOW, *OPTIONAL}),
        (
            f"import numpy; before |= set(sys.modules); import tvident; {CALL}",
            {"tvident._merged", *SLOW, *OPTIONAL, *LATER, *READERS},
        ),
    ],
)
def test_nothing_is_loaded_that_is_not_needed(code: str, forbidden: set[str]) -> None:
    # What the interpreter itself takes at its start does not count.
    program = f"import sys; before = set(sys.modules); {code}; print(*set(sys.modules) - before)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert not forbidden & set(loaded)
    rooms = {name for name in loaded if name in {"tvident._report", "tvident._figures", "tvident._commands"}}
    assert not rooms


@pytest.mark.parametrize("room", ["tvident._files", "tvident._formats"])
def test_rooms_that_enter_their_files_late_know_each_name(room: str) -> None:
    """A name that nobody had assigned came from the file on netCDF."""
    module = importlib.import_module(room)
    assert all(hasattr(module, name) for name in module.__all__)
    assert set(module._READERS) <= set(module.__all__)  # noqa: SLF001 - where names come from
    with pytest.raises(AttributeError, match=f"module '{room}' has no attribute 'unknown'"):
        _ = module.unknown
