"""The command ``tvident``, and what it says when something is wrong."""

from __future__ import annotations

import errno
from typing import Any

import click

from tvident import recordings


class _Command(click.Group):
    """Turns what the library and files raise into one line and an exit status: 2 for misuse, 1 for what cannot be read, written or done."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except (click.exceptions.Exit, click.Abort):
            raise
        except recordings.FileError as error:
            raise click.ClickException(str(error)) from None
        except KeyError as error:
            raise click.UsageError(str(error.args[0])) from None
        except (ValueError, TypeError, ImportError) as error:
            raise click.UsageError(str(error)) from None
        except MemoryError:
            raise click.ClickException(
                "the work needs more memory than there is; cut the recording into pieces, or ask for every --step-th result"
            ) from None
        except RuntimeError as error:
            raise click.ClickException(str(error)) from None
        except OSError as error:
            if error.errno == errno.EPIPE:
                raise  # whoever reads the output has had enough: click ends without a word
            raise click.ClickException(f"{error.filename or 'the output'}: {error.strerror}") from None


@click.group(cls=_Command, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(package_name="tvident", message="%(version)s")
def main() -> None:
    """Identify inertia, damping and stiffness that change while they are measured; differentiate noisy recordings.

    Files may be text columns (CSV), NPY, NPZ or MATLAB. Channels are called by name, or by number from 0. Results go to files or standard
    output, messages and progress to standard error.
    """
