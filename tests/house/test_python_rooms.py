"""The package is a house of rooms: imports run one way, from later rooms to earlier ones, and no file leads back to itself."""

from __future__ import annotations

import ast
import re
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

HOUSE = Path(__file__).parents[2] / "python" / "tvident"

CORE = "tvident._core"
"""Everything may call it, and it calls nothing of the package."""

ROOMS = (
    "_choices",
    "_units",
    "_arguments",
    "_tables",
    "_expansion",
    "_equation",
    "_status",
    "_formats",
    "_files",
    "_huber",
    "_clocks",
    "_derivatives",
    "_regression",
    "_simulate",
    "_figures",
    "_report",
    "_results",
    "_advice",
    "_merged",
    "_identify",
    "_pieces",
    "_stream",
    "_live",
    "_compare",
    "_plan",
    "_baselines",
    "baselines",
    "_in_pieces",
    "_dask",
    "recordings",  # doors: what users import by the room's name
    "figures",
    "dask",
    "tvident",  # the front door
    "_commands",
    "_command_line",
    "__main__",
)
"""Every room may import from those above it."""

TESTS = HOUSE.parents[1] / "tests"
ELSEWHERE = {
    "_dask": "dask_arrays",  # a folder `dask` would be found in the place of the library
    "_commands": "command_line",  # what a command does is tested as users call it
}
"""Rooms whose tests stand in a folder of another name."""

FILES = {
    ".".join(("tvident", *path.relative_to(HOUSE).with_suffix("").parts)).removesuffix(".__init__"): path
    for path in sorted(HOUSE.rglob("*.py"))
}


def room(module: str) -> str:
    """Give the room that a module is in."""
    return module.split(".")[1] if "." in module else module


@cache
def imported(module: str) -> frozenset[str]:
    """Give the modules of the package that a module imports, wherever in the file, under TYPE_CHECKING too."""
    found = set()
    for node in ast.walk(ast.parse(FILES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: imports are absolute"
            names = {f"{node.module}.{alias.name}" for alias in node.names} - {CORE}
            found |= {name if name in FILES else str(node.module) for name in names}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return frozenset(name for name in found if name in FILES)


def test_every_file_is_in_a_room() -> None:
    assert {room(module) for module in FILES} == set(ROOMS)


@pytest.mark.parametrize("module", FILES)
def test_imports_run_one_way(module: str) -> None:
    backwards = {name for name in imported(module) if ROOMS.index(room(name)) > ROOMS.index(room(module))}
    assert not backwards, f"{module} imports from rooms behind it"


@pytest.mark.parametrize("module", [module for module in FILES if module.count(".") > 1])
def test_files_of_a_room_import_other_rooms_by_their_face(module: str) -> None:
    inside = {name for name in imported(module) if name.count(".") > 1 and room(name) != room(module)}
    assert not inside, "import what a room's __init__ offers"


def test_no_file_leads_back_to_itself() -> None:
    graph = {module: imported(module) for module in FILES}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"imports in a circle: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize("name", [name for name in ROOMS if name.startswith("_")])
def test_every_room_begins_with_its_purpose(name: str) -> None:
    purpose = ast.get_docstring(ast.parse(FILES[f"tvident.{name}"].read_text(encoding="utf-8"))) or ""
    first = purpose.splitlines()[0]
    assert first.endswith(".")
    assert len(first) > 20


def test_the_design_names_every_room_in_this_order() -> None:
    design = (HOUSE.parents[1] / "DESIGN.md").read_text(encoding="utf-8")
    named = [name for line in design.splitlines() for name in re.findall(r"^\| `(_\w+)/` \|", line)]
    assert named == [name for name in ROOMS if name.startswith("_") and name != "__main__"]


@pytest.mark.parametrize("name", [name for name in ROOMS if name.startswith("_") and name != "__main__"])
def test_every_room_has_a_folder_of_tests(name: str) -> None:
    folder = TESTS / ELSEWHERE.get(name, name.removeprefix("_"))
    assert list(folder.glob("test_*.py"))


def test_every_folder_of_tests_is_that_of_a_room_or_said_to_be_none() -> None:
    rooms = {ELSEWHERE.get(name, name.removeprefix("_")) for name in ROOMS}
    others = {"reference", "house", "hostile", "documents"}
    folders = {path.name for path in TESTS.iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert folders <= rooms | others
    design = (HOUSE.parents[1] / "DESIGN.md").read_text(encoding="utf-8")
    table = design.partition("### Rooms of the tests")[2].partition("###")[0]
    assert set(re.findall(r"`(\w+)/`", table.split("\n`")[0])) >= folders
