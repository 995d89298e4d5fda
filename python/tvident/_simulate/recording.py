"""A simulated recording and its truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._files import write_table

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Recording:
    """A simulated recording and its truth; all arrays have shape (n,).

    Attributes
    ----------
    time : ndarray
        Seconds.
    angle, torque : ndarray
        What was recorded, noise included: rad, N m.
    slider_position : ndarray
        Free length of the beam, m.
    inertia, damping, stiffness : ndarray
        The truth: kg m², N m s/rad, N m/rad.
    true_angle, true_velocity, true_acceleration, true_torque : ndarray
        What the rig did.
    sample_rate : float
        Samples per second.

    See Also
    --------
    simulate_torsional_rig : returns it.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=1.0, pattern="constant")
    >>> float(rig.stiffness[0].round(3)), float(rig.slider_position[0])
    (13.333, 0.45)
    """

    time: Array
    angle: Array
    torque: Array
    slider_position: Array
    inertia: Array
    damping: Array
    stiffness: Array
    true_angle: Array
    true_velocity: Array
    true_acceleration: Array
    true_torque: Array
    sample_rate: float

    def __repr__(self) -> str:
        least, greatest = self.stiffness.min(), self.stiffness.max()
        truth = f"{least:.4g}" if least == greatest else f"{least:.4g} to {greatest:.4g}"
        return f"<Recording of {self.angle.size} samples at {self.sample_rate:g} Hz: angle, torque; true stiffness {truth} N m/rad>"

    @property
    def truth(self) -> dict[str, Array]:
        """The true parameters by name, arrays of shape (n,): ``"inertia"``, ``"damping"``, ``"stiffness"``.

        See Also
        --------
        tvident.identify : estimates them.
        """
        return {name: getattr(self, name) for name in ("inertia", "damping", "stiffness")}

    def save(self, path: str | Path) -> None:
        """Write time, angle, torque, slider position and truth to a CSV or NPZ file, with units in the header.

        Parameters
        ----------
        path : str or Path
            A name that ends in ``.csv`` or ``.npz``. The file appears whole or not at all.

        Raises
        ------
        ValueError
            If the ending is another one.
        OSError
            If there is no such folder, or the file cannot be written.

        See Also
        --------
        tvident.read_recording : reads it back.
        """
        names = ("time", "angle", "torque", "slider_position", "inertia", "damping", "stiffness")
        write_table(path, {name: getattr(self, name) for name in names}, UNITS)


UNITS = {
    "time": "s",
    "angle": "rad",
    "torque": "N m",
    "slider_position": "m",
    "inertia": "kg m^2",
    "damping": "N m s/rad",
    "stiffness": "N m/rad",
}
"""Units of a recording's columns."""
