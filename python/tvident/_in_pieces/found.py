"""What is known of a long record beside its columns, which are in a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from tvident import _arguments as arguments
from tvident._status import Status


@dataclass(frozen=True)
class FileIdentification:
    """The result of :func:`tvident.identify_file`: its columns are in the file, the rest is here.

    Attributes
    ----------
    path : Path
        The file with the columns.
    samples : int
        Of the recording.
    rows : int
        Of the file: one for every `step`-th sample.
    constants : dict of str to (value, stderr)
        What is constant over the whole recording.
    record_status : Status
        Flags of the whole recording.
    flags : dict of str to int
        How many rows have each flag of :class:`tvident.Status`.
    settings : dict
        What was given and chosen: ``settings=`` of another call repeats it.
    units : dict of str to str
        Units of the columns by name.
    advice : tuple of str
        What is worth doing, of pieces and of the stretches that choices were made from.
    verdict : str
        How well parameters are known, or why not to trust them, by rows that are spread over the file. Like the advice it is found when it
        is first read, where the file has no place for it (.npy, .csv): it takes up to a second, and none of the files.
    assumed : dict of str to str
        Those of angle and torque of which neither the file nor the call said the unit, and what they were taken for.

    See Also
    --------
    identify_file : returns it.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import tvident
    >>> tvident.simulate_torsional_rig(duration=20.0).save("rig.csv")
    >>> found = tvident.identify_file("rig.csv", "parameters.csv", angle="angle", torque="torque", method="paper")
    >>> found.rows, int(found.record_status)
    (20000, 0)
    """

    path: Path
    samples: int
    rows: int
    constants: Mapping[str, tuple[float, float]]
    record_status: Status
    flags: Mapping[str, int]
    settings: Mapping[str, Any]
    units: Mapping[str, str]
    assumed: Mapping[str, str] = field(default_factory=dict)
    _judge: Callable[[], tuple[str, tuple[str, ...]]] = field(default=lambda: ("", ()), repr=False, compare=False)

    @property
    def verdict(self) -> str:
        """How well parameters are known, or why not to trust them, by rows that are spread over the file.

        Returns
        -------
        str

        See Also
        --------
        FileIdentification.summary : all in words.
        """
        return self._judged[0]

    @property
    def advice(self) -> tuple[str, ...]:
        """What is worth doing, of pieces and of stretches.

        Returns
        -------
        tuple of str

        See Also
        --------
        FileIdentification.summary : all in words.
        """
        return self._judged[1]

    @cached_property
    def _judged(self) -> tuple[str, tuple[str, ...]]:
        judged = self._judge()
        # Samples that it is judged from are not kept any longer.
        self.__dict__["_judge"] = partial(tuple, judged)
        return judged

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: what was judged, without what it is judged from."""
        return {**self.__dict__, "_judged": self._judged, "_judge": partial(tuple, self._judged)}

    def __repr__(self) -> str:
        named = [
            f"{name} {arguments.with_error(value, error)} {self.units.get(name, '')}".rstrip()
            for name, (value, error) in self.constants.items()
        ]
        found = f": {'; '.join(named)}" if named else ""
        return f"<FileIdentification of {self.samples} samples, {self.rows} rows in {self.path}{found}>"

    def summary(self) -> str:
        """Return in words what was found, first the verdict, and what is worth doing.

        Returns
        -------
        str

        See Also
        --------
        Identification.summary : of a recording in memory.
        identify_file : writes the numbers.
        """
        lines = [self.verdict] if self.verdict else []
        lines += [f"{self.samples} samples, {self.rows} rows in {self.path}"]
        lines += [
            f"{name} = {arguments.with_error(value, error)} {self.units.get(name, '')}".rstrip()
            for name, (value, error) in self.constants.items()
        ]
        if self.record_status:
            lines.append(f"the record: {self.record_status.advice}")
        lines += [f"{count} rows ({count / max(self.rows, 1):.1%}): {name}" for name, count in self.flags.items()]
        return "\n".join([*lines, *(f"- {line}" for line in self.advice)])
