"""Puts a page together and writes it."""

from __future__ import annotations

import html
import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Any

from tvident._files import printable, replaced
from tvident._report.content import ShownResult, content_of
from tvident._report.packed import Packed, Series, in_words, packed, text_of
from tvident._report.several import ShownList, content_of_list

_LONGEST_TITLE = 200

_SOURCES = ("page.html", "page.css", "series.js", "page.js")
"""What the page is made of, in this folder."""


def check_plotly() -> Path:
    """Return where the drawing library of the page is; say what to install where it is not."""
    found = find_spec("plotly")
    for folder in (found.submodule_search_locations or []) if found is not None else []:
        script = Path(folder) / "package_data" / "plotly.min.js"
        if script.is_file():
            return script
    raise ImportError("reports need plotly, which is not installed; install it with: pip install 'tvident[report]'")


@cache
def _plotly(place: Path) -> str:
    """Return the drawing library, compressed once: it is the same in every page. Higher levels take twice as long for 4 % of it."""
    return text_of(place.read_bytes(), level=4, strategy=0)


def write_report(path: str | Path, shown: ShownResult, recorded: list[Series], title: str | None) -> None:
    """Write a page that shows a result, its channels, and recorded and predicted torque; it appears whole or not at all."""
    _write(path, lambda shortened: content_of(shown, recorded, shortened), title)


def write_list(path: str | Path, shown: ShownList, title: str | None) -> None:
    """Write a page that shows several records, one after the other."""
    _write(path, lambda shortened: content_of_list(shown, shortened), title)


def _write(
    path: str | Path, content_in: Callable[[str], tuple[dict[str, Any], list[Series]]], title: str | None
) -> None:
    """Write a page whose content follows from its title, by default the name of the file."""
    place = check_plotly()
    with ThreadPoolExecutor(1) as beside:
        plotly = beside.submit(_plotly, place)
        content, series = content_in(printable(title or Path(path).stem, _LONGEST_TITLE))
        parts = packed(series)
        pieces = _pieces(content, parts, plotly.result())
    with replaced(Path(path)) as file:
        file.writelines(piece.encode() for piece in pieces)


def _pieces(content: dict[str, Any], parts: list[Packed], plotly: str) -> list[str]:
    """Return the page in pieces: what is seen first comes first."""
    content["series"] = [part.about for part in parts]
    content["detail"] = in_words(parts)
    # A name may end the script that holds it.
    plain = json.dumps(content, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")
    folder = files("tvident._report")
    html_source, style, *scripts = ((folder / name).read_text(encoding="utf-8") for name in _SOURCES)
    page = Template(html_source).substitute(
        title=html.escape(content["title"]),
        verdict=html.escape(content["verdict"]),
        summary=html.escape(content["summary"]),
        style=style,
        content=plain,
        script="".join(scripts),
    )
    before, after = page.split("<!-- series -->")
    pieces = [before, _kept("plotly", plotly)]
    pieces += [_kept(f"extremes-{number}", part.extremes) for number, part in enumerate(parts)]
    pieces += [_kept(f"levels-{number}", part.levels) for number, part in enumerate(parts)]
    return [*pieces, after]


def _kept(name: str, text: str) -> str:
    return f'<script type="text/plain" id="{name}">{text}</script>\n'
