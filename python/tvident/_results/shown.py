"""What a result shows of itself: words, tables, files, figures and a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files import check_beside, keeps_result, write_settings, write_table
from tvident._results.kept import plain_comparison
from tvident._results.scan import Scan
from tvident._results.short import as_html, short
from tvident._results.simulated import Simulated
from tvident._results.stored import plain_words, store
from tvident._results.summary import summary_of
from tvident._results.told import Telling
from tvident._results.valued import Valued
from tvident._tables import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array: TypeAlias = npt.NDArray[np.float64]

Picture: TypeAlias = Literal["parameters", "torque", "status", "poles", "scan", "over"]


class Shown(Simulated, Telling, Valued):
    """The part of a result that is shown.

    Attributes
    ----------
    inertia, damping, stiffness, terms, condition, residual_std, order, status, record_status, jumps :
        Those of the result.
    """

    condition: Array
    residual_std: Array
    order: npt.NDArray[np.uint8]
    record_status: Any
    jumps: tuple[Any, ...]

    @property
    def natural_frequency(self) -> Array:
        """Natural frequency in Hz."""
        raise NotImplementedError

    @property
    def damping_ratio(self) -> Array:
        """Damping ratio, without unit."""
        raise NotImplementedError

    def scan(self, record: int = 0) -> Scan:
        """Return estimates by the width of the test function."""
        raise NotImplementedError

    def columns(self, *, judged: bool = True) -> dict[str, npt.NDArray[Any]]:
        """Return everything that has one value a sample, by name: what :meth:`save` writes.

        Parameters
        ----------
        judged : bool, optional
            False leaves ``trusted`` out: it follows the verdict, and where nobody asked for that before it takes as long as
            :meth:`summary`, which may be seconds where something contradicts the model. Tables and files have it, so they wait for it.

        Returns
        -------
        dict of str to ndarray, shape (n,)
            Time, parameters and terms with their standard errors, condition number and residuals, the status of the sample and
            of the record, and 1 where values can be trusted, as :attr:`trusted` says.

        Raises
        ------
        ValueError
            If there are several records.
        TypeError
            If `judged` is neither True nor False.

        See Also
        --------
        save : writes them.
        to_pandas, to_polars, to_xarray : the same in tables.
        """
        if self.inertia.ndim != 1:
            raise ValueError(
                f"only a single record has columns; this one has shape {self.inertia.shape}; take one record"
            )
        return {"time": self.time, **self._columns(judged=arguments.flag("judged", judged))}

    @property
    def trusted(self) -> npt.NDArray[np.bool_]:
        r"""Where values can be trusted, shape (\*, n)."""
        raise NotImplementedError

    def _numbers(self) -> dict[str, npt.NDArray[np.float64]]:
        columns: dict[str, npt.NDArray[np.float64]] = {}
        values = {"inertia": self.inertia, "damping": self.damping, "stiffness": self.stiffness, **self.terms}
        values |= {name: self._found.values[name] for name in self.settings["inner"]}
        values |= {"natural_frequency": self.natural_frequency, "damping_ratio": self.damping_ratio}
        for name, value in values.items():
            columns[name] = value
            columns[f"{name}_stderr"] = self.stderr[name]
        return columns

    def _table(self) -> Table:
        return Table(self.time, self._columns(judged=True), self.units, self.settings, self._found.labels)

    def _columns(self, *, judged: bool) -> dict[str, npt.NDArray[Any]]:
        columns: dict[str, npt.NDArray[Any]] = {**self._numbers()}
        columns |= {"condition": self.condition, "residual_std": self.residual_std}
        columns |= {"order": self.order, "status": self.status}
        records = np.asarray(self.record_status, np.uint16)[..., np.newaxis]
        columns["record_status"] = np.broadcast_to(records, self.status.shape).copy()
        if judged:
            columns["trusted"] = self.trusted.astype(np.uint8)
        return columns

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

        See Also
        --------
        tvident.load : reads it back.
        identify_file : writes while it computes, for recordings longer than memory.
        """
        place = arguments.path_of("path", path)
        if keeps_result(place):
            store(place, self._table(), self._found, self._rest())
        else:
            check_beside(place)
            write_table(place, self.columns(), self.units)
            write_settings(place, self.settings)

    def _rest(self) -> dict[str, Any]:
        """Return what files hold beside numbers."""
        words = plain_words(self._told)
        return {"terms": list(self.terms), "jumps": self.jumps, "words": words, "compared": plain_comparison(self)}

    def summary(self) -> str:
        """Return a table of the parameters, and in words what was chosen and what to do.

        Returns
        -------
        str
            How much the model explains of a part of the record that was held back; median, range and median standard error of every
            parameter; what was chosen and why; what to do about what looks wrong; how often each flag of the status occurs.

        See Also
        --------
        reasons, advice : its sentences, one by one.
        report : the same as a page, with plots.
        value : a number of it.
        """
        return summary_of(self)

    def plot(self, what: Picture = "parameters", *, ax: Axes | Sequence[Axes] | None = None, **options: Any) -> Figure:
        """Draw the result, on axes of your own or in a new figure.

        Parameters
        ----------
        what : str, optional
            ``"parameters"``: time-varying ones with bands of two standard errors, and constants in one line (``truth=`` draws a simulated
            truth and the error). ``"torque"``: recorded, predicted and what is left. ``"status"``: order and flags over time.
            ``"poles"``: poles, natural frequency and damping ratio. ``"scan"``: estimates by the width of the test function, or of windows.
            ``"over"``: a parameter over the channel ``position=`` (``name=``, ``label=``). Of several records there is the first: a line or
            a point for each, of at most 24.
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
            If there is no such picture, or none of several records.

        See Also
        --------
        tvident.figures : the functions that draw.
        report : a page to zoom in.
        """
        from tvident import _figures  # noqa: PLC0415 - matplotlib is optional

        arguments.one_of("what", what, get_args(Picture))
        if what == "over" and "position" not in options:
            raise TypeError(
                "a parameter must be drawn over a channel; got none; give position=, with a value for every sample"
            )
        if what == "parameters" and self.inertia.ndim > 1 and not options:
            batch: Any = self
            places = list(np.ndindex(self.inertia.shape[:-1]))
            return _figures.plot_records([batch[place if len(place) > 1 else place[0]] for place in places], ax=ax)
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

        See Also
        --------
        summary : its words.
        plot : its pictures, one by one.
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
