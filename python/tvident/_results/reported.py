"""The report of a result: its channels, and those of the user's own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident import _report
from tvident._files import listed
from tvident._results.recorded import Recorded
from tvident._units import named_unit, unit_said

Array: TypeAlias = npt.NDArray[np.float64]


class Predicting(_report.Reported, Protocol):
    """A result that predicts the torque."""

    def predicted_torque(self) -> tuple[Array, Array, Array]:
        """Return time, the recorded torque and the predicted one."""


def report(
    result: Predicting,
    path: str | Path,
    *,
    recorded: Recorded | None,
    channels: Mapping[str, npt.ArrayLike] | None,
    title: str | None,
) -> None:
    """Write the report of a result with the channels that are there."""
    if Path(path).suffix.lower() not in {".html", ".htm"}:
        raise ValueError(f"a report is a page: its name must end in .html; got {arguments.shown(str(path))}; rename it")
    rate = float(result.settings["sample_rate"])
    start = float(result.time[0]) if result.time.size else 0.0
    shown: list[_report.Series] = []
    compared: list[Array] = []

    def show(name: str, unit: str, values: npt.ArrayLike) -> None:
        numbers = arguments.real_array("channels", values)
        shown.append(_report.Series(name, unit, numbers, start, 1 / rate, is_recorded=True))

    if recorded is not None and recorded.is_unchanged and result.inertia.ndim == 1:
        show("Position" if result.units["angle"] == "m" else "Angle", result.units["angle"], recorded.angles)
        show(
            "Force" if result.units["torque"] == "N" else "Torque",
            result.units["torque"].replace(" ", "·"),
            recorded.torques,
        )
        _, *compared = result.predicted_torque()
    step = int(result.settings["step"])
    samples = shown[0].values.size if shown else None
    for name, values in (channels or {}).items():
        numbers = arguments.real_array("channels", values)
        count = (result.time.size - 1) * step + 1
        fits = numbers.shape == (samples,) if samples is not None else count <= numbers.size < count + step
        if numbers.ndim != 1 or not fits:
            raise ValueError(
                f"channels must have one value for every sample of the recording; got {arguments.shown(name)} with shape "
                f"{numbers.shape}; leave out {listed([name])}, or cut it"
            )
        bare, unit = named_unit(name)
        show(bare, unit or unit_said(values), numbers)
    _report.write_report(path, result, shown, compared, title or Path(path).stem)
