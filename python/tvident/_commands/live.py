"""The command ``tvident live``."""

from __future__ import annotations

import math
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any

import click
import numpy as np

import tvident
from tvident._commands.equation import lag_of, terms_of
from tvident._commands.given import given, length
from tvident._commands.method import NAMES, method_of
from tvident._commands.settings import read_settings
from tvident._equation import COEFFICIENTS
from tvident._live import Inlet, JsonLines, Lines, LiveTable, Outlet, Session, Udp
from tvident._units import ROTARY, factor_to

_WAIT = 0.05
"""Seconds between two looks at the clock while nothing comes."""

_SILENT = 5.0
"""Seconds without a sample after which that is said."""


# Options that need work before they are passed on are parameters of their own.
def live(
    file: str,
    lsl: str | None,
    angle: str,
    torque: str,
    time_channel: str | None,
    counter: str | None,
    sample_rate: float | None,
    method: str | None,
    terms: tuple[str, ...],
    lag: str | None,
    half_life: str | None,
    settings: str | None,
    shown: str | None,
    every: float,
    udp: str | None,
    lsl_output: str | None,
    duration: float | None,
    **options: Any,
) -> None:
    """Identify what comes, and give parameters to who watches."""
    del file
    names = [name for name in (time_channel, angle, torque, counter) if name is not None]
    if lsl is not None and time_channel is not None:
        raise click.UsageError("--time is for lines; got it with --lsl, whose samples have stamps; leave it out")
    if lsl is not None and lsl == lsl_output:
        raise click.UsageError(
            f"--lsl-output must have a name of its own; got {lsl!r} for both streams; choose another"
        )
    inlet = None if lsl is None else Inlet(lsl, names)
    rate = sample_rate or (inlet.nominal_rate if inlet is not None else 0.0)
    if not rate > 0:
        raise click.UsageError("a live recording needs its sample rate; got none; give --sample-rate")
    source = inlet or _begun(names, duration)
    units = dict(zip(names, source.units, strict=True))
    for name, key in ((angle, "angle_unit"), (torque, "torque_unit")):
        options[key] = options[key] or units[name] or None
    seconds = factor_to(ROTARY, "time", units.get(time_channel or ""), name="the time")
    of_method = {name: value for name, value in given(options).items() if name in NAMES}
    has_settings = settings is not None
    chosen = "paper" if method is None and not of_method and not has_settings else method
    others: dict[str, Any] = {
        name: _parameter(value) if name in COEFFICIENTS else value
        for name, value in given(options).items()
        if name not in NAMES
    }
    stream = tvident.IdentificationStream(
        sample_rate=rate,
        method=method_of(chosen, of_method, has_settings=has_settings),
        settings=None if settings is None else read_settings(settings),
        terms=terms_of(terms),
        lag=None if lag is None else lag_of(lag),  # type: ignore[arg-type] # refused with what to do instead
        half_life=None if half_life is None else length(half_life),
        # A sample that does not come is no reason to say nothing.
        nan_policy="omit",
        **others,
    )
    unknown = stream.units
    shows: list[Any] = []
    kind = shown or ("table" if sys.stdout.isatty() else "json")
    if kind != "nothing":
        shows.append((LiveTable(sys.stdout, every, unknown) if kind == "table" else JsonLines(sys.stdout)).show)
    if udp is not None:
        shows.append(Udp(udp).show)
    outlet: Outlet | None = None
    if lsl_output is not None:
        channels = [one for name, unit in unknown.items() for one in ((name, unit), (f"{name}_stderr", unit))]
        outlet = Outlet(lsl_output, [*channels, ("status", "")], rate / int(options["step"]))
        send = outlet.show
        shows.append(lambda stamps, columns: send(stamps, [columns[name] for name, _ in [*channels, ("status", "")]]))
    session = Session(stream, 1 / rate, shows)
    pieces = _with_stamps(source, seconds, has_time=time_channel is not None)
    _run(session, pieces, duration, has_counter=counter is not None)
    if outlet is not None:
        outlet.close()
    for words in session.words():
        click.echo(words, err=True)
    _say_read(source, session.clock.empty)


def _say_read(source: Inlet | Lines, empty: int) -> None:
    """Say which samples could not be read; end with an error where that is all of them, or none came."""
    has_lines = isinstance(source, Lines)
    if source.unreadable:
        click.echo(
            f"{source.unreadable} {'lines' if has_lines else 'samples'} could not be read and count as missing; the first is "
            f"{source.first_unreadable}",
            err=True,
        )
    if source.restarts:
        click.echo(f"the outlet began again {source.restarts} times: no window goes over that", err=True)
    if isinstance(source, Inlet) and source.has_gone:
        click.echo(
            "the outlet went, and the session with it: give the outlet a source_id, by which one that begins again is found",
            err=True,
        )
    if (missing := empty - source.unreadable - source.restarts) > 0:
        click.echo(f"{missing} samples came without an angle or a torque and count as missing", err=True)
    if not source.read and has_lines:
        raise click.ClickException(
            "lines must hold the channels; got none that does; look at what is piped, and at --angle and --torque"
        )
    if not source.read:
        raise click.ClickException("a stream must send samples with numbers; got none; look at its outlet")


def _begun(names: Sequence[str], duration: float | None) -> Lines:
    """Return the lines of standard input, of which the units are known."""
    lines = Lines(sys.stdin.fileno(), names)
    lines.begin(_WAIT, math.inf if duration is None else time.monotonic() + duration)
    return lines


def _parameter(value: str) -> str | float:
    """Return a kind or a number."""
    try:
        return float(value)
    except ValueError:
        return value


def _with_stamps(source: Inlet | Lines, seconds: float, *, has_time: bool) -> Iterator[list[list[float]]]:
    """Give rows that begin with a stamp in seconds: lines have times so many seconds long, or none, which is NaN."""
    for piece in source.pieces(_WAIT):
        if isinstance(source, Inlet):
            yield piece
        else:
            yield [[seconds * row[0], *row[1:]] if has_time else [math.nan, *row] for row in piece]


def _run(
    session: Session, pieces: Iterator[Sequence[Sequence[float]]], duration: float | None, *, has_counter: bool
) -> None:
    """Take pieces until the source ends, time is up, or Ctrl-C."""
    end = math.inf if duration is None else time.monotonic() + duration
    is_said = is_silent = False
    heard = time.monotonic()
    with _interrupted_between_pieces() as is_interrupted:
        for piece in pieces:
            now = time.monotonic()
            heard, is_silent = (now, False) if piece else (heard, is_silent)
            if not is_silent and now - heard > _SILENT:
                is_silent = True
                click.echo(f"nothing has come for {_SILENT:g} s; waiting for more; Ctrl-C ends", err=True)
            session.take(piece, has_counter=has_counter)
            if not is_said and (warning := session.clock.warning):
                is_said = True
                click.echo(f"Warning: {warning}", err=True)
            if is_interrupted():
                click.echo("ended by Ctrl-C", err=True)
                break
            if time.monotonic() >= end:
                break
        with np.errstate(all="ignore"):
            session.finish()


@contextmanager
def _interrupted_between_pieces() -> Iterator[Callable[[], bool]]:
    """Let the first Ctrl-C wait for what is being written, since half a line can be read by nobody; the second ends at once."""
    usual, is_asked = signal.getsignal(signal.SIGINT), False
    is_heard = threading.current_thread() is threading.main_thread() and callable(usual)

    def hear(number: int, frame: FrameType | None) -> None:
        nonlocal is_asked
        if is_asked and callable(usual):
            usual(number, frame)
        is_asked = True

    if is_heard:
        signal.signal(signal.SIGINT, hear)
    try:
        yield lambda: is_asked
    finally:
        if is_heard:
            signal.signal(signal.SIGINT, usual)
