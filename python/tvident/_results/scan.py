"""Estimates by the width of the test function or of windows, which tell whether equations of every scale agree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from tvident._equation import UNITS
from tvident._files import aligned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tvident import _core

Array = npt.NDArray[np.float64]

_LEAST_PLATEAU = 2
"""Widths that agree span at least this factor, or they agree by chance."""


@dataclass(frozen=True)
class Scan:
    r"""What :meth:`tvident.Identification.scan` returns: the same unknowns from test functions of ``w`` widths, from narrow to wide.

    A wide test function asks the equation of motion to hold for slow motion only, a narrow one for fast motion as well. Where the
    recording obeys the equation, all widths agree; the range that does is the plateau. In strong form the windows of the polynomials take
    the place of test functions.

    Parameters
    ----------
    window_length : ndarray of int64, shape (w,)
        Samples of each test function, or of the windows.
    band : ndarray, shape (w,)
        Where half the power of the motion passes it, in Hz; of windows with the polynomial order that is usual in them.
    estimates : dict of str to ndarray, shape (w,)
        Unknowns that are constant over the record; means of windowed ones where none is.
    stderr : dict of str to ndarray, shape (w,)
        Their standard errors, from how blocks of the record scatter: they assume nothing of the noise.
    plateau : (int, int) or None
        Samples of the narrowest and of the widest that agree; None where too few widths could be compared.
    corrected : bool
        Whether estimates are corrected for white noise of the angle.
    moved : bool
        Whether the test function was moved because of the scan.
    units : mapping of str to str, optional
        Units of the unknowns by name.
    used : int, optional
        Samples of the windows that a result of the strong form used, which nothing moves.

    See Also
    --------
    Identification.scan : makes one.
    figures.plot_scan : draws it.

    References
    ----------
    O. V. Lepski: On a problem of adaptive estimation in Gaussian white noise, Theory of Probability and its Applications 35 (1990): scales
    are compared within their errors. P. J. Huber, The behavior of maximum likelihood estimates under nonstandard conditions (1967):
    errors from blocks.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=6.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate)
    >>> scan = result.scan()
    >>> sorted(scan.estimates)
    ['damping', 'inertia', 'offset']
    >>> first, last = scan.plateau
    >>> first <= result.settings["window_length"] <= last
    True
    """

    window_length: npt.NDArray[np.int64]
    band: Array
    estimates: dict[str, Array]
    stderr: dict[str, Array]
    plateau: tuple[int, int] | None
    corrected: bool
    moved: bool
    units: Mapping[str, str] = field(default_factory=lambda: UNITS)
    used: int | None = None

    def __repr__(self) -> str:
        if not self.window_length.size:
            return "<Scan of no widths>"
        agree = (
            "no plateau" if self.plateau is None else f"the same from {self.plateau[0]} to {self.plateau[1]} samples"
        )
        widths = f"{self.window_length.size} widths from {self.window_length[0]} to {self.window_length[-1]} samples"
        return f"<Scan of {', '.join(self.estimates)} by {widths}: {agree}>"

    def summary(self) -> str:
        """Return a table with a row for every width; a star marks the plateau.

        In strong form a sentence says whether the window that was used lies on it.

        Returns
        -------
        str

        See Also
        --------
        plot : the same as a picture.
        Identification.scan : returns it.
        """
        if not self.window_length.size:
            return "there is nothing to compare: the record is too short, or no other width determines the constants"
        units = [f"{name} ({self.units[name]})" if self.units.get(name) else name for name in self.estimates]
        cells = [("", "samples", "band (Hz)", *units)]
        for place, length in enumerate(self.window_length):
            inside = self.plateau is not None and self.plateau[0] <= length <= self.plateau[1]
            values = [f"{value[place]:.4g} ± {self.stderr[name][place]:.1g}" for name, value in self.estimates.items()]
            cells.append(("*" if inside else "", str(length), f"{self.band[place]:.3g}", *values))
        return "\n".join([*aligned(cells), *self._of_used()])

    def _of_used(self) -> Iterator[str]:
        """Say whether the windows that were given are among those that agree."""
        if self.used is None:
            return
        first, last = self.plateau or (0, 0)
        if last < _LEAST_PLATEAU * first or not first:
            yield "no windows agree whose lengths differ by a factor of 2: do not trust numbers that slow and fast motion disagree on"
        elif first <= self.used <= last:
            yield f"windows of {first} to {last} samples agree, and those of {self.used} samples that were used are among them"
        else:
            yield f"windows of {first} to {last} samples agree, but not the {self.used} samples that were used: choose a length in between"

    def plot(self, *, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """Draw every unknown over the band, with bars of two standard errors and the plateau shaded.

        Parameters
        ----------
        ax : Axes or sequence of Axes, optional
            Where to draw; one Axes is divided into a panel for each unknown.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ImportError
            If matplotlib is missing: install ``tvident[plot]``.
        ValueError
            If the record was too short to compare widths.

        See Also
        --------
        summary : the same as a table.
        Identification.scan : returns it.
        """
        from tvident import _figures  # noqa: PLC0415 - matplotlib is optional

        return _figures.plot_scan(self, ax)


def scan_of(found: _core.Scan, names: Sequence[str]) -> Scan:
    """Return estimates by the width of the test function, by name."""
    shape = (len(found.window_length), len(found.unknowns))
    values, errors = np.array(found.values).reshape(shape), np.array(found.stderr).reshape(shape)
    called = [names[place] for place in found.unknowns]
    length = np.array(found.window_length, dtype=np.int64)
    plateau = None if found.plateau is None else (int(length[found.plateau[0]]), int(length[found.plateau[1]]))
    return Scan(
        window_length=length,
        band=np.array(found.band),
        estimates={name: values[:, place] for place, name in enumerate(called)},
        stderr={name: errors[:, place] for place, name in enumerate(called)},
        plateau=plateau,
        corrected=found.corrected,
        moved=found.moved,
    )
