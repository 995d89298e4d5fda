"""A recording that was read from a file: channels by name, with units, at one sample rate."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files.channels import Channels, FileWarning, full_name
from tvident._files.counts import counters
from tvident._files.names import listed, printable
from tvident._files.recordings import read
from tvident._files.single_rates import NOTABLE, check_alike, differ, no_rate_told, told_rates
from tvident._files.stated import no_rate_stated, stated_rate
from tvident._files.table import write_table
from tvident._files.which_clock import (
    check_no_counts,
    clock_among,
    increases,
    increasing_times,
    may_be_of_other_unit,
    time_channels,
)
from tvident._units import (
    Channel,
    named_unit,
    times_in_seconds,
    with_unit,
)


@arguments.called_as("FileRecording({'angle [deg]': angle, 'torque [N m]': torque})")
class FileRecording(Mapping[str, Channel]):
    """A recording from a file: a mapping of names to channels, each an array with its unit.

    Parameters
    ----------
    channels : mapping of str to array_like
        Channels by name; names may have units, as ``angle [deg]``.
    sample_rate : float, optional
        Samples per second, where the file says so itself.
    source : str, optional
        What messages call the file.

    Attributes
    ----------
    units : dict of str to str
        Units by name, as the file writes them.

    Notes
    -----
    Names are without units, unless channels differ by these alone; a channel is also found by its name with the unit, and by its number
    from 0. Numbers are those of the file: :func:`tvident.identify` converts by the unit of a channel, and so does
    :meth:`tvident.Channel.to`.

    See Also
    --------
    read_recording : reads one.
    Channel : an array with its unit.

    References
    ----------
    docs/files.md: what is read of every kind of file, and "Units".

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> t = np.arange(1000) / 500
    >>> recording = tvident.FileRecording({"time [s]": t, "angle [deg]": 10 * np.sin(9 * t)})
    >>> recording.sample_rate
    500.0
    >>> recording["angle"].unit
    'deg'
    >>> len(recording.select(0.5, 1.0)["angle"])
    250
    """

    def __init__(
        self, channels: Mapping[str, npt.ArrayLike], *, sample_rate: float | None = None, source: str = "the recording"
    ) -> None:
        if not hasattr(channels, "items"):
            raise TypeError(
                f"channels must be a mapping of names to samples; got {arguments.shown(channels)}; write {{'angle [deg]': samples}}, say"
            )
        for name, values in channels.items():
            arguments.check_in_memory(f"channels[{name!r}]", values)
        full = {str(name): np.asarray(values) for name, values in channels.items()}
        bare = [named_unit(name)[0] for name in full]
        self._channels: dict[str, Channel] = {}
        for name, values in full.items():
            short, unit = named_unit(name)
            key = short if bare.count(short) == 1 and (short == name or short not in full) else name
            self._channels[key] = Channel(values, unit or str(getattr(channels[name], "unit", "")))
        self.units = {name: values.unit for name, values in self._channels.items()}
        self._full: Channels = full
        self._names = dict(zip(full, self._channels, strict=True))
        self._rate = None if sample_rate is None else arguments.positive_number("sample_rate", sample_rate)
        self._source = source
        self._no_rate = ""
        """What the file states as a sample rate that is none."""

    def __getitem__(self, name: str) -> Channel:
        if name in self._channels:
            return self._channels[name]
        return self._channels[self._names[full_name(self._full, str(name), self._source)]]

    def __iter__(self) -> Iterator[str]:
        return iter(self._channels)

    def __len__(self) -> int:
        return len(self._channels)

    def __repr__(self) -> str:
        names = listed(self._headers())
        sizes = {values.size for values in self._channels.values() if values.ndim}
        try:
            rate = f" at {self.sample_rate:.6g} Hz"
        except ValueError:
            rate = ""
        return f"<FileRecording of {max(sizes, default=0)} samples{rate}: {names}>"

    @property
    def sample_rate(self) -> float:
        """Samples per second (Hz), float: as the file says, or from its channel of times.

        Raises
        ------
        ValueError
            If the file says nothing, single numbers say different things, or its times are not uniform: the message says how to go on.

        See Also
        --------
        time : the times themselves.
        tvident.identify : takes it as `sample_rate=`.
        """
        if self._rate is not None:
            return float(self._rate)
        told = told_rates(self._channels)
        check_alike(told, self._source)
        if told:
            return next(iter(told.values()))
        time = self.time
        if time is None or time.size < 2:  # noqa: PLR2004 - a period has two ends
            several = increasing_times(self._channels)
            had, cure = listed(self._headers()), self._cure_of_times()
            if len(several) > 1:
                had = f"several: {listed(several)}"
                cure = f"give the clocks of angle and torque, such as t=(recording[{several[0]!r}], recording[{several[1]!r}]), or "
            wrong = no_rate_told(self._channels) or self._no_rate
            raise ValueError(
                f"a sample rate needs a channel of times; {self._source} has {had}; {wrong and wrong + '; '}{cure}give sample_rate= "
                "where it is needed"
            )
        try:
            step = float(time[-1] - time[0]) / (time.size - 1)
            check_no_counts(float(time[0]), step, getattr(self._clock(), "unit", ""))
            period = arguments.sample_period(time.size, t=time)
            for values in self._channels.values():
                if values.dtype.kind in "iuf" and values.shape == time.shape and not increases(values):
                    arguments.check_no_lost_samples(time, values)
        except arguments.NotUniformError as error:
            lost = next((part for part in str(error).split("; ") if part.startswith("samples are lost")), "")
            raise ValueError(
                f"a sample rate needs times that are uniform to a thousandth of their step; those of {self._source} are not"
                f"{lost and ': ' + lost}; pass t= where times are taken, or resample"
            ) from None
        except ValueError as error:
            raise ValueError(
                f"a sample rate needs times that tell it; those of {self._source} do not: {error}"
            ) from None
        # Times with few digits give a rate with many.
        rate = 1 / period
        return float(round(rate)) if abs(rate - round(rate)) < 1e-6 * rate else rate

    @property
    def time(self) -> npt.NDArray[np.float64] | None:
        """Time of every sample in seconds, shape (n,); None where the file has no channel of times, or several that differ.

        See Also
        --------
        sample_rate : where they are uniform.
        select : a part by time.
        """
        clock = self._clock()
        return None if clock is None else np.asarray(times_in_seconds(clock), dtype=np.float64)

    def _clock(self) -> Channel | None:
        """Return the channel of times; None where there is none, or several that differ."""
        name = clock_among(self._channels)
        return None if name is None else self._channels[name]

    def _cure_of_times(self) -> str:
        """Return what to do about a channel that is called as times are, and whose unit is none of time, or may mean several."""
        for name, values in self._channels.items():
            bare = name.rpartition(".")[2]
            if values.ndim and arguments.is_called_time(bare) and not arguments.is_time(bare, values.unit):
                return f"{values.unit!r} of {name!r} is no unit of time, or may mean several: call it '{name} [ms]', say, or "
        for name, step in counters(self._full):
            bare = self._names[name]
            counted = f"{bare!r} goes up by {step} from sample to sample"
            return f"{counted}: give t=recording[{bare!r}] and time_unit='ms' if it counts milliseconds, or "
        return ""

    def select(self, t0: float, t1: float) -> FileRecording:
        """Return the samples from one time to another.

        Parameters
        ----------
        t0, t1 : float
            Seconds, as the channel of times has them, or from the first sample on where there is none. The sample at `t1` is left out.

        Returns
        -------
        FileRecording
            With the same names and units; its channels are views.

        Raises
        ------
        ValueError
            If no sample lies between, or nothing says when samples were taken.

        See Also
        --------
        Identification.between : the same of a result.
        write : writes the part to a file.
        """
        sizes = [values.size for values in self._channels.values() if values.ndim]
        t0, t1 = arguments.real_number("t0", t0), arguments.real_number("t1", t1)
        time = self.time
        if time is None:
            time = np.arange(max(sizes, default=0)) / self.sample_rate
        with np.errstate(invalid="ignore"):
            inside = np.flatnonzero((time >= t0) & (time < t1))
        if not inside.size:
            raise ValueError(
                f"a part must hold a sample; none of {self._source} lies from {t0:g} to {t1:g} s; its times go from {time[0]:g} to "
                f"{time[-1]:g} s"
            )
        part = slice(int(inside[0]), int(inside[-1]) + 1)
        cut = {
            full: values[part] if values.ndim and values.shape[0] == time.size else values
            for full, values in self._full.items()
        }
        return FileRecording(cut, sample_rate=self._rate, source=self._source)

    def write(self, path: str | Path) -> None:
        """Write every channel to a file, with its unit.

        Parameters
        ----------
        path : str or Path
            Its ending says how: ``.csv``, ``.npz`` and others, as for results. The file appears whole or not at all.

        Raises
        ------
        ValueError
            If the ending is unknown, or channels have different lengths and the file holds a table.
        OSError
            If there is no such folder, or the file cannot be written.

        See Also
        --------
        tvident.read_recording : reads it back.
        """
        write_table(
            path, self._channels, {name: "" if named_unit(name)[1] else unit for name, unit in self.units.items()}
        )

    def _headers(self) -> dict[str, Channel]:
        """Return channels by their names with units."""
        return {
            name if named_unit(name)[1] else with_unit(name, values.unit): values
            for name, values in self._channels.items()
        }


@arguments.called_as("read_recording('run.csv')")
def read_recording(path: str | Path, *, missing: float | Sequence[float] = ()) -> FileRecording:
    """Read a recording from a file: its channels by name, with their units and the sample rate.

    Parameters
    ----------
    path : str or Path
        Text (CSV, LabVIEW, OpenSim), NPY, NPZ, or what an extra reads: the ending says which. Units stand in names, as ``angle [deg]``,
        ``Torque (Nmm)`` or ``t/ms``, or in a line of their own.
    missing : float or sequence of float, optional
        Numbers that mark values that are missing, as -9999: they become NaN.

    Returns
    -------
    FileRecording
        ``recording["angle"]`` is an array with its unit, which :func:`tvident.identify` converts; ``.sample_rate``, ``.time``,
        ``.select(t0, t1)``, ``.write(path)``.

    Raises
    ------
    FileError
        If the file cannot be read as it is meant: :mod:`tvident.recordings` has it. The message says what to do.

    Warns
    -----
    FileWarning
        If something in the file is not read, or not as it stands there.

    Notes
    -----
    What can be read, and what it costs: see :func:`tvident.recordings.read`, which returns plain arrays.

    See Also
    --------
    FileRecording : what is returned.
    identify : identifies a system from two of its channels.

    References
    ----------
    docs/files.md: what is read of every kind of file, and "Units". :func:`tvident.recordings.read` names the specifications of formats.

    Examples
    --------
    >>> import tvident
    >>> tvident.simulate_torsional_rig(duration=3.0).save("rig.csv")
    >>> recording = tvident.read_recording("rig.csv")
    >>> recording["torque"].unit, recording.sample_rate
    ('N m', 1000.0)
    >>> result = tvident.identify(recording["angle"], recording["torque"], sample_rate=recording.sample_rate)
    """
    path = arguments.path_of("path", path)
    channels = read(path, missing=missing)
    stated = stated_rate(path) if not time_channels(channels) and not increasing_times(channels) else None
    rate = None if stated is None else stated.rate
    said = said_otherwise(path, channels)
    if said:
        warnings.warn(f"{printable(path)}: {said}", FileWarning, stacklevel=2)
    recording = FileRecording(channels, sample_rate=rate, source=printable(path.name))
    if rate is None:
        recording._no_rate = no_rate_stated(path)  # noqa: SLF001 - of this file
    return recording


def said_otherwise(path: Path, channels: Mapping[str, npt.NDArray[Any]]) -> str:
    """Return that lines above the numbers of a text, or a single number, state another sample rate than the times; nothing elsewhere."""
    if not (time_channels(channels) or increasing_times(channels)):
        return ""
    try:
        recording = FileRecording({name: values for name, values in channels.items() if values.size > 1})
        shown = recording.sample_rate
    except ValueError:
        return ""
    told = told_rates(FileRecording(channels))
    # Where they differ the sample rate says so.
    for name, rate in told.items() if not differ(told) else ():
        clock = recording._clock()  # noqa: SLF001 - of this class
        if not (clock is not None and clock.unit) and may_be_of_other_unit(shown / rate, NOTABLE):
            return ""
        words = f"{printable(name, 40)} says {rate:.6g} Hz, which is used, and its times show {shown:.6g} Hz"
        return "" if abs(shown / rate - 1) < NOTABLE else f"{words}: check which is right"
    stated = stated_rate(path)
    if stated is None or abs(shown / stated.rate - 1) < NOTABLE:
        return ""
    return f"it states '{stated.words}', {stated.rate:.6g} Hz, and its times show {shown:.6g} Hz, which is used: check which is right"
