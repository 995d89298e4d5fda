"""The command ``tvident completion``."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from tvident._command_line.fish import Fish
from tvident._command_line.group import main

_FILES = {"bash": "~/.bashrc", "zsh": "~/.zshrc", "fish": "~/.config/fish/completions/tvident.fish"}


@main.command(epilog='Example: eval "$(tvident completion bash)", in ~/.bashrc')
@click.argument("shell", type=click.Choice(list(_FILES)))
def completion(shell: str) -> None:
    """Print what makes a shell complete names and options.

    Add it to what the shell reads when it begins: ~/.bashrc for bash, ~/.zshrc for zsh, ~/.config/fish/completions/tvident.fish for fish.
    """
    kind = Fish if shell == Fish.name else get_completion_class(shell)
    if kind is None:
        raise click.UsageError(f"click knows no completion for {shell}; install a newer one")
    # Not the version of the shell, which click would look for: bash may not even be there.
    made = kind(main, {}, "tvident", "_TVIDENT_COMPLETE")
    click.echo(made.source_template % made.source_vars())
