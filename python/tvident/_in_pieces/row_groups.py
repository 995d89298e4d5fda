"""Columns of Parquet files, row group by row group."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident._files import FileError, named_field, printable, units_of_table
from tvident._units import named_unit, with_unit

_BATCH = 1 << 17
"""Rows that are decoded at a time: a row group may be as long as the file."""

_KEPT = 1 << 22
"""A column of at most so many rows is decoded at once and stays, 32 MiB: windows that tell the scatter lie all over the record.

What is decoded on the way to them is as much as all that follows.
"""

_BUFFER = 1 << 16
"""Bytes that are read at a time, and at least a page: without a buffer the reader takes memory for all of a column of a row group."""


@dataclass
class ParquetRows:
    """The rows of one file, and how far each column was read."""

    path: Path
    samples: int = field(init=False)
    _file: Any = field(init=False, repr=False)
    _first: list[int] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        try:
            from pyarrow import ArrowException, parquet  # noqa: PLC0415 - an extra
        except ImportError:
            raise ImportError(
                "Parquet needs pyarrow, which is not installed; install it with: pip install 'tvident[io]'"
            ) from None
        try:
            # Read-ahead would hold whole row groups.
            self._file = parquet.ParquetFile(
                self.path, pre_buffer=False, memory_map=False, buffer_size=_BUFFER, page_checksum_verification=True
            )
        except (ArrowException, OSError) as error:
            raise self._damaged(error) from None
        groups = [self._file.metadata.row_group(place).num_rows for place in range(self._file.num_row_groups)]
        self._first = np.concatenate([[0], np.cumsum(groups, dtype=np.int64)]).tolist()
        self.samples = self._first[-1]

    def names(self) -> dict[str, str]:
        """Return columns of numbers: names with units to names in the file."""
        import pyarrow as pa  # noqa: PLC0415 - an extra

        found = {}
        units = units_of_table(self._file.schema_arrow.metadata)
        inside = {
            f"{one.name}.{part.name}"
            for one in self._file.schema_arrow
            if pa.types.is_struct(one.type)
            for part in one.type
        }
        for one in self._file.schema_arrow:
            if one.name in inside:
                raise FileError(
                    f"{printable(self.path)}: columns must have names of their own; '{printable(one.name, 40)}' is a column, and a part of "
                    "a structure; rename one of them"
                )
        for one in self._file.schema_arrow:
            if pa.types.is_integer(one.type) or pa.types.is_floating(one.type):
                name, unit = named_field(one, units)
                found[name if named_unit(name)[1] else with_unit(name, unit)] = one.name
        return found

    def begin_of_group(self, sample: int) -> int:
        """Return the first sample of the row group that a sample is in."""
        return self._first[self._group_of(sample)]

    def batches(self, name: str, first: int) -> Iterator[tuple[int, npt.NDArray[Any]]]:
        """Give the samples of a column from one on, with the number of the first of each batch."""
        group = self._group_of(first)
        place, groups = self._first[group], range(group, self._file.num_row_groups)
        # One column has nothing for several threads to do.
        batches = self._file.iter_batches(_BATCH, groups, [name], use_threads=False)
        while (batch := self._decoded(lambda: next(batches, None))) is not None:
            yield place, np.asarray(batch.column(0).to_numpy(zero_copy_only=False))
            place += batch.num_rows

    def whole(self, name: str) -> npt.NDArray[Any]:
        """Return all samples of a column, where the decoder put them."""
        groups = range(self._file.num_row_groups)
        column = self._decoded(lambda: self._file.read_row_groups(groups, [name], use_threads=False)).column(0)
        parts = [np.asarray(part.to_numpy(zero_copy_only=False)) for part in column.chunks]
        return np.concatenate(parts) if len(parts) != 1 else parts[0]

    def close(self) -> None:
        self._file.close()

    def _decoded(self, read: Callable[[], Any]) -> Any:
        """Return what is read, unless it is damaged, as checksums of pages tell where a file has them."""
        from pyarrow import ArrowException  # noqa: PLC0415 - an extra

        try:
            return read()
        except (ArrowException, OSError) as error:
            raise self._damaged(error) from None

    def _damaged(self, error: Exception) -> FileError:
        return FileError(f"{printable(self.path)}: must be whole; pyarrow says: {printable(error, 200)}; copy it again")

    def _group_of(self, sample: int) -> int:
        return int(np.searchsorted(self._first, sample, side="right")) - 1


@dataclass
class ParquetColumn:
    """One column: read on from where it was, or again from the row group that a sample is in; a short one is decoded once."""

    rows: ParquetRows
    name: str
    _going: Iterator[tuple[int, npt.NDArray[Any]]] | None = field(default=None, init=False, repr=False)
    _kept: list[tuple[int, npt.NDArray[Any]]] = field(default_factory=list, init=False, repr=False)

    def read(self, first: int, end: int) -> npt.NDArray[Any]:
        if self.rows.samples <= _KEPT:
            self._kept = self._kept or [(0, self.rows.whole(self.name))]
            return self._kept[0][1][first:end]
        reached = self._kept[-1][0] + self._kept[-1][1].size if self._kept else -1
        # Going on within a row group is never longer than from its first row.
        if (
            self._going is None
            or not self._kept
            or first < self._kept[0][0]
            or self.rows.begin_of_group(first) > reached
        ):
            self._going, self._kept, reached = self.rows.batches(self.name, first), [], -1
        while reached < end:
            batch = next(self._going, None)
            if batch is None:
                break
            reached = batch[0] + batch[1].size
            self._kept.append(batch)
            # What lies before is not asked for again: the next piece begins a little before the end of this one.
            self._kept = [one for one in self._kept if one[0] + one[1].size > first]
        parts = [values[max(first - place, 0) : end - place] for place, values in self._kept if place < end]
        return np.concatenate(parts) if len(parts) != 1 else parts[0]
