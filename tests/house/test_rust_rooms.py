"""The core is a house of rooms: uses run one way, from later rooms to earlier ones, and no file leads back to itself."""

from __future__ import annotations

import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from statistics import median

import pytest

RUST = Path(__file__).parents[2] / "rust"
HOUSE = RUST / "core" / "src"

ROOMS = (
    "error",
    "status",
    "record",
    "exec",
    "simd",
    "lanes",
    "local_polynomials",
    "noise",
    "irregular",
    "auto_derivatives",
    "least_squares",
    "equation",
    "response",
    "weak_form",
    "regression",
    "inference",
    "identify",
    "stream",
    "lib",  # the front door
)
"""Every room may use those above it. The first two are single files, which everything uses."""

TESTED = ("regression", "inference")
"""Rooms every file of which has unit tests."""
UNTESTED = {
    "regression::simulated": "rows and slow solutions that the tests of others compare with",
    "inference::jumps::simulated": "a spring that jumps, for the tests of others",
}

LONGEST_FILE = 450
MEDIAN_FILE = 200

FILES = {"::".join(path.relative_to(HOUSE).with_suffix("").parts): path for path in sorted(HOUSE.rglob("*.rs"))}
DOORS = {name for name in FILES if name.split("::")[-1] in {"mod", "lib"}}
"""Files that only say what a room is for, which files it has and what it offers."""


def room(file: str) -> str:
    """Give the room that a file is in."""
    return file.split("::", maxsplit=1)[0]


def code(file: str) -> str:
    """Give a file's code without comments, and without its unit tests, which may use what they like."""
    text = re.sub(r"//.*", "", FILES[file].read_text(encoding="utf-8"))
    return re.sub(r"^#\[cfg\(test\)\]\n(pub\(crate\) )?mod \w+ \{\n.*?^\}\n", "", text, flags=re.MULTILINE | re.DOTALL)


def leaves(tree: str) -> list[str]:
    """Give the paths of a use tree: `a::{b, c::{d, e}}` is `a::b`, `a::c::d` and `a::c::e`."""
    stem, brace, rest = tree.strip().partition("{")
    if not brace:
        return [stem.split(" as ")[0].strip()]
    depth, branches = 0, [""]
    for letter in rest.rstrip()[:-1]:
        depth += {"{": 1, "}": -1}.get(letter, 0)
        if letter == "," and depth == 0:
            branches.append("")
        else:
            branches[-1] += letter
    return [stem + leaf for branch in branches if branch.strip() for leaf in leaves(branch)]


def used(file: str) -> set[str]:
    """Give the paths inside the crate that a file uses, in `use` lines and anywhere else."""
    text = code(file)
    trees = re.findall(r"\buse (crate::[^;]*);", text)
    inline = re.findall(r"\bcrate(?:::\w+)+", re.sub(r"\buse crate::[^;]*;", "", text))
    return {leaf.removeprefix("crate::") for tree in trees for leaf in leaves(tree)} | {
        path.removeprefix("crate::") for path in inline
    }


def file_of(path: str) -> str | None:
    """Give the file that holds what a path names, or None if it names no file's item."""
    parts = path.split("::")
    names = ("::".join(parts[:end]) for end in range(len(parts), 0, -1))
    return next((name for name in names if name in FILES), None)


def arrows(file: str) -> set[str]:
    """Give the files that a file uses."""
    return {name for path in used(file) if (name := file_of(path)) is not None} - {file}


ARROWS = {file: arrows(file) for file in FILES}


def test_a_use_tree_has_all_its_leaves() -> None:
    assert leaves("crate::a::{self, b as c, d::{e, f}}") == [
        "crate::a::self",
        "crate::a::b",
        "crate::a::d::e",
        "crate::a::d::f",
    ]


def test_every_file_is_in_a_room() -> None:
    assert {room(file) for file in FILES} == set(ROOMS)


@pytest.mark.parametrize("file", ARROWS)
def test_uses_name_the_file_that_holds_what_they_use(file: str) -> None:
    assert not {path for path in used(file) if file_of(path) is None}, "use crate::room::file::Name"
    assert "super::" not in code(file)


@pytest.mark.parametrize("file", ARROWS)
def test_uses_run_one_way(file: str) -> None:
    backwards = {name for name in ARROWS[file] if ROOMS.index(room(name)) > ROOMS.index(room(file))}
    assert not backwards, f"{file} uses rooms behind it"


@pytest.mark.parametrize("name", ROOMS[:-1])
def test_no_file_of_a_room_leads_back_to_itself(name: str) -> None:
    graph = {file: ARROWS[file] for file in ARROWS if room(file) == name}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"uses in a circle: {' -> '.join(error.args[1])}")


def test_no_file_of_the_binding_leads_back_to_itself() -> None:
    texts = {
        path.stem: path.read_text(encoding="utf-8")
        for path in (RUST / "python" / "src").glob("*.rs")
        if path.stem != "lib"
    }
    graph = {name: set(re.findall(r"\bcrate::(\w+)", text)) - {name} for name, text in texts.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"uses in a circle: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize("door", sorted(DOORS))
def test_a_door_holds_its_purpose_its_files_and_what_it_offers(door: str) -> None:
    text = FILES[door].read_text(encoding="utf-8")
    rest = re.sub(
        r"^(//!.*|#!\[doc = .*\]|\s*///.*|#\[cfg\(test\)\]|(pub(\(crate\))? )?mod \w+;|(pub )?use [^;]*;)\n",
        "",
        text,
        flags=re.MULTILINE,
    )
    assert not rest.strip()


@pytest.mark.parametrize("file", [file for file in FILES if file != "lib"])
def test_every_file_begins_with_its_purpose(file: str) -> None:
    words = re.match(r"(?://! .*\n)+", FILES[file].read_text(encoding="utf-8"))
    purpose = words[0].replace("\n//!", "").removeprefix("//! ") if words else ""
    assert re.match(r"[A-Z`].{15,}?[.:?]", purpose), "a sentence that says what the file is for"


@pytest.mark.parametrize("file", [file for file in FILES if room(file) in TESTED and file not in DOORS])
def test_every_file_that_decides_or_estimates_has_unit_tests(file: str) -> None:
    text = FILES[file].read_text(encoding="utf-8")
    tests = re.search(
        r"^#\[cfg\(test\)\]\n(?:pub\(crate\) )?mod tests \{\n.*#\[test\]", text, flags=re.MULTILINE | re.DOTALL
    )
    assert (tests is not None) != (file in UNTESTED)


def test_files_are_short() -> None:
    """Functions are measured by clippy, as `clippy.toml` says."""
    sources = [path for folder in (HOUSE, RUST / "python" / "src") for path in folder.rglob("*.rs")]
    lines = {str(path.relative_to(RUST)): path.read_text(encoding="utf-8").count("\n") for path in sources}
    assert not {file: count for file, count in lines.items() if count > LONGEST_FILE}
    assert median(lines.values()) <= MEDIAN_FILE


def test_no_two_types_have_one_name() -> None:
    definition = re.compile(r"^(?:pub(?:\(crate\))? )?(?:struct|enum|trait) (\w+)", flags=re.MULTILINE)
    names = [name for file in FILES for name in definition.findall(code(file))]
    assert sorted(names) == sorted(set(names))


def test_unsafe_code_stands_where_the_design_says() -> None:
    design = (RUST.parent / "DESIGN.md").read_text(encoding="utf-8")
    section = design.partition("**Where `unsafe` stands.**")[2].partition("\n**")[0]
    listed = set(re.findall(r"^\| `(.+?\.rs)`", section, flags=re.MULTILINE))
    found = {
        str(path.relative_to(folder))
        for folder in (HOUSE, RUST)
        for path in folder.rglob("*.rs")
        if (folder is HOUSE or HOUSE not in path.parents)
        and re.search(r"\bunsafe (?:\{|impl)", path.read_text("utf-8"))
    }
    assert found == listed
