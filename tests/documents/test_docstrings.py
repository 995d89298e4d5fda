"""Examples in docstrings run, and the public ones say all that is needed."""

from __future__ import annotations

import doctest
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import matplotlib as mpl
import pytest
from matplotlib import pyplot as plt

import tvident
from tvident import baselines, figures, recordings
from tvident import dask as daskwise

MODULES = [import_module(module.name) for module in pkgutil.walk_packages(tvident.__path__, "tvident.")]

# What users call beside the names in `tvident` itself.
MORE = [recordings.read, recordings.channel, recordings.FileError, recordings.FileWarning]
FILES = [*MORE, tvident.load, tvident.read_recording, tvident.FileRecording, tvident.Channel]
"""What reads files, and computes nothing."""
BASELINES = [getattr(baselines, name) for name in baselines.__all__]
DASK = [getattr(daskwise, name) for name in daskwise.__all__]
ELSEWHERE = [*BASELINES, *DASK]
"""Methods whose equations and costs are not ours, and what passes arrays on: their sources have them."""
DRAWING = [function for name, function in vars(figures).items() if name.startswith(("plot_", "paper_figure_"))]
PUBLIC = [getattr(tvident, name) for name in tvident.__all__] + MORE + DRAWING + ELSEWHERE
FUNCTIONS = [one for one in PUBLIC if inspect.isfunction(one)]
CLASSES = [one for one in PUBLIC if inspect.isclass(one)]


def members() -> dict[str, tuple[Callable[..., Any], str]]:
    """Give methods and properties of public classes, inherited ones too: by name, with the annotation of what they return."""
    found: dict[str, tuple[Callable[..., Any], str]] = {}
    for one in CLASSES:
        for name in dir(one):
            member = inspect.getattr_static(one, name)
            function = getattr(member, "fget", None) or getattr(member, "func", None) or member
            function = getattr(function, "__func__", function)
            if not name.startswith("_") and inspect.isfunction(function) and function.__module__.startswith("tvident"):
                found[f"{one.__qualname__}.{name}"] = function, str(function.__annotations__.get("return", ""))
    return found


MEMBERS = members()
COMPUTING = {
    *("at", "stderr_at", "excitation", "simulate", "vaf", "predicted_torque", "held_back", "scan", "value", "trusted"),
    *("natural_frequency", "damping_ratio", "modes", "stderr", "scores", "push", "regressors", "dynamics", "values"),
}
"""Methods and properties that compute something, and so have a source."""
UNIT = re.compile(r"\b(Hz|rad|N|N m|seconds|percent|without unit|unit|units)\b")


def examples() -> Iterator[doctest.DocTest]:
    for module in MODULES:
        yield from (test for test in doctest.DocTestFinder(exclude_empty=True).find(module) if test.examples)


def section(documented: Any, name: str) -> str:
    """Give a section of a docstring, or nothing."""
    text = inspect.getdoc(documented) or ""
    found = re.search(rf"^{name}\n-+\n(.*?)(?=^[\w ]+\n-+\n|\Z)", text, re.MULTILINE | re.DOTALL)
    return found[1] if found else ""


def named(things: list[Any]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("documented", things, ids=[thing.__qualname__ for thing in things])


@pytest.mark.parametrize("example", list(examples()), ids=lambda example: example.name)
def test_examples_run(example: doctest.DocTest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mpl.use("agg")
    monkeypatch.chdir(tmp_path)
    report: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    outcome = runner.run(example, out=report.append, clear_globs=False)
    plt.close("all")
    assert outcome.failed == 0, "".join(report)
    assert outcome.attempted > 0


@named(PUBLIC)
def test_everything_public_has_an_example(documented: Any) -> None:
    assert ">>> " in section(documented, "Examples")


@named(PUBLIC)
def test_everything_public_says_what_else_to_see(documented: Any) -> None:
    assert section(documented, "See Also")


@pytest.mark.parametrize("member", MEMBERS)
def test_methods_and_properties_say_what_they_are_and_what_else_to_see(member: str) -> None:
    function, _ = MEMBERS[member]
    text = inspect.getdoc(function) or ""
    assert re.match(r"[A-Z].{10,}[.:]$", text.split("\n\n")[0], re.DOTALL), "begin with a sentence"
    assert section(function, "See Also")


@pytest.mark.parametrize(
    "member", [one for one in MEMBERS if one.split(".")[1] in COMPUTING and one.split(".")[0] != "DaskIdentification"]
)
def test_methods_and_properties_that_compute_name_their_source(member: str) -> None:
    assert section(MEMBERS[member][0], "References")


@pytest.mark.parametrize("member", [one for one, (_, returned) in MEMBERS.items() if "Array" in returned])
def test_methods_and_properties_say_the_shape_of_arrays(member: str) -> None:
    assert "shape" in (inspect.getdoc(MEMBERS[member][0]) or "")


@pytest.mark.parametrize("member", [one for one, (_, returned) in MEMBERS.items() if re.search(r"\bfloat\b", returned)])
def test_methods_and_properties_say_the_unit_of_numbers(member: str) -> None:
    assert UNIT.search(inspect.getdoc(MEMBERS[member][0]) or "")


@named(PUBLIC)
def test_everything_public_names_its_source(documented: Any) -> None:
    assert section(documented, "References")


def test_the_name_of_a_type_says_what_all_others_say() -> None:
    # An alias has no docstring of its own at run time: it stands in the source, and its example is run from there.
    module = import_module("tvident._files.channels")
    text = re.search(r'^Channels = [^\n]*\n"""(.*?)"""', inspect.getsource(module), re.MULTILINE | re.DOTALL)
    assert text
    assert all(f"\n{name}\n---" in text[1] for name in ("See Also", "References", "Examples"))
    example = doctest.DocTestParser().get_doctest(text[1], {}, "Channels", None, None)
    assert doctest.DocTestRunner().run(example).failed == 0


@named(FUNCTIONS)
def test_functions_say_what_goes_in_and_comes_out(documented: Callable[..., Any]) -> None:
    parameters = section(documented, "Parameters")
    described = {name for line in re.findall(r"^(\w[\w, ]*) : ", parameters, re.MULTILINE) for name in line.split(", ")}
    assert described == set(inspect.signature(documented).parameters)
    assert section(documented, "Returns")
    assert "shape" in parameters + section(documented, "Returns") or documented in (
        *DRAWING,
        recordings.read,
        tvident.read_recording,
    )
    assert section(documented, "Raises")


@named([one for one in FUNCTIONS if one not in {*FILES, *DRAWING, *ELSEWHERE}])
def test_functions_that_compute_say_their_equation_and_cost(documented: Callable[..., Any]) -> None:
    text = inspect.getdoc(documented) or ""
    assert re.search(r"[Ee]quations? \(", text)
    assert section(documented, "References")
    assert re.search(r"\bcosts?\b.* (ns|µs) a (sample|row)", section(documented, "Notes"), re.DOTALL)


@named(CLASSES)
def test_classes_describe_every_attribute_and_method(documented: type) -> None:
    for name, member in vars(documented).items():
        if not name.startswith("_") and (callable(member) or hasattr(member, "__doc__")):
            text = inspect.getdoc(inspect.getattr_static(documented, name)) or ""
            field = re.search(rf"^[\w, ]*\b{name}\b[\w, ]* : ", inspect.getdoc(documented) or "", re.MULTILINE)
            assert text or field, name
    for name, method in inspect.getmembers(documented, inspect.isfunction):
        if not name.startswith("_") and method.__module__.startswith("tvident"):
            parameters = set(inspect.signature(method).parameters) - {"self"}
            assert not parameters or section(method, "Parameters") or section(method, "Raises"), name


def test_every_module_says_what_it_is() -> None:
    modules: list[ModuleType] = [tvident, *MODULES]
    assert all(module.__doc__ for module in modules if module.__name__ != "tvident._core")
