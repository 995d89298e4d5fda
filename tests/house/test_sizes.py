"""Files and functions are small enough to be read at once, or say beside them why not."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from statistics import median

import pytest

ROOT = Path(__file__).parents[2]

LONGEST_FILE, MEDIAN_FILE = 450, 200
LONGEST_FUNCTION = 80
"""Lines of a function, without its docstring."""
MOST_PARAMETERS = 7
"""Parameters of a function, without self. A comment in the line above says why there are more: users' own options, say."""

SOURCES = {
    "package": sorted((ROOT / "python").rglob("*.py")),
}
FILES = [path for paths in SOURCES.values() for path in paths]
SHORT = SOURCES | {"tests": sorted((ROOT / "tests").rglob("*.py"))}
"""Tests are read as the package is; what they are given and check may take more lines of a function."""
STUBS = sorted((ROOT / "python").rglob("*.pyi"))


def lines(path: Path) -> list[str]:
    return path.read_text(encoding="utf-8").splitlines()


@cache
def nodes(path: Path) -> list[ast.AST]:
    return list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def functions(path: Path) -> Iterator[ast.FunctionDef]:
    for node in nodes(path):
        if isinstance(node, ast.FunctionDef):
            yield node


def length(function: ast.FunctionDef) -> int:
    """Give the lines of a function without its docstring."""
    first = function.body[0]
    documented = ast.get_docstring(function) is not None
    docstring = (first.end_lineno or 0) - first.lineno + 1 if documented else 0
    return (function.end_lineno or 0) - function.lineno + 1 - docstring


def parameters(function: ast.FunctionDef) -> int:
    names = [one.arg for one in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)]
    return sum(name not in {"self", "cls"} for name in names)


def has_reason(path: Path, function: ast.FunctionDef) -> bool:
    """Return whether a comment stands above the function."""
    first = min([function.lineno, *(decorator.lineno for decorator in function.decorator_list)])
    return lines(path)[first - 2].strip().startswith("#")


@pytest.mark.parametrize("sources", SHORT)
def test_files_are_short(sources: str) -> None:
    counts = {path: len(lines(path)) for path in SHORT[sources]}
    assert not {str(path): count for path, count in counts.items() if count > LONGEST_FILE}
    assert median(counts.values()) <= MEDIAN_FILE


def test_stubs_are_short() -> None:
    assert not {path.name: count for path in STUBS if (count := len(lines(path))) > LONGEST_FILE}


def test_parts_of_the_stub_are_told_to_nobody_but_the_stub() -> None:
    """They name modules that are not there when the program runs: what they hold is imported from `tvident._core`."""
    sources = [
        path for folder in ("python", "tests", "benches", "docs", "examples") for path in (ROOT / folder).rglob("*.py")
    ]
    others = [path for path in sources if path != Path(__file__)]
    assert not [str(path) for path in others if "_core_stubs" in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("folder", ["tests", "benches", "docs", "examples"])
def test_functions_beside_the_package_have_few_parameters_or_say_why_not(folder: str) -> None:
    for path in sorted((ROOT / folder).rglob("*.py")):
        many = [one for one in functions(path) if parameters(one) > MOST_PARAMETERS]
        assert not [one.name for one in many if not has_reason(path, one)], path


def test_no_two_types_have_one_name() -> None:
    found: dict[str, set[str]] = {}
    for path in FILES:
        for node in nodes(path):
            alias = isinstance(node, ast.AnnAssign) and ast.unparse(node.annotation) == "TypeAlias"
            name = node.name if isinstance(node, ast.ClassDef) else ast.unparse(node.target) if alias else ""  # type: ignore[attr-defined] # an alias has one
            # Arrays of numbers are the same everywhere: each file says which numbers.
            if name.strip("_") not in {"", "Array", "Numbers"}:
                found.setdefault(name.strip("_"), set()).add(str(path.relative_to(ROOT)))
    assert not {name: places for name, places in found.items() if len(places) > 1}


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_functions_are_short_or_say_why_not(path: Path) -> None:
    long = [one for one in functions(path) if length(one) > LONGEST_FUNCTION or parameters(one) > MOST_PARAMETERS]
    assert not [one.name for one in long if not has_reason(path, one)]
