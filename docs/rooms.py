"""Write what DESIGN.md shows of the rooms, from the sources: the tables of rooms, and who uses whom. ``make rooms``."""

import ast
import itertools
import sys
from collections.abc import Sequence
from pathlib import Path

from house import test_python_rooms, test_rust_rooms

ROOT = Path(__file__).parents[1]
BOX, ROW, MARGIN = 160, 34, 12
ROOMS = ("Room", "What happens there", "Files")
HEAD = """<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="13">
<defs>
<marker id="arrow" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto"><path d="M0 0L8 4L0 8z"/></marker>
</defs>
<rect width="100%" height="100%" fill="white"/>"""


def used_rooms() -> set[tuple[str, str]]:
    """Return who uses whom in the core: pairs of rooms."""
    house = test_rust_rooms
    pairs = {(house.room(file), house.room(other)) for file, others in house.ARROWS.items() for other in others}
    return {(user, used) for user, used in pairs if user != used}


def picture(rooms: Sequence[str], uses: set[tuple[str, str]]) -> str:
    """Return rooms below each other: arrows on the right lead to earlier rooms, those on the left, in red, to later ones."""
    left = max(
        [rooms.index(used) - rooms.index(user) for user, used in uses if used not in rooms[: rooms.index(user)]] + [0]
    )
    start = MARGIN + left * ROW // 2
    width, height = start + BOX + (len(rooms) - 1) * ROW // 2 + 2 * MARGIN, len(rooms) * ROW + MARGIN
    lines = [HEAD.format(width=width, height=height)]
    for row, name in enumerate(rooms):
        top = MARGIN + row * ROW
        lines.append(f'<rect x="{start}" y="{top}" width="{BOX}" height="22" rx="4" fill="#eef2f6" stroke="#8899aa"/>')
        lines.append(f'<text x="{start + BOX // 2}" y="{top + 15}" text-anchor="middle">{name}</text>')
    for user, used in sorted(uses, key=lambda pair: (rooms.index(pair[0]), rooms.index(pair[1]))):
        apart = rooms.index(user) - rooms.index(used)
        side, colour = (start + BOX, "#5577aa") if apart > 0 else (start, "#cc3322")
        leaves, arrives = (MARGIN + rooms.index(name) * ROW + shift for name, shift in ((user, 8), (used, 15)))
        bend = f"{abs(apart) * ROW // 2} {abs(leaves - arrives) // 2}"
        path = f"M{side} {leaves}A{bend} 0 0 0 {side} {arrives}"
        lines.append(
            f'<path d="{path}" fill="none" stroke="{colour}" marker-end="url(#arrow)"><title>{user} uses {used}</title></path>'
        )
    return "\n".join([*lines, "</svg>"]) + "\n"


def core_rooms() -> str:
    """Return the table of the core's rooms."""
    files = test_rust_rooms.FILES
    rows = []
    for room in test_rust_rooms.ROOMS[:-1]:  # the last is the crate's front door
        purpose = _comment(files.get(f"{room}::mod", files.get(room, Path())))
        names = [name.partition("::")[2] for name in files if test_rust_rooms.room(name) == room]
        inside = sorted({name.replace("::", "/") for name in names if name.split("::")[-1] not in {"", "mod"}})
        rows.append((f"`{room}/`" if inside else f"`{room}.rs`", purpose, _together(inside)))
    return _table(ROOMS, rows)


def python_rooms() -> str:
    """Return the table of the package's rooms."""
    files = test_python_rooms.FILES
    rows = []
    for room in test_python_rooms.ROOMS:
        module = room if room == "tvident" else f"tvident.{room}"
        purpose = (ast.get_docstring(ast.parse(files[module].read_text(encoding="utf-8"))) or "").splitlines()[0]
        inside = sorted(name.split(".")[-1] for name in files if name.startswith(f"tvident.{room}."))
        place = "__init__.py" if room == "tvident" else f"{room}/" if inside else f"{room}.py"
        rows.append((f"`{place}`", purpose.replace("``", "`"), _together(inside)))
    return _table(ROOMS, rows)


def binding() -> str:
    """Return the table of the binding's files."""
    files = sorted((test_rust_rooms.RUST / "python" / "src").glob("*.rs"))
    return _table(["File", "What it is"], [(f"`{path.name}`", _comment(path)) for path in files])


def design(page: str) -> str:
    """Return DESIGN.md with its tables made anew."""
    for name, content in (("core", core_rooms()), ("binding", binding()), ("package", python_rooms())):
        before, begin, rest = page.partition(f"<!-- rooms of the {name}: `make rooms` -->\n")
        _, end, after = rest.partition("<!-- end -->")
        page = f"{before}{begin}\n{content}\n{end}{after}"
    return page


def drawing() -> str:
    """Return the picture of the core's rooms as they are."""
    rooms = [room for room in test_rust_rooms.ROOMS if room != "lib"]
    return picture(rooms, {pair for pair in used_rooms() if "lib" not in pair})


def _comment(path: Path) -> str:
    """Return the first sentence of a file of the core."""
    lines = itertools.takewhile(lambda line: line.startswith("//! "), path.read_text(encoding="utf-8").splitlines())
    words = " ".join(line.removeprefix("//! ") for line in lines)
    return words.partition(". ")[0].rstrip(".") + "."


def _together(files: list[str]) -> str:
    """Return files in a cell, those of a folder after its name."""
    plain = [name for name in files if "/" not in name]
    folders = sorted({name.rpartition("/")[0] for name in files if "/" in name})
    cells = [", ".join(plain)] if plain else []
    cells += [
        f"`{folder}/`: " + ", ".join(n.rpartition("/")[2] for n in files if n.rpartition("/")[0] == folder)
        for folder in folders
    ]
    return "; ".join(cells)


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [headings, ["-"] * len(headings), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    page = ROOT / "DESIGN.md"
    page.write_text(design(page.read_text(encoding="utf-8")), encoding="utf-8")
    Path(sys.argv[1]).write_text(drawing(), encoding="utf-8")
