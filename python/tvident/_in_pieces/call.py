"""The function ``identify_file``: a recording longer than memory, from file to file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from tvident import _arguments as arguments
from tvident import _core
from tvident._choices import VERSION
from tvident._equation import GivenTerm
from tvident._files import (
    TEXT_ENDINGS,
    FileError,
    check_apart,
    ending_of,
    marks_given,
)
from tvident._identify import Method
from tvident._in_pieces.copied import copied
from tvident._in_pieces.found import FileIdentification
from tvident._in_pieces.kept import Kept, mark_of
from tvident._in_pieces.outputs import check_output
from tvident._in_pieces.recorded import RecordingOfFile, units_of
from tvident._in_pieces.run import AskedOfFile, Run
from tvident._in_pieces.sampling import begin_and_period
from tvident._in_pieces.sources import Source, opened
from tvident._pieces import Given

PIECE, LONG_PIECE = 1 << 18, 3 << 18
"""Samples of a piece, about, and of one in weak form in which one unknown changes: what is computed of it fits into 150 MiB.

Every piece in weak form judges for itself at which lengths windows are averaged, however long it is.
"""


# All but the files are options, as users call it.
@arguments.called_as("identify_file('in.npy', 'out.parquet', angle='angle', torque='torque', sample_rate=1000)")
def identify_file(
    path: str | Path,
    output: str | Path,
    *,
    angle: str,
    torque: str,
    sample_rate: float | None = None,
    delta: float | None = None,
    t: str | None = None,
    weights: str | None = None,
    angle_unit: str | None = None,
    torque_unit: str | None = None,
    method: Method = "auto",
    inertia: str | float | None = None,
    damping: str | float | None = None,
    stiffness: str | float | None = None,
    terms: Sequence[GivenTerm] | None = None,
    lag: float | str | None = None,
    quantisation: float | None = None,
    nan_policy: arguments.RowPolicy = "omit",
    missing: float | Sequence[float] = (),
    step: int = 1,
    settings: Mapping[str, Any] | None = None,
    workers: int | None = None,
    progress: arguments.Progress = None,
) -> FileIdentification:
    """Identify a recording that is longer than memory, from a file to a file, piece by piece.

    What :func:`identify` does, with memory that does not grow: below 300 MiB for a day at 1 kHz. Pieces that are done are kept in a folder
    beside the output, ``.NAME.tvident``: the same call goes on there after an interruption. The output appears when it is whole.

    Parameters
    ----------
    path : str or Path
        The recording: ``.npy`` (columns, or fields with names), ``.parquet``, ``.h5``, ``.nc`` (netCDF 3 and 4), ``.zarr``, or text
        (``.csv``), which is copied once to binary numbers beside the output.
    output : str or Path
        Where columns go, one row for every `step`-th sample: ``.npy`` (fields with names), ``.parquet``, ``.h5``, ``.zarr`` or ``.csv``.
        All but ``.npy`` and ``.csv`` hold settings and constants as JSON too, under ``tvident``.
    angle, torque : str
        Names of the channels, of shape (n,), or their numbers from 0. Units are those of the file, or rad and N m.
    sample_rate, delta : float, optional
        Samples per second, or seconds from one to the next; by default what the file says, as :func:`read_recording` has it, or from a
        channel of times.
    t : str, optional
        The channel of times, which must be uniform to a thousandth of their step; by default one that is called ``time``.
    weights : str, optional
        The channel of weights: one over the variance of the noise at every sample, relative to the others, 0 where it is not to be used.
    angle_unit, torque_unit : str, optional
        Units of the channels, where the file says none or others.
    missing : float or sequence of float, optional
        Numbers that mark values that are missing, as -9999.
    method, inertia, damping, stiffness, terms, lag, quantisation, nan_policy, step, settings, workers : optional
        As in :func:`identify`; parameters are kinds or numbers, terms are built-in ones without inner parameters.
    progress : bool or callable, optional
        Show a bar, or call a function with the samples done and all of them. An exception that it raises interrupts the work.

    Returns
    -------
    FileIdentification
        ``constants``, ``settings``, ``record_status``, ``advice`` and how many rows have each flag.

    Raises
    ------
    FileError
        If the recording cannot be read as it is meant: :mod:`tvident.recordings` has it.
    ValueError
        If the output's ending is unknown, times are not uniform, or what is asked for needs the whole record.
    KeyError
        If there is no such channel.
    OSError
        If the output cannot be written.
    BlockingIOError
        If another call writes the same output now.

    Notes
    -----
    With everything windowed in strong form, as with ``method="paper"``, the numbers are those of one call in memory, bit for bit, beside
    missing samples too, as long as none has a weight and there is no lag.

    In weak form, and with constants, weights or a lag in strong form, every piece is identified as a record of its own with neighbours on
    both sides. What is left to be chosen is chosen once, from at most eight stretches of 65 536 samples spread over the recording; flags
    and advice of these stretches are those of the record. The constants of all pieces are put together, each weighted by the inverse of its
    variance, and the numbers of every piece are corrected for the difference of its own constants. Where pieces differ by more than chance,
    constants stay those of the pieces, and the record has the flag KIND_CONTRADICTED.

    Equations (2) to (4), (8) and (9) of the paper. The cost is that of :func:`identify`, in strong form about 60 ns a sample and thread,
    and that of writing and reading the results once more; what windows give is written while the next piece is computed,
    by a thread of its own beside the workers.

    See Also
    --------
    identify : of arrays in memory.
    FileIdentification : what is returned.
    tvident.dask : on several machines.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=20.0)
    >>> np.save("rig.npy", np.stack([rig.angle, rig.torque], axis=1))
    >>> found = tvident.identify_file("rig.npy", "parameters.npy", angle="0", torque="1", sample_rate=1000, method="paper")
    >>> rows = np.load("parameters.npy", mmap_mode="r")
    >>> whole = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method="paper")
    >>> bool(np.array_equal(rows["stiffness"], whole.stiffness, equal_nan=True))
    True
    """
    source_path, place = arguments.path_of("path", path), arguments.path_of("output", output)
    check_output(place)
    check_apart({"the output": place}, {"the recording": source_path})
    every = arguments.whole_number("step", step, least=1)
    threads = arguments.worker_count(workers)
    arguments.one_of("nan_policy", nan_policy, ("omit", "propagate", "raise"))
    _check_named({"angle": angle, "torque": torque}, {"t": t, "weights": weights}, settings)
    _check_units(angle_unit=angle_unit, torque_unit=torque_unit)
    marks = marks_given(missing)
    delta, sample_rate = (
        None if one is None else arguments.positive_number(name, one)
        for name, one in (("delta", delta), ("sample_rate", sample_rate))
    )
    given = {
        "inertia": inertia,
        "damping": damping,
        "stiffness": stiffness,
        "terms": terms,
        "lag": lag,
        "quantisation": quantisation,
    }
    is_text = ending_of(source_path).lower() in TEXT_ENDINGS
    mark = mark_of(source_path) if source_path.exists() else ""
    told = {
        "version": VERSION,
        "instructions": _core.instructions(),
        "recording": [
            mark,
            angle,
            torque,
            sample_rate,
            delta,
            t,
            weights,
        ],
        "units": [angle_unit, torque_unit],
        "asked": [repr(method), repr(given), nan_policy, every, repr(dict(settings or {})), *marks],
    }
    with ExitStack() as stack, arguments.reporter(progress, "identification") as told_of:
        report = None if told_of is None else arguments.WatchedProgress(told_of)
        source, kept = _opened(source_path, place, told, mark if is_text else None)
        stack.callback(kept.close)
        stack.callback(source.close)
        source = source.with_missing(marks)
        try:
            recording = _recording(source, (angle, torque, t), (angle_unit, torque_unit), (delta, sample_rate))
            if not is_text:
                recording = replace(recording, opened=(source_path, mark))
            weighted = weights is not None
            if weights is not None:
                recording = replace(recording, weights=source.of_length("weights", weights, recording.samples)[0])
            call = Given(method, given, settings, nan_policy, recording.period, recording.axis, threads, weighted)
            asked = AskedOfFile(recording, call, every)
            return Run(asked, kept, LONG_PIECE if asked.is_narrow else PIECE, place, report).all()
        except BaseException as error:
            # The copy of a text is of use to the same call alone, which such an error would end again.
            is_wrong = isinstance(error, _WRONG) and (report is None or error is not report.error)
            if kept.is_empty or (is_wrong and not kept.has_results):
                kept.remove()
            raise


def _check_named(names: Mapping[str, object], others: Mapping[str, object], settings: Mapping[str, Any] | None) -> None:
    """Check, before anything is copied, that channels are named and settings are some."""
    for what, name in (*names.items(), *((what, name) for what, name in others.items() if name is not None)):
        if not isinstance(name, str):
            raise TypeError(
                f"{what} must be the name of a channel; got {arguments.shown(name)}; write 'angle', or its number '0', say"
            )
    if settings is not None and not isinstance(settings, Mapping):
        raise TypeError(
            f"settings must be those of an earlier result; got {arguments.shown(settings)}; pass result.settings"
        )


def _check_units(**units: object) -> None:
    """Check that units are words, before they become part of what is kept."""
    for name, unit in units.items():
        if unit is not None and not isinstance(unit, str):
            raise TypeError(f"{name} must be text; got {type(unit).__name__}; write 'deg', 'N m' or 'ms', say")


_WRONG = (FileError, ValueError, TypeError, KeyError)
"""What a file or a call has that another call must put right."""


def _opened(path: Path, output: Path, told: Mapping[str, Any], of_text: str | None) -> tuple[Source, Kept]:
    """Return the recording, as rows of numbers where it is a text with a mark, and what is kept of an earlier call."""
    if of_text is not None and path.is_file():
        kept = Kept(output, told)
        try:
            return copied(path, kept.folder, of_text), kept
        except BaseException as error:
            if isinstance(error, _WRONG):
                kept.remove()
            kept.close()
            raise
    return opened(path), Kept(output, told)


def _recording(
    source: Source,
    names: tuple[str, str, str | None],
    units: tuple[str | None, str | None],
    rates: tuple[float | None, float | None],
) -> RecordingOfFile:
    """Return the two channels of a recording and their times."""
    (angle, samples, angle_says), (torque, others, torque_says) = (
        source.channel(name) for name in names[:2] if name is not None
    )
    if samples != others:
        raise ValueError(
            f"angle and torque must have one length; {source.place} has {samples} and {others} samples; resample one of them"
        )
    if not samples:
        raise ValueError(f"a recording must hold samples; {source.place} has none; check it")
    axis = units_of(angle_says, torque_says, *units)
    begin, period = begin_and_period(source, samples, rates, names[2])
    return RecordingOfFile(angle, torque, samples, begin, period, axis)
