"""Results of several records of different lengths, and what they share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, overload

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files import printable
from tvident._results.held_back import HeldBack
from tvident._results.parts import of_samples
from tvident._results.result import Identification
from tvident._results.stored_lists import store_list
from tvident._results.words import Words
from tvident._status import Status
from tvident._tables import TabularList

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Shared:
    """What records share.

    Attributes
    ----------
    values : mapping of str to float
        Estimated from all records; NaN where they do not determine it.
    covariance : ndarray, shape (shared, shared)
    agreement : float
        Sum of squares of the differences between records over what their errors allow; about `freedom` where they agree.
    freedom : int
    limit : float
        What `agreement` exceeds in one of a thousand cases where records agree.
    silent : tuple of int
        Records that say nothing of what is shared.
    """

    values: Mapping[str, float]
    covariance: Array
    agreement: float
    freedom: int
    limit: float
    silent: tuple[int, ...] = ()

    @property
    def constants(self) -> dict[str, tuple[float, float]]:
        """Values with standard errors."""
        errors = np.sqrt(np.diagonal(self.covariance)).tolist()
        return {name: (value, error) for (name, value), error in zip(self.values.items(), errors, strict=True)}

    @property
    def is_contradicted(self) -> bool:
        """Whether records differ by more than their errors explain."""
        return self.agreement > self.limit


def covariance_between(result: Identification, one: str, other: str) -> float:
    """Return the covariance of two constants of a record; 0 where it is not known."""
    found = result._found  # noqa: SLF001 - of this room
    values = found.covariances.get(frozenset((one, other)))
    if values is None or not values.size:
        return 0.0
    scale = np.ravel(found.factors.get(one, 1.0) * found.factors.get(other, 1.0))[0]
    return float(np.nan_to_num(values[0] * scale))


def with_shared(result: Identification, shared: Shared, changes: Mapping[str, Identification]) -> Identification:
    """Return the result of one record, found with what is shared known, with the errors of that.

    Parameters
    ----------
    result : Identification
    shared : Shared
    changes : mapping of str to Identification
        The same with each of the shared moved by its standard error.
    """
    found = result._found  # noqa: SLF001 - of this room
    whole = {name: found.errors[name] * found.factors.get(name, 1.0) for name in found.errors}
    scale = {name: found.factors.get(name, np.ones(1)) for name in found.errors}
    names, deviations = list(shared.values), np.sqrt(np.diagonal(shared.covariance))
    correlations = shared.covariance / np.outer(deviations, deviations)
    moved = {
        name: np.stack([_change(result, changes[one], name, deviations[place]) for place, one in enumerate(names)])
        for name in whole
    }
    for place, one in enumerate(names):
        moved[one] = np.zeros_like(moved[one])
        moved[one][place] = deviations[place]

    def together(one: str, other: str) -> Array:
        return np.asarray(np.einsum("jn,jk,kn->n", moved[one], correlations, moved[other]))

    errors = {name: np.sqrt(error**2 + together(name, name)) for name, error in whole.items()}
    pairs = [
        frozenset(("inertia", "damping")),
        frozenset(("inertia", "stiffness")),
        frozenset(("damping", "stiffness")),
    ]
    covariances = {}
    for pair in {*pairs, *found.covariances}:
        one, other = sorted(pair)
        own = found.covariances[pair] * scale[one] * scale[other] if pair in found.covariances else 0.0
        covariances[pair] = own + together(one, other)
    constants = {
        name: (value, float(errors[name][0]) if name in errors and errors[name].size else error)
        for name, (value, error) in found.constants.items()
    }
    kinds = {**found.kinds, **{name: np.array("constant") for name in names}}
    flag = Status.KIND_CONTRADICTED if shared.is_contradicted else Status(0)
    changed = replace(
        found,
        errors=errors,
        factors={},
        covariances=covariances,
        in_common={},
        constants={**shared.constants, **constants},
        kinds=kinds,
        record_status=Status(int(found.record_status)) | flag,
    )
    return Identification(
        changed,
        time=result.time,
        terms=list(result.terms),
        jumps=result.jumps,
        words=result._words,  # noqa: SLF001 - of this room
        settings=result.settings,
        recorded=result._recorded,  # noqa: SLF001 - of this room
    )


def of_short(result: Identification, time: Array, why: str) -> Identification:
    """Return a result without numbers for a record that is too short.

    Parameters
    ----------
    result : Identification
        Of a record in which every sample is missing, and which is long enough.
    time : ndarray, shape (n,)
        Of the samples of which results are wanted.
    why : str
    """
    advice = f"nothing could be identified of this record: {why}"
    part = Identification(
        of_samples(result._found, slice(0, time.size)),  # noqa: SLF001 - of this room
        time=time,
        terms=list(result.terms),
        jumps=(),
        words=Words(advice=(advice,)),
        settings=result.settings,
    )
    part._held_back = HeldBack(why_not="the record is too short")  # noqa: SLF001 - of this room
    return part


def _change(result: Identification, other: Identification, name: str, deviation: float) -> Array:
    """Return by how much something moves with what is shared; zero if either has no number."""
    moved = other._found.values[name] - result._found.values[name]  # noqa: SLF001 - of this room
    return np.nan_to_num(moved) if deviation > 0 else np.zeros_like(moved)


class IdentifiedRecords(TabularList, Sequence[Identification]):
    """What :func:`tvident.identify` found in a list of records: a sequence of :class:`Identification`, one a record.

    Attributes
    ----------
    constants : dict of str to (value, stderr)
        What was shared, estimated from all records.
    record_status : Status
        Flags of any record; KIND_CONTRADICTED also where records differ in what they share.

    See Also
    --------
    identify : returns it for a list of records.
    Identification : the result of one record.

    References
    ----------
    W. G. Cochran: The combination of estimates from different experiments, Biometrics 10 (1954): weights, and the test whether estimates
    agree.

    Examples
    --------
    >>> import tvident
    >>> rigs = [tvident.simulate_torsional_rig(duration=seconds, seed=seed) for seed, seconds in enumerate((2.0, 3.0))]
    >>> angles, torques = [rig.angle for rig in rigs], [rig.torque for rig in rigs]
    >>> found = tvident.identify(angles, torques, sample_rate=1000, share=("inertia",))
    >>> len(found), found[0].stiffness.size, found[1].stiffness.size
    (2, 2000, 3000)
    >>> value, error = found.constants["inertia"]
    >>> abs(value - 0.0123) < 5 * error
    True
    """

    def __init__(self, records: Sequence[Identification], shared: Shared | None = None) -> None:
        self._records = tuple(records)
        self._shared = shared
        self.constants = {} if shared is None else shared.constants
        flags = Status(0)
        for record in self._records:
            flags |= Status(int(np.bitwise_or.reduce(np.ravel(np.asarray(record.record_status, np.uint16)))))
        self.record_status = flags

    @overload
    def __getitem__(self, place: int) -> Identification: ...
    @overload
    def __getitem__(self, place: slice) -> IdentifiedRecords: ...
    def __getitem__(self, place: int | slice) -> Identification | IdentifiedRecords:
        if isinstance(place, slice):
            return IdentifiedRecords(self._records[place], self._shared)
        try:
            return self._records[place]
        except (IndexError, TypeError) as error:
            raise type(error)(
                f"an index must be the number of one of the {len(self)} records, or a slice; got {arguments.shown(place)}; count from 0"
            ) from None

    def __len__(self) -> int:
        return len(self._records)

    def __iter__(self) -> Iterator[Identification]:
        return iter(self._records)

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do about what looks wrong in what is shared: a tuple of sentences.

        See Also
        --------
        Identification.advice : what to do about one of the records.
        """
        shared = self._shared
        if shared is None:
            return ()
        names = " and ".join(shared.values)
        if not np.isfinite(list(shared.values.values())).all():
            return (f"no record determines {names}: excite the system, or share nothing",)
        said = []
        if shared.silent:
            which = (
                f"record {shared.silent[0]} says"
                if len(shared.silent) == 1
                else f"records {arguments.listed([str(one) for one in shared.silent])} say"
            )
            said.append(
                f"{which} nothing of {names}, which is of the others alone: look whether a channel is dead, or leave it out"
            )
        if shared.is_contradicted:
            found = f"(sum of squares {shared.agreement:.3g}, where chance explains {shared.limit:.3g})"
            cure = "do not share it, or look for a record that is not of this system"
            said.append(f"records differ in {names} by more than their errors explain {found}: {cure}")
        return tuple(said)

    def save(self, path: str | Path) -> None:
        """Write all results to one file, from which :func:`tvident.load` brings them back.

        Parameters
        ----------
        path : str or Path
            A name that ends in ``.npz``. The file appears whole or not at all.

        Raises
        ------
        ValueError
            If the ending is another one: records of a list have no table of one length.
        OSError
            If there is no such folder, or the file cannot be written.

        See Also
        --------
        tvident.load : reads it back.
        Identification.save : one of the records, to other files too.
        """
        place = arguments.path_of("path", path)
        if place.suffix.lower() != ".npz":
            raise ValueError(
                f"a list of results is saved to a file that ends in .npz; got '{printable(place.name)}'; rename it, or save one of them: "
                "result[0].save(…)"
            )
        shared = self._shared
        told = None if shared is None else {**vars(shared), "covariance": shared.covariance.tolist()}
        store_list(place, self._records, told)

    def report(self, path: str | Path, *, title: str | None = None) -> None:
        """Write a report of all records: one page that opens in a browser without a network.

        It begins with what is shared; each record follows with its parameters and its plots, which are zoomed together.

        Parameters
        ----------
        path : str or Path
            A name that ends in ``.html``. The file appears whole or not at all.
        title : str, optional
            By default the name of the file.

        Raises
        ------
        ImportError
            If plotly is missing: install ``tvident[report]``.
        ValueError
            If the ending is another one, or there are more than 24 records: ``result[:24]`` are some.
        OSError
            If there is no such folder, or the file cannot be written.

        See Also
        --------
        summary : its words.
        Identification.report : of one record, with channels of your own.
        """
        from tvident._results.reported import report_list  # noqa: PLC0415 - pages are rarely asked for, and take long to load

        words = self.summary()
        report_list(self._records, path, shared=self.constants, advice=self.advice, summary=words, title=title)

    def plot(self, what: str = "parameters", *, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """Draw the parameters of all records, on axes of your own or in a new figure.

        One line is a record where they change with time, one point with two standard errors where they are constant; what is shared is a
        line with a band.

        Parameters
        ----------
        what : str, optional
            Always ``"parameters"``; other pictures are of one record.
        ax : Axes or sequence of Axes, optional
            Where to draw; one Axes is divided if there are several panels.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ImportError
            If matplotlib is missing: install ``tvident[plot]``.
        ValueError
            If another picture is asked for, or there are more than 24 records: ``result[:24]`` are some.

        See Also
        --------
        Identification.plot : pictures of one record.
        report : a page to zoom in.
        """
        from tvident import _figures  # noqa: PLC0415 - matplotlib is optional

        if what != "parameters":
            raise ValueError(
                f"what must be 'parameters' for a list of records; got {arguments.shown(what)}; draw one of them: "
                f"result[0].plot({arguments.shown(what)})"
            )
        return _figures.plot_records(self._records, shared=self.constants, ax=ax)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or not self._records or not hasattr(self._records[0], name):
            raise AttributeError(f"'{type(self).__name__}' object has no attribute {name!r}")
        raise AttributeError(
            f"{name} must be asked of one record; got a list of {len(self)}; write result[0].{name}, say"
        )

    def summary(self) -> str:
        """Return what is shared, and the summary of every record.

        Returns
        -------
        str

        See Also
        --------
        Identification.summary : of one of the records.
        """
        lines = [
            f"{name}, shared by {len(self)} records: {arguments.with_error(*one)}"
            for name, one in self.constants.items()
        ]
        lines += [f"  {line}" for line in self.advice]
        for place, record in enumerate(self._records):
            lines += ["", f"record {place}", record.summary()]
        return "\n".join(lines).lstrip("\n")

    def __repr__(self) -> str:
        shared = ", ".join(f"{name} {arguments.with_error(*one)}" for name, one in self.constants.items())
        return f"<tvident.IdentifiedRecords: {len(self)} records" + (f", shared: {shared}>" if shared else ">")
