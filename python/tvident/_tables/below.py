"""Tables of several results, below each other."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from tvident._tables.table import Tabular, package

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl


class TabularList:
    """A sequence of what can be given as a table."""

    def __iter__(self) -> Iterator[Tabular]:
        raise NotImplementedError

    def to_pandas(self) -> pd.DataFrame:
        """Return one pandas table of all records, below each other, with an index of record and time.

        Returns
        -------
        pandas.DataFrame
            As :meth:`Identification.to_pandas` gives it for a batch. What only some records have is NaN in the others.

        Raises
        ------
        ImportError
            If pandas is missing: install ``tvident[tables]``.

        See Also
        --------
        Identification.to_pandas : the table of one record.
        """
        pandas, frames = package("pandas"), [record.to_pandas() for record in self]
        units: dict[str, str] = {}
        for frame in frames:
            units |= frame.attrs["units"]
        together: pd.DataFrame = (
            pandas.concat(dict(enumerate(frames)), names=["record", frames[0].index.name or "sample"])
            if frames
            else pandas.DataFrame()
        )
        settings = [json.loads(frame.attrs["settings"]) for frame in frames]
        together.attrs = {"units": units, "settings": json.dumps(settings)}
        return together

    def to_polars(self) -> pl.DataFrame:
        """Return one polars table of all records, below each other: ``record`` first, then ``time``.

        Returns
        -------
        polars.DataFrame
            What only some records have is null in the others.

        Raises
        ------
        ImportError
            If polars is missing: install ``tvident[tables]``.

        See Also
        --------
        Identification.to_polars : the table of one record.
        """
        polars, frames = package("polars"), list[Any]()
        for place, record in enumerate(self):
            frame = record.to_polars()
            frames.append(frame.insert_column(0, polars.Series("record", [place] * len(frame), dtype=polars.Int64)))
        together: pl.DataFrame = polars.concat(frames, how="diagonal") if frames else polars.DataFrame()
        return together
