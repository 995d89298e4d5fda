"""The result of an identification."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files import RESULT_ENDINGS, write_settings, write_table
from tvident._results.curve import ExpandedParameter
from tvident._results.estimates import Estimates
from tvident._results.held_back import HeldBack
from tvident._results.oscillator import Oscillator
from tvident._results.parts import chosen, of_records, of_samples, samples_between, settings_of
from tvident._results.recorded import Recorded
from tvident._results.scan import Scan
from tvident._results.short import as_html, short
from tvident._results.simulated import Simulated
from tvident._results.standard_errors import StandardErrors
from tvident._results.stored import plain_words, store
from tvident._results.summary import summary_of
from tvident._results.told import Telling
from tvident._results.valued import Valued
from tvident._results.words import Words, of_batch
from tvident._status import DOUBTFUL, DOUBTFUL_RECORD
from tvident._tables import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Picture: TypeAlias = Literal["parameters", "torque", "status", "poles", "scan", "over"]

Array: TypeAlias = npt.NDArray[np.float64]


@np.errstate(all="ignore")
def _product(factor: Array, error: Array) -> Array:
    """Return standard errors times their variance-inflation factor."""
    return np.asarray(factor * error)


class Identification(Simulated, Telling, Valued):
    r"""What :func:`tvident.identify` found. ``n`` is the number of samples, or of every ``step``-th of them.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Seconds.
    inertia, damping, stiffness : ndarray of float64, shape (\*, n)
        Identified, constant or known values. NaN only where the status has INVALID.
    terms : dict of str to ndarray, shape (\*, n)
        Factors of further terms.
    constants : dict of str to (value, stderr)
        Parameters that are constant over the record, and inner parameters of terms, as ``"stribeck.velocity"`` or ``"reflex.delay"``;
        ``"angle_zero"``, in rad, where the spring is relaxed at another angle than zero.
    stderr : mapping of str to ndarray, shape (\*, n)
        Standard errors of all of these, ``"natural_frequency"`` and ``"damping_ratio"`` (by the delta method, with all covariances). In
        weak form they contain the correlation of overlapping equations and changes that windows cannot follow. In strong form they are
        those of ordinary least squares times one factor per record and parameter, from the scatter between windows that share no
        equation, or for constants from the covariance of the residuals. They do not contain a bias that all windows share: angle noise
        of 3 % and more biases inertia and stiffness downwards, and constants estimated from derivatives may have a bias of two or three
        standard errors.
    condition : ndarray, shape (\*, n)
        Condition number of the equations, their columns scaled to the same norm: large if parameters are nearly collinear.
    residual_std : ndarray, shape (\*, n)
        Standard deviation of the residuals of the torque.
    order : ndarray of uint8, shape (\*, n)
        Order of the polynomial around each sample; 0 in weak form, which has none.
    status : ndarray of uint16, shape (\*, n)
        Flags of :class:`tvident.Status` that hold at this sample: ``status == 0`` selects good samples.
    record_status : Status, or ndarray of uint16 in the shape of the batch
        Flags that hold for the whole record.
    jumps : tuple of float
        Times in seconds at which parameters jump (``reasons`` says which), found if windows of all lengths are averaged; one such
        tuple per record in a batch.
    expansions : dict of str to ExpandedParameter
        Parameters that were asked for as an :class:`Expansion`: the curve over what each is a function of, its error, and the sizes that
        were tried. Empty otherwise, and of a result that was loaded from a file.
    units : mapping of str to str
        Units of the parameters and of the columns by name: those of a rotary axis, or of a linear one (m, N).
    settings : dict
        Settings that were given and chosen, as plain JSON. ``identify(…, settings=result.settings)`` repeats it.

    See Also
    --------
    identify : returns it.
    Status : what the flags mean.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    W. K. Newey, K. D. West: A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix,
    Econometrica 55 (1987): standard errors from the residuals.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate, inertia=0.0123)
    >>> bool(abs(result.stiffness[1500] / rig.stiffness[1500] - 1) < 0.02)
    True
    >>> sorted(result.stderr)
    ['damping', 'damping_ratio', 'inertia', 'natural_frequency', 'offset', 'stiffness']
    """

    def __init__(
        self,
        found: Estimates,
        *,
        time: Array,
        terms: Sequence[str],
        jumps: tuple[Any, ...],
        words: Words | Callable[[], Words],
        settings: dict[str, Any],
        recorded: Recorded | None = None,
    ) -> None:
        super().__init__(recorded)
        self.expansions: dict[str, ExpandedParameter] = dict(found.expansions)
        self.units = found.units
        self.time = time
        self.inertia = found.values["inertia"]
        self.damping = found.values["damping"]
        self.stiffness = found.values["stiffness"]
        self.terms = {name: found.values[name] for name in terms}
        self.constants = dict(found.constants)
        self.condition = found.condition
        self.residual_std = found.residual_std
        self.order = found.order
        self.status = found.status
        self.record_status = found.record_status
        self.jumps = jumps
        self._words = words
        self.settings = settings
        self._found = found
        known = {name: error for name, error in found.errors.items() if name not in found.factors}
        computed: dict[str, Callable[[], Array]] = {
            name: partial(_product, factor, found.errors[name]) for name, factor in found.factors.items()
        }
        enlarged = StandardErrors(known, computed)
        self._oscillator = Oscillator(found, enlarged)
        derived = {
            "natural_frequency": self._oscillator.natural_frequency_error,
            "damping_ratio": self._oscillator.damping_ratio_error,
        }
        self.stderr = StandardErrors(known, computed | derived)

    @property
    def trusted(self) -> npt.NDArray[np.bool_]:
        r"""Where values can be trusted, shape (\*, n): the mask for plotting and averaging.

        True where every parameter is a finite number, where the sample's status has none of INVALID, RANK_DEFICIENT, ILL_CONDITIONED and
        NOISE_MODEL, and where that of the record has none of RANK_DEFICIENT, ILL_CONDITIONED and SCALES_DISAGREE.
        """
        records = np.asarray(self.record_status)[..., np.newaxis]
        trusted = (self.status & DOUBTFUL == 0) & (records & DOUBTFUL_RECORD == 0)
        for values in (self.inertia, self.damping, self.stiffness, *self.terms.values()):
            trusted &= np.isfinite(values)
        return np.asarray(trusted)

    @property
    def natural_frequency(self) -> Array:
        r"""Undamped natural frequency √(K/I)/2π in Hz, shape (\*, n); NaN where K/I is negative."""
        return self._oscillator.natural_frequency

    @property
    def damping_ratio(self) -> Array:
        r"""Damping ratio C/(2√(KI)), shape (\*, n), without unit; NaN where KI is negative."""
        return self._oscillator.damping_ratio

    def __getstate__(self) -> dict[str, Any]:
        # What finds the words knows the record.
        return super().__getstate__() | {"_words": self._told}

    # What to say is found when it is asked for: a short record is identified in less time than that takes.
    @cached_property
    def _told(self) -> Words:
        words = self._words if isinstance(self._words, Words) else self._words()
        recorded = self._recorded
        if recorded is None or recorded.improve is None or not recorded.is_unchanged:
            return words
        return recorded.improve(self, words)

    def scan(self, record: int = 0) -> Scan:
        """Return estimates by the width of the test function, which tell whether equations of every scale agree.

        Of a result of the strong form they are by the length of the polynomials' windows, with its other settings. They are made when they
        are asked for first, which costs about 4 µs for each of at most 262 144 samples, and nothing is moved: the window was given.

        Parameters
        ----------
        record : int, optional
            Which record of a batch, counted along its flattened axes.

        Returns
        -------
        Scan
            Estimates, errors and the band in Hz of every width; ``summary()`` and ``plot()`` show them.

        Raises
        ------
        ValueError
            If nothing was compared and the record is not there to do it, or an instrument was given.
        IndexError
            If there is no such record.
        """
        if not self._found.scans:
            recorded = self._record("identify again, and ask for scan() before the result is saved or cut")
            if recorded.scans is None:
                raise ValueError(
                    "scan() compares equations without an instrument; this result has one; identify without it"
                )
            self._found = replace(self._found, scans=recorded.scans())
        scans = self._found.scans
        if not -len(scans) <= record < len(scans):
            raise IndexError(f"record must be below {len(scans)}, the number of records; got {record}")
        used = self.settings["window_length"] if self.settings["form"] == "strong" else None
        return replace(scans[record], units=self.units, used=used)

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return everything that has one value a sample, by name: what :meth:`save` writes.

        Returns
        -------
        dict of str to ndarray, shape (n,)
            Time, parameters and terms with their standard errors, condition number and residuals, the status of the sample and
            of the record, and 1 where values can be trusted.

        Raises
        ------
        ValueError
            If there are several records.
        """
        if self.inertia.ndim != 1:
            raise ValueError(
                f"only a single record has columns; this one has shape {self.inertia.shape}; take one record"
            )
        return {"time": self.time, **self._table().columns}

    def _table(self) -> Table:
        columns: dict[str, npt.NDArray[Any]] = {}
        values = {"inertia": self.inertia, "damping": self.damping, "stiffness": self.stiffness, **self.terms}
        values |= {name: self._found.values[name] for name in self.settings["inner"]}
        values |= {"natural_frequency": self.natural_frequency, "damping_ratio": self.damping_ratio}
        for name, value in values.items():
            columns[name] = value
            columns[f"{name}_stderr"] = self.stderr[name]
        columns |= {"condition": self.condition, "residual_std": self.residual_std}
        columns |= {"order": self.order, "status": self.status}
        records = np.asarray(self.record_status, np.uint16)[..., np.newaxis]
        columns["record_status"] = np.broadcast_to(records, self.status.shape).copy()
        columns["trusted"] = self.trusted.astype(np.uint8)
        return Table(self.time, columns, self.units, self.settings, self._found.labels)

    def save(self, path: str | Path) -> None:
        """Write every column to a file, with units in the header; all that :func:`tvident.load` needs too, if the file can hold it.

        Parameters
        ----------
        path : str or Path
            A name that ends in ``.npz`` or ``.parquet`` (needs pyarrow: ``tvident[io]``), from which the result comes back as it is, or
            in ``.csv`` and others, for columns alone: then the settings stand beside it, in a file with ``.settings.json`` behind its
            name. The file appears whole or not at all.

        Raises
        ------
        ValueError
            If the ending is another one, or there are several records and the file is no NPZ.
        OSError
            If there is no such folder, or the file cannot be written.
        """
        if Path(path).suffix in RESULT_ENDINGS:
            rest = {"terms": list(self.terms), "jumps": self.jumps, "words": plain_words(self._told)}
            store(Path(path), self._table(), self._found, rest)
        else:
            write_table(path, self.columns(), self.units)
            write_settings(Path(path), self.settings)

    def between(self, begin: float | None = None, end: float | None = None) -> Identification:
        """Return the part of the result from one time to another.

        Parameters
        ----------
        begin, end : float, optional
            Seconds, as in ``time``; both belong to the part. By default the first and the last.

        Returns
        -------
        Identification
            Views, no copies. Constants, settings, words and flags of the record are those of the whole.

        Raises
        ------
        ValueError
            If nothing lies in between.
        """
        samples, first, last = samples_between(self.time, begin, end)
        jumps = [
            tuple(jump for jump in one if first <= jump <= last)
            for one in (self.jumps if self.inertia.ndim > 1 else [self.jumps])
        ]
        part = Identification(
            of_samples(self._found, samples),
            time=self.time[samples],
            terms=list(self.terms),
            jumps=tuple(jumps) if self.inertia.ndim > 1 else jumps[0],
            words=self._words,
            settings=self.settings,
        )
        part._held_back = HeldBack(why_not="this is a part of a result; ask the whole")
        return part

    def __iter__(self) -> Iterator[Identification]:
        return (self[record] for record in range(self.inertia.shape[0] if self.inertia.ndim > 1 else 1))

    def __getitem__(self, place: int | slice | tuple[int | slice, ...]) -> Identification:
        batch = self.inertia.shape[:-1]
        if not batch:
            raise TypeError("only a result of several records can be indexed; this has one; use result.between(t0, t1)")
        records = chosen(place, batch)
        found = of_records(self._found, place)
        alone = found.status.ndim == 1
        words = self._told
        each = [words.each[record] for record in records] if words.each else []
        jumps = tuple(self.jumps[record] for record in records)
        return Identification(
            found,
            time=self.time,
            terms=list(self.terms),
            jumps=jumps[0] if alone else jumps,
            words=words if not each else each[0] if alone else of_batch(each),
            settings=settings_of(self.settings, records, found.kinds, alone=alone),
            recorded=None if self._recorded is None else self._recorded.of(place),
        )

    def summary(self) -> str:
        """Return a table of the parameters, and in words what was chosen and what to do.

        Returns
        -------
        str
            How much the model explains of a part of the record that was held back; median, range and median standard error of every
            parameter; what was chosen and why; what to do about what looks wrong; how often each flag of the status occurs.
        """
        return summary_of(self)

    def plot(self, what: Picture = "parameters", *, ax: Axes | Sequence[Axes] | None = None, **options: Any) -> Figure:
        """Draw the result, on axes of your own or in a new figure.

        Parameters
        ----------
        what : str, optional
            ``"parameters"``: what changes, with bands of two standard errors, and in a line what is constant (``truth=`` draws a simulated
            truth and the error). ``"torque"``: recorded, predicted and what is left. ``"status"``: order and flags over time.
            ``"poles"``: poles, natural frequency and damping ratio. ``"scan"``: estimates by the width of the test function, or of windows.
            ``"over"``: a parameter over the channel ``position=`` (``name=``, ``label=``).
        ax : Axes or sequence of Axes, optional
            Where to draw; one Axes is divided where a picture has several panels.
        **options
            See the functions of :mod:`tvident.figures`.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ImportError
            If matplotlib is missing: install ``tvident[plot]``.
        ValueError
            If there are several records, or no such picture.
        """
        from tvident import _figures  # noqa: PLC0415 - matplotlib is optional

        arguments.one_of("what", what, get_args(Picture))
        if what == "scan":
            return self.scan().plot(ax=ax, **options)
        draw: dict[str, Callable[..., Figure]] = {
            "parameters": _figures.plot_identification,
            "torque": _figures.plot_torque,
            "status": _figures.plot_status,
            "poles": _figures.plot_poles,
            "over": _figures.plot_over_position,
        }
        return draw[what](self, ax=ax, **options)

    def report(
        self,
        path: str | Path,
        *,
        channels: Mapping[str, npt.ArrayLike] | None = None,
        title: str | None = None,
    ) -> None:
        """Write a report: one page that opens in a browser without a network.

        It begins with the verdict, the parameters, what to do and the warnings with their times, and shows the recording and every
        result over time in plots that can be zoomed down to the sample. Samples have 16 bits each between the extremes of their
        128 neighbours, or as many as 25 MB have room for, at least 7: the page says how many levels these are. The extremes themselves have
        24 bits, so a single sample that stands out is seen at every zoom.
        Takes about 0.1 s for a million numbers, and as long as to identify if :meth:`summary` was not asked for before.

        Parameters
        ----------
        path : str or Path
            A name that ends in ``.html``. The file appears whole or not at all.
        channels : mapping of str to array_like, shape (n,), optional
            Other channels of the recording; a unit may follow the name in brackets.
        title : str, optional
            By default the name of the file.

        Raises
        ------
        ImportError
            If plotly is missing: install ``tvident[report]``.
        ValueError
            If the ending is another one, there are several records, or a channel does not have a value for every sample.
        OSError
            If there is no such folder, or the file cannot be written.
        """
        self._report(path, channels, title)

    def _report(
        self,
        path: str | Path,
        channels: Mapping[str, npt.ArrayLike] | None,
        title: str | None,
        said: Callable[[str], str] = str,
    ) -> None:
        """Write a report in words that `said` passes on."""
        from tvident._results.reported import report  # noqa: PLC0415 - pages are rarely asked for, and take long to load

        report(self, path, recorded=self._recorded, channels=channels, title=title, said=said)

    def __repr__(self) -> str:
        return short(self)

    def _repr_html_(self) -> str:
        return as_html(self)
