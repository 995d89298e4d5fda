"""Settings from files: those of an earlier result as JSON, TOML or in the result itself, and options that are written down as TOML."""

from __future__ import annotations

import json
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

import click

import tvident
from tvident import recordings
from tvident._arguments import nearest
from tvident._files import TABLE_ENDINGS, keeps_result, printable, settings_beside

_MOST_BYTES = 100_000_000
"""Of settings, which are some lines for every record of a batch."""


def read_settings(path: str) -> dict[str, Any]:
    """Return what an earlier run chose, or what a TOML file holds."""
    place = printable(path)
    cure = "give a result, a file that --settings-output wrote, or options as TOML"
    ending = Path(path).suffix.lower()
    if keeps_result(path):
        result = tvident.load(path)
        if isinstance(result, tvident.IdentifiedRecords):
            raise recordings.FileError(
                f"{place}: settings must be those of one result; it holds a list of {len(result)}; save one of them: result[0].save(…)"
            )
        found: dict[str, Any] = result.settings
        return found
    kind = Path(path).stat()
    # A pipe is not opened: that waits for who writes into it.
    is_file = stat.S_ISREG(kind.st_mode)
    if is_file and ending in TABLE_ENDINGS and not _begins_as_json(path):
        return settings_beside(Path(path))
    if not is_file or kind.st_size > _MOST_BYTES:
        raise recordings.FileError(f"{place}: settings must be a file of at most {_MOST_BYTES} bytes; {cure}")
    try:
        text = Path(path).read_text(encoding="utf-8")
        # Also what --settings-output wrote to a file of this name.
        is_toml = ending == ".toml" and not text.lstrip().startswith("{")
        content = tomllib.loads(text) if is_toml else json.loads(text)
    except (ValueError, RecursionError) as error:
        raise recordings.FileError(f"{place}: holds no settings{_where(error)}; {cure}") from None
    if not isinstance(content, dict):
        raise recordings.FileError(f"{place}: holds no settings; {cure}")
    if content.keys() == {"table", "sha256", "settings"}:
        return settings_beside(Path(path))
    return content


def _where(error: Exception) -> str:
    """Return where a text stops to be JSON or TOML, as far as an error says so."""
    if isinstance(error, json.JSONDecodeError):
        return f": it is no JSON from line {error.lineno}, column {error.colno} on"
    if isinstance(error, RecursionError):
        return ": brackets are nested too deeply"
    found = re.search(r"at line (\d+), column (\d+)", str(error))
    return f": it is no TOML from line {found[1]}, column {found[2]} on" if found else ""


def _begins_as_json(path: str) -> bool:
    """Return whether a file that is called a table is what --settings-output wrote."""
    with Path(path).open("rb") as file:
        return file.read(64).lstrip().startswith(b"{")


def options_from_toml(ctx: click.Context, path: str) -> str | None:
    """Take what a TOML file holds for the options that are not given; return its path if it holds settings of an earlier result."""
    content = read_settings(path)
    if {"form", "kinds"} <= content.keys():
        return path
    content = _of_command(ctx, content)
    known = {name.lstrip("-"): one for one in ctx.command.params for name in (*one.opts, *one.secondary_opts)}
    foreign = [name for name in content if name.replace("_", "-") not in known or name == "settings"]
    if foreign:
        names = sorted(name for name in known if len(name) > 1)
        near = nearest(foreign[0].replace("_", "-"), names)
        raise click.UsageError(
            f"{printable(path)} must hold options of tvident {ctx.command.name}, without dashes before them; got {foreign[0]!r}; "
            f"{f'{near} Others are' if near else 'use'} {', '.join(names)}"
        )
    values = {known[name.replace("_", "-")]: value for name, value in content.items()}
    ctx.default_map = {one.name or "": _as_typed(one, value) for one, value in values.items()}
    return None


def _of_command(ctx: click.Context, content: dict[str, Any]) -> dict[str, Any]:
    """Return what a file holds for a command, whose table may bear its name, as [identify]; tables of others are theirs."""
    above = ctx.parent
    group = above.command if above is not None else None
    commands = group.list_commands(above) if isinstance(group, click.Group) and above is not None else []
    own = content.get(ctx.command.name or "")
    rest = {name: one for name, one in content.items() if not (name in commands and isinstance(one, dict))}
    return {**rest, **own} if isinstance(own, dict) else rest


def _as_typed(option: click.Parameter, value: Any) -> Any:
    """Return a value as it would be typed, where the option takes text; one value of an option that may be repeated is a list of one."""
    _check_fits(option, value)
    if option.multiple and not isinstance(value, list):
        value = [value]
    if isinstance(value, list):
        return [_text(option, one) for one in value]
    return _text(option, value)


def _check_fits(option: click.Parameter, value: Any) -> None:
    """Refuse what would be read as something else: yes and no for a number or a name, and a list or a table for one of them."""
    several = option.multiple or option.nargs != 1
    each = value if isinstance(value, list) and several else [value]
    is_flag = isinstance(option, click.Option) and option.is_flag
    wrong = next((one for one in each if isinstance(one, dict | list) or (isinstance(one, bool) and not is_flag)), None)
    if wrong is None:
        return
    what = "a list" if isinstance(wrong, list) else "a table" if isinstance(wrong, dict) else json.dumps(wrong)
    name = max(option.opts, key=len).lstrip("-")
    words = option.type.choices if isinstance(option.type, click.Choice) else ["text"]
    example = "5" if option.type.name in {"float", "integer"} else json.dumps(words[0])
    raise click.UsageError(
        f"{name} must be one number or text{' or a list of them' * several}; got {what}; write {name} = {example}"
    )


def _text(option: click.Parameter, value: Any) -> Any:
    return str(value) if option.type is click.STRING and not isinstance(value, bool | list) else value
