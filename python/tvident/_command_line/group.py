"""The command ``tvident``, and what it says when something is wrong."""

from __future__ import annotations

import errno
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from io import TextIOWrapper
from typing import Any

import click

from tvident._command_line.interrupts import every_interrupt_heard

_LONGEST_LINE = 1500
"""Characters of a message."""


@contextmanager
def _in_plain_words() -> Iterator[None]:
    """Turn what the library and files raise into one line and an exit status: 2 for misuse, 1 for what cannot be read, written or done."""
    try:
        yield
    except click.ClickException as error:
        # Names of files and channels are part of messages, and may hold what a terminal obeys.
        error.message = "\n".join(_line(line) for line in error.message.split("\n")) + _cure(error)
        raise
    except (click.exceptions.Exit, click.Abort):
        raise
    except _file_error() as error:
        raise click.ClickException(_line(error)) from None
    except KeyError as error:
        raise click.UsageError(_line(error.args[0])) from None
    except (ValueError, TypeError, ArithmeticError, ImportError) as error:
        raise click.UsageError(_line(error)) from None
    except MemoryError:
        raise click.ClickException(
            "the work needs more memory than there is; cut the recording into pieces, or ask for every --step-th result"
        ) from None
    except RuntimeError as error:
        raise click.ClickException(_line(error)) from None
    except OSError as error:
        if error.errno == errno.EPIPE:
            raise  # whoever reads the output has had enough: click ends without a word
        _let_go_of_output()
        raise click.ClickException(_of_system(error)) from None


def _of_system(error: OSError) -> str:
    """Return what the system says of a file, or what the library says of it in words of its own."""
    if error.strerror is None:
        return _line(error)
    place = "the output" if error.filename is None else _line(error.filename)
    return f"{place}: {_line(error.strerror)}"


def _cure(error: click.ClickException) -> str:
    """Return what to do about words that belong to nothing: a shell parts names at their blanks."""
    is_extra = error.message.startswith("Got unexpected extra argument")
    return "; a name that has blanks needs quotes: --angle 'crank angle'" if is_extra else ""


def _let_go_of_output() -> None:
    """Forget what standard output cannot take: the interpreter would try once more at its end, complain, and exit with 120."""
    output = sys.__stdout__
    if output is None:
        return
    try:
        output.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, output.fileno())
        os.close(nowhere)


def commands() -> Any:
    """Return the room in which commands are carried out, which takes NumPy and the whole package."""
    room = import_module("tvident._commands")
    # An error elsewhere is a word here.
    warnings.simplefilter("always", import_module("tvident.recordings").FileWarning)
    return room


# Rooms of the package take NumPy, which help and version need not wait for: they are entered when something goes wrong or is done.
def _line(message: object) -> str:
    text: str = import_module("tvident._files").printable(message, _LONGEST_LINE)
    return text


def _file_error() -> type[Exception]:
    kind: type[Exception] = import_module("tvident.recordings").FileError
    return kind


COMMANDS = {
    "compare": "Compare candidates for the equation of motion of the angle and torque in FILE.",
    "completion": "Print what makes a shell complete names and options.",
    "demo": "Identify a simulated recording, compare with the truth and draw the paper's figures.",
    "derivatives": "Differentiate a channel of FILE with a polynomial order chosen in every window.",
    "identify": "Identify inertia, damping and stiffness from the angle and torque in FILE.",
    "info": "List the channels of FILE: how many samples, their range, and what is missing.",
    "plan": "Say how long to record, which frequencies and amplitude give a wanted error, or what more of FILE would bring.",
    "live": "Identify while angle and torque are recorded: from lines on standard input, or from the Lab Streaming Layer.",
    "report": "Identify as identify does, and write a page that shows the recording and the result.",
    "simulate": "Write a simulated recording of the paper's rig, with its truth, to OUTPUT: a CSV file, or of another kind by its ending.",
}
"""Every command, a file each, and the first sentence of what it says of itself."""


class _Worker(click.Command):
    """Says what the library refuses with options, where it names arguments, and as JSON where that was asked for."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with _in_plain_words():
                return self._invoke(ctx)
        except click.ClickException as error:
            if ctx.params.get("as_json"):
                said = {"error": error.format_message(), "exit_status": error.exit_code}
                click.echo(import_module("json").dumps(said, ensure_ascii=False))
            raise

    def _invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except (ValueError, TypeError) as error:
            raise click.UsageError(_line(commands().in_options(str(error)))) from None


class _Command(click.Group):
    """Says what is wrong in one line, and never in a terminal's own language."""

    command_class = _Worker

    def make_context(self, *arguments: Any, **options: Any) -> click.Context:
        with _in_plain_words():
            return super().make_context(*arguments, **options)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            near = import_module("difflib").get_close_matches(args[0], COMMANDS, n=3)
            cure = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(COMMANDS)}"
            raise click.UsageError(f"No such command '{args[0]}'; {cure}", ctx)
        return super().resolve_command(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in COMMANDS:
            import_module(f"tvident._command_line.{cmd_name}")  # which adds it
        return super().get_command(ctx, cmd_name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def invoke(self, ctx: click.Context) -> Any:
        for stream in (sys.stdout, sys.stderr):
            # Where a terminal has no letter for a sign, its number is better than nothing.
            if isinstance(stream, TextIOWrapper):
                stream.reconfigure(errors="backslashreplace")
        with every_interrupt_heard(), _in_plain_words(), warnings.catch_warnings():
            warnings.showwarning = _show_warning
            return super().invoke(ctx)


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    click.echo(f"Warning: {commands().in_options(_line(message))}", err=True)


def _show_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:  # noqa: FBT001 - an option's value
    if wanted and not ctx.resilient_parsing:
        click.echo(import_module("tvident").__version__)
        ctx.exit()


@click.group(
    cls=_Command,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Exit status: 0, 1 where there is no usable result or a file cannot be used, 2 for a wrong call.",
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the version and exit.",
)
def main() -> None:
    """Identify inertia, damping and stiffness that change while they are measured; differentiate noisy recordings.

    Files may be text columns (CSV), NPZ, MATLAB, Parquet, HDF5, TDMS, MDF, MCAP and others. Channels are called by name, or by number
    from 0. Results go to files or standard output, messages and progress to standard error.
    """
