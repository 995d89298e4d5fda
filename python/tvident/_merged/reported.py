"""What a result of trials or masses shows of itself: words, tables, files, figures, and the torques that it explains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files import check_beside, keeps_result, write_settings, write_table
from tvident._merged.drawn import drawn
from tvident._merged.held_back import HeldBackTorque, held_back
from tvident._merged.merging import Identifiable, Merging
from tvident._merged.predicted import predicted
from tvident._merged.simulated import MergedSimulated
from tvident._merged.stored import store
from tvident._merged.verdict import distrusted, explained, verdict_of
from tvident._merged.words import summary_of, words_of
from tvident._results import Measured, Scan, Telling, Words, every_sample, known_name, number_of
from tvident._status import DOUBTFUL, DOUBTFUL_RECORD, Status
from tvident._tables import Table, Tabular

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array: TypeAlias = npt.NDArray[np.float64]

MergedPicture: TypeAlias = Literal["parameters", "torque", "scan"]


class Reported(MergedSimulated, Telling, Tabular):
    """The part of a result that is shown.

    Attributes
    ----------
    time, phase, elements, stderr, residual_std, status, record_status, scans, settings, units :
        Those of the result.
    """

    time: Array
    phase: Array | None
    elements: dict[str, Array]
    stderr: dict[str, Array]
    residual_std: Array
    status: npt.NDArray[np.uint16]
    record_status: Status
    scans: tuple[Scan, ...]
    settings: dict[str, Any]
    units: Mapping[str, str]
    kinds: dict[str, str]
    identifiable: dict[str, Identifiable]
    inertia: Array
    damping: Array
    stiffness: Array
    _merging: Merging
    _scatter: dict[str, float]

    @property
    def trusted(self) -> npt.NDArray[np.bool_]:
        """Where values can be trusted, shape (n,): all that can be known are numbers, and neither a flag nor the verdict forbids it.

        See Also
        --------
        status, record_status : the flags that it combines.
        summary : begins with the verdict.
        identifiable : what can be known at all.

        References
        ----------
        docs/statuses.md.
        """
        return self._unflagged & (self._distrusted is None)

    @property
    def _unflagged(self) -> npt.NDArray[np.bool_]:
        """Where all that can be known are numbers, and flags do not forbid to trust them."""
        good = (self.status & DOUBTFUL == 0) & (int(self.record_status) & int(DOUBTFUL_RECORD) == 0)
        found = [name for name, kind in self.kinds.items() if kind not in {"known", "unknown"}]
        good &= bool(found)
        for name, values in self.elements.items():
            if self.identifiable[name]:
                good &= np.isfinite(values)
        return np.asarray(good)

    @cached_property
    def _distrusted(self) -> str | None:
        """Why no sample is to be trusted; a part of a record is what the whole is."""
        return distrusted(self, self._merging)

    def scan(self, part: int = 0) -> Scan:
        """Return estimates by the width of the test function, which tell whether equations of every scale agree.

        Parameters
        ----------
        part : int, optional
            Which of the groups of equations that share no unknown with others; mostly there is one.

        Returns
        -------
        Scan
            Estimates, errors and the band in Hz of every width; ``summary()`` and ``plot()`` show them.

        Raises
        ------
        ValueError
            If widths were not compared: something may change with time, or the width was given.
        IndexError
            If there is no such part.

        See Also
        --------
        Scan : what it returns.
        Identification.scan : of one record.

        References
        ----------
        The rule is in docs/automatic.md, "Equations of every scale".
        """
        if not self.scans:
            raise ValueError(
                "widths of the test function are compared where all unknowns are 'constant' and the width is not given; got kinds that "
                "may change with time, or a window_length; ask for constants and leave it out"
            )
        if not -len(self.scans) <= part < len(self.scans):
            raise IndexError(f"part must be below {len(self.scans)}, the number of groups of equations; got {part}")
        return replace(self.scans[part], units=self.units)

    def predicted_torque(self, trial: int = 0) -> tuple[Array, Array, Array]:
        """Return the recorded torques, and those that the identified equations predict from the recorded motion.

        Both are averages over the test function, in which the noise of derivatives is small. Costs about 0.1 µs a sample and channel.

        Parameters
        ----------
        trial : int, optional
            Which of the trials.

        Returns
        -------
        time : ndarray, shape (m,)
            Seconds, for every sample of the trial.
        recorded, predicted : ndarray, shape (m,) for trials, (masses, m) for masses
            N m. NaN near the ends, near what is missing, and for masses of which nothing can be known.

        Raises
        ------
        ValueError
            If the result was loaded from a file, or nothing of it can be known.
        IndexError
            If there is no such trial.

        See Also
        --------
        plot : draws both, with ``"torque"``.
        held_back : how much is explained.

        References
        ----------
        Equation (A) of docs/automatic.md, with matrices: docs/together.md.
        """
        merging = self._merging
        if not merging.parts:
            raise ValueError(
                "the record must be there; got a result without one, or of which nothing can be known; identify again"
            )
        trial = arguments.whole_number("trial", trial)
        if not -merging.trials <= trial < merging.trials:
            raise IndexError(f"trial must be below {merging.trials}, the number of trials; got {trial}; count from 0")
        values = {name: every_sample(one, merging.samples, merging.step) for name, one in self.elements.items()}
        both: Array = np.zeros((2, 0, 0))
        for part in merging.parts:
            form = (part.found.window_length, part.found.exponent)
            found = predicted(part.equations, trial, values, form, merging.sampling.period)
            if not both.size:
                both = np.full((2, max(merging.masses, 1), found[0].shape[1]), np.nan)
            both[:, list(part.equations.numbers)] = found
        recorded, expected = both if merging.masses else both[:, 0]
        return merging.sampling.times(both.shape[2]), recorded, expected

    @cached_property
    def _share(self) -> float | None:
        """The least share of a torque's variance that is explained; it is kept where the recording is not."""
        return explained(self, self._merging)

    @cached_property
    def _held_back(self) -> HeldBackTorque:
        return held_back(self._merging)

    def value(self, name: str) -> Measured:
        """Return one number for an element, with its error, whatever its kind, as :meth:`Identification.value` does.

        Parameters
        ----------
        name : str
            One of ``elements``.

        Returns
        -------
        Measured
            ``value`` and ``stderr`` first; ``str()`` of it has even digits and the unit.

        Raises
        ------
        KeyError
            If there is no such element.

        See Also
        --------
        elements, stderr : all numbers, and all errors.
        identifiable : whether it can be known.

        References
        ----------
        Errors are explained in docs/automatic.md, "Errors".
        """
        values = self.elements[known_name(name, self.elements)]
        return number_of(values, self.stderr[name], self.kinds[name], self.units.get(name, ""), self._unflagged)

    def held_back(self) -> HeldBackTorque:
        """Return how much of the torques the equations explain in parts that they are not fitted to: the last tenth of every tenth.

        They are identified once more without these samples, with the settings of this result, when it is asked for first, by
        :meth:`summary` too. Elements that change are interpolated between the other parts.

        Returns
        -------
        HeldBackTorque
            ``predicted``: percent of the variance of every torque, as averages over the test function; ``simulated``: that of every angle,
            simulated from the state before each part, of equations that are linear or of one mass; ``words()`` says it.

        See Also
        --------
        vaf : of any recording.
        summary : begins with it.

        References
        ----------
        M. Stone: Cross-validatory choice and assessment of statistical predictions, Journal of the Royal Statistical Society B 36 (1974).
        """
        return self._held_back

    @cached_property
    def _told(self) -> Words:
        return words_of(self, self._merging, self._scatter)

    def summary(self) -> str:
        """Return the verdict, a table of the elements, and in words what was chosen and what to do.

        Returns
        -------
        str

        See Also
        --------
        reasons, advice : its sentences, one by one.
        report : the same as a page, with plots.
        """
        return summary_of(self, verdict_of(self, self._merging))

    def plot(
        self,
        what: MergedPicture = "parameters",
        *,
        mass: int = 0,
        trial: int = 0,
        ax: Axes | Sequence[Axes] | None = None,
    ) -> Figure:
        """Draw the result, on axes of your own or in a new figure.

        Parameters
        ----------
        what : {"parameters", "torque", "scan"}, optional
            ``"parameters"``: the elements that change, with bands of two standard errors, and in a line what is constant. ``"torque"``: the
            recorded torque of a mass in a trial, the predicted one and what is left. ``"scan"``: estimates by the width of the test
            function.
        mass, trial : int, optional
            Of which the torque is drawn.
        ax : Axes or sequence of Axes, optional
            Where to draw; one Axes is divided where a picture has several panels.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ImportError
            If matplotlib is missing: install ``tvident[plot]``.
        ValueError
            If there is no such picture, or the record is not there.

        See Also
        --------
        tvident.figures : the functions that draw.
        report : a page to zoom in.
        """
        from tvident import _figures  # noqa: PLC0415 - matplotlib is optional

        arguments.one_of("what", what, get_args(MergedPicture))
        if what == "scan":
            return self.scan().plot(ax=ax)
        if what == "parameters":
            return _figures.plot_identification(drawn(self), ax=ax)
        time, *both = self.predicted_torque(trial)
        recorded, expected = (np.atleast_2d(one)[mass] for one in both)
        return _figures.plot_torque(drawn(self, (time, recorded, expected)), ax=ax)

    def report(
        self, path: str | Path, *, channels: Mapping[str, npt.ArrayLike] | None = None, title: str | None = None
    ) -> None:
        """Write a report: one page that opens in a browser without a network, as :meth:`Identification.report` does.

        Every element has its number or its plot; channels and torques are those of the first four trials. Where trials were aligned on
        a phase, channels are drawn along the phase of the median trial.

        Parameters
        ----------
        path : str or Path
            A name that ends in ``.html``. The file appears whole or not at all.
        channels : mapping of str to array_like, shape (n,), optional
            Other channels; a unit may follow the name in brackets.
        title : str, optional
            By default the name of the file.

        Raises
        ------
        ImportError
            If plotly is missing: install ``tvident[report]``.
        ValueError
            If the ending is another one, or a channel does not have a value for every sample.
        OSError
            If there is no such folder, or the file cannot be written.

        See Also
        --------
        summary : its words.
        plot : its pictures, one by one.
        """
        from tvident._merged.paged import report  # noqa: PLC0415 - pages are rarely asked for, and take long to load

        report(self, self._merging, path, channels=channels, title=title)

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return everything that has one value a sample, by name: elements, their standard errors, residuals and flags.

        Returns
        -------
        dict of str to ndarray, shape (n,)

        See Also
        --------
        save : writes them.
        to_pandas, to_polars, to_xarray : the same in tables.
        """
        found: dict[str, npt.NDArray[Any]] = {"time": self.time}
        if self.phase is not None:
            found["phase"] = self.phase
        for name, values in self.elements.items():
            found[name], found[f"{name}_stderr"] = values, self.stderr[name]
        found["residual_std"], found["status"] = self.residual_std, self.status
        found["record_status"] = np.full(self.status.shape, int(self.record_status), np.uint16)
        found["trusted"] = self.trusted.astype(np.uint8)
        return found

    def _table(self) -> Table:
        columns = self.columns()
        return Table(columns.pop("time"), columns, self.units, self.settings)

    def save(self, path: str | Path) -> None:
        """Write every column to a file, with units in the header; all that :func:`tvident.load` needs too, if the file can hold it.

        Parameters
        ----------
        path : str or Path
            A name that ends in ``.npz`` or ``.parquet``, from which the result comes back as it is, without the recording; or in ``.csv``
            and others, for columns alone, with the settings beside. The file appears whole or not at all.

        Raises
        ------
        ValueError
            If the ending is another one.
        OSError
            If there is no such folder, or the file cannot be written.

        See Also
        --------
        tvident.load : reads it back.
        Identification.save : of one record.
        """
        place = arguments.path_of("path", path)
        if keeps_result(place):
            store(place, self)
        else:
            check_beside(place)
            write_table(place, self.columns(), self.units)
            write_settings(place, self.settings)
