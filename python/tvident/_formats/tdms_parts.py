"""Parts that a TDMS file was appended in, with the properties of each: its library keeps the last alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

Parts = Sequence[tuple[int, Mapping[str, Any]]]
"""The number of a part's first sample, and its properties."""


@contextmanager
def parts_noted() -> Iterator[dict[str, list[tuple[int, Mapping[str, Any]]]]]:
    """Note, while a file is read, before which sample of a channel, by its path, properties were written."""
    from nptdms import tdms  # noqa: PLC0415 - an extra

    noted: dict[str, list[tuple[int, Mapping[str, Any]]]] = {}
    usual: Any = tdms.TdmsReader

    class Noting(usual):  # type: ignore[misc]
        def _update_object_metadata(self, segment: Any) -> None:
            known = self.object_metadata
            self._before = {
                one.path: known[one.path].num_values for one in segment.ordered_objects if one.path in known
            }
            super()._update_object_metadata(segment)

        def _update_object_properties(self, segment_object_properties: Any) -> None:
            super()._update_object_properties(segment_object_properties)
            for path in segment_object_properties or ():
                properties = {name: _as_numpy(value) for name, value in self.object_metadata[path].properties.items()}
                noted.setdefault(path, []).append((self._before.get(path, 0), properties))

    tdms.TdmsReader = Noting
    try:
        yield noted
    finally:
        tdms.TdmsReader = usual


def parts_of(noted: Mapping[str, Parts], channel: Any) -> Parts:
    """Return the parts of a channel that hold samples: what was written before none of them belongs to the next, or to all."""
    last = {first: properties for first, properties in noted.get(channel.path, ()) if first < len(channel)}
    return sorted(last.items()) or [(0, channel.properties)]


def _as_numpy(value: Any) -> Any:
    return value.as_datetime64() if hasattr(value, "as_datetime64") else value
