"""Rows for recordings that are longer than memory or a machine: from file to file, and dask arrays in two processes."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import dask.array as da
import numpy as np
import pyarrow as pa
from distributed import Client, LocalCluster
from pyarrow import parquet

import tvident
import tvident.dask
from speed import checks, signals
from speed.rows import Duel, Row

_BLOCKS = 4
"""Of a dask array: two for every process. Each decides for itself, which takes 0.6 s in weak form."""


def _check(stiffness: signals.Array, whole: tvident.Identification, *, same: bool) -> None:
    """Check that parts of a record gave its numbers, or others by no more than chance."""
    if same and not np.array_equal(stiffness, whole.stiffness, equal_nan=True):
        raise checks.DifferentError("parts of a record give other numbers than the whole")
    away = (stiffness - whole.stiffness) / whole.stderr["stiffness"]
    if not np.sqrt(np.nanmean(away**2)) < 1:
        raise checks.DifferentError("parts of a record differ from the whole by more than chance")


def _options(angle: signals.Array, torque: signals.Array, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return what both sides are asked for: in weak form settings of an earlier result."""
    more: dict[str, Any] = {"sample_rate": signals.RATE, **options}
    if "method" not in options:
        more["settings"] = tvident.identify(angle[:60_000], torque[:60_000], sample_rate=signals.RATE).settings
    return more


def _from_file(samples: int, ending: str = ".npy", **options: Any) -> Callable[[float], Duel]:
    """Pit a call from a file of some kind to .npy against one on arrays in memory, one thread each."""

    def prepare(share: float) -> Duel:
        angle, torque = signals.recording(max(int(samples * share), 100_000))
        more = _options(angle, torque, {"workers": 1, **options})
        folder = tempfile.TemporaryDirectory(prefix="tvident-bench-")
        source, target = Path(folder.name, f"in{ending}"), Path(folder.name, "out.npy")
        if ending == ".parquet":
            parquet.write_table(pa.table({"0": angle, "1": torque}), source)
        else:
            np.save(source, np.stack([angle, torque], axis=1))

        def from_file() -> tvident.FileIdentification:
            return tvident.identify_file(source, target, angle="0", torque="1", **more)

        def in_memory() -> tvident.Identification:
            found: tvident.Identification = tvident.identify(angle, torque, **more)
            return found

        def check() -> None:
            from_file()
            _check(np.load(target)["stiffness"], in_memory(), same="method" in options)

        return Duel([from_file, in_memory], check, angle.size, close=folder.cleanup)

    return prepare


def _in_two_processes(samples: int, **options: Any) -> Callable[[float], Duel]:
    """Pit two processes of one thread each, which hold the blocks, against one call on one thread."""

    def prepare(share: float) -> Duel:
        angle, torque = signals.recording(max(int(samples * share), 800_000))
        more = _options(angle, torque, options)
        folder = tempfile.TemporaryDirectory(prefix="tvident-bench-")
        cluster = LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, local_directory=folder.name
        )
        client = Client(cluster)
        parts = [da.from_array(one, chunks=one.size // _BLOCKS).persist() for one in (angle, torque)]

        def in_processes() -> Any:
            return tvident.dask.identify(*parts, **more).stiffness.compute()

        def in_one() -> tvident.Identification:
            found: tvident.Identification = tvident.identify(angle, torque, workers=1, **more)
            return found

        def check() -> None:
            _check(in_processes(), in_one(), same="method" in options)

        def close() -> None:
            client.close()
            cluster.close()
            folder.cleanup()

        return Duel([in_processes, in_one], check, angle.size, close=close)

    return prepare


LONG = [
    Row(
        "file",
        "`identify_file`, .npy to .npy, paper's method, `step=100`, 4·10⁶ samples",
        "`identify` of arrays in memory",
        _from_file(4_000_000, method="paper", step=100),
        most=1.3,
    ),
    Row(
        "file-every-sample",
        "the same, `step=1`: 75 bytes a sample",
        "`identify` of arrays in memory",
        _from_file(2_000_000, method="paper"),
        most=1.3,
    ),
    Row(
        "file-parquet",
        "`identify_file`, Parquet to .npy, paper's method, `step=100`, 4·10⁶ samples",
        "`identify` of arrays in memory",
        _from_file(4_000_000, ".parquet", method="paper", step=100),
        most=1.3,
    ),
    Row(
        "file-parquet-long",
        "the same, 10⁷ samples, whose columns are decoded as they are needed",
        "`identify` of arrays in memory",
        _from_file(10_000_000, ".parquet", method="paper", step=100),
        most=1.3,
    ),
    Row(
        "file-weak",
        "the same in weak form with given settings, `step=100`",
        "`identify` of arrays in memory",
        _from_file(4_000_000, step=100),
        most=1.3,
    ),
    Row(
        "dask",
        "`tvident.dask.identify`, weak form with given settings, `step=100`, two processes, 4·10⁶ samples",
        "`identify`, one thread",
        _in_two_processes(4_000_000, step=100),
        most=0.8,
        threads=2,
    ),
]
"""Two processes would take half of the time of one, but for what blocks decide for themselves and dask's own work."""
