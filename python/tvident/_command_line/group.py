"""The command ``tvident``, and what it says when something is wrong."""

from __future__ import annotations

import errno
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOWrapper
from typing import Any

import click

from tvident import recordings
from tvident._files import printable

_LONGEST_LINE = 1500
"""Characters of a message."""


@contextmanager
def _in_plain_words() -> Iterator[None]:
    """Turn what the library and files raise into one line and an exit status: 2 for misuse, 1 for what cannot be read, written or done."""
    try:
        yield
    except click.ClickException as error:
        # Names of files and channels are part of messages, and may hold what a terminal obeys.
        error.message = "\n".join(printable(line, _LONGEST_LINE) for line in error.message.split("\n"))
        raise
    except (click.exceptions.Exit, click.Abort):
        raise
    except recordings.FileError as error:
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
        place = "the output" if error.filename is None else printable(error.filename)
        raise click.ClickException(f"{place}: {_line(error.strerror)}") from None


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


def _line(message: object) -> str:
    return printable(message, _LONGEST_LINE)


class _Command(click.Group):
    """Says what is wrong in one line, and never in a terminal's own language."""

    def make_context(self, *arguments: Any, **options: Any) -> click.Context:
        with _in_plain_words():
            return super().make_context(*arguments, **options)

    def invoke(self, ctx: click.Context) -> Any:
        for stream in (sys.stdout, sys.stderr):
            # Where a terminal has no letter for a sign, its number is better than nothing.
            if isinstance(stream, TextIOWrapper):
                stream.reconfigure(errors="backslashreplace")
        with _in_plain_words(), warnings.catch_warnings():
            warnings.simplefilter("always", recordings.FileWarning)  # an error elsewhere is a word here
            warnings.showwarning = _show_warning
            return super().invoke(ctx)


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    click.echo(f"Warning: {_line(message)}", err=True)


@click.group(cls=_Command, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(package_name="tvident", message="%(version)s")
def main() -> None:
    """Identify inertia, damping and stiffness that change while they are measured; differentiate noisy recordings.

    Files may be text columns (CSV), NPZ, MATLAB, Parquet, HDF5, TDMS, MDF, MCAP and others. Channels are called by name, or by number
    from 0. Results go to files or standard output, messages and progress to standard error.
    """
