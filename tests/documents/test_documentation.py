"""What the documents show is what the program does: their code runs, their tables and numbers are its own."""

from __future__ import annotations

import inspect
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from importlib.util import module_from_spec, spec_from_file_location
from io import StringIO
from pathlib import Path
from types import ModuleType
from typing import Any

import click
import numpy as np
import numpy.typing as npt
import pytest

import tvident
from calls import paper
from commands import run
from tvident import Status, baselines, figures, recordings
from tvident import dask as dask_arrays
from tvident._command_line import main
from tvident._status import DOUBTFUL, DOUBTFUL_RECORD

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "examples").glob("*.md")])

# Numbers are printed with two to five digits, and other instructions or another order of summation change the last of them.
PRINTED = 0.02
# Errors are printed with two digits, which rounds them by up to 5 %.
MEASURED = 0.06


def named(documents: list[Path]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("document", documents, ids=[str(path.relative_to(ROOT)) for path in documents])


def blocks(document: Path) -> Iterator[tuple[str, str]]:
    """Give the language and the content of every block of code."""
    for match in re.finditer(r"^```(\w*)\n(.*?)^```$", document.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
        yield match[1], match[2]


def table(document: Path, first: str) -> list[dict[str, str]]:
    """Give the rows of the table whose first heading is given, by heading."""
    lines = document.read_text(encoding="utf-8").splitlines()
    start = next(index for index, line in enumerate(lines) if line.startswith(f"| {first} |"))
    rows = []
    for line in lines[start:]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return [dict(zip(rows[0], row, strict=True)) for row in rows[2:]]


def assert_same_words(printed: str, shown: str) -> None:
    """Compare texts: words as they are, numbers to what rounding may change."""
    number = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
    assert [part.split() for part in number.split(printed)] == [part.split() for part in number.split(shown)]
    found, expected = ([float(match) for match in number.findall(text)] for text in (printed, shown))
    np.testing.assert_allclose(found, expected, rtol=PRINTED)


@named([path for path in DOCUMENTS if any(language == "python" for language, _ in blocks(path))])
def test_python_runs_and_prints_what_is_shown(document: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "__main__"}
    printed = ""
    for language, content in blocks(document):
        if language == "python":
            output = StringIO()
            with redirect_stdout(output):
                exec(compile(content, str(document), "exec"), names)  # noqa: S102 - that is the test
            printed = output.getvalue()
        elif language == "text" and printed:
            assert_same_words(printed, content)
            printed = ""
    assert printed == "", "what is printed is shown"


@named([path for path in DOCUMENTS if any(language == "sh" for language, _ in blocks(path))])
def test_commands_run(document: Path, tmp_path: Path) -> None:
    targets = set(re.findall(r"^([a-z./-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    lines = [line for language, content in blocks(document) if language == "sh" for line in content.splitlines()]
    for line in lines:
        command = line.split("#")[0]
        match command.split():
            case ["tvident", *_] if not set(command) & set("|<>&;$`*"):
                done = run(*shlex.split(command)[1:], cwd=tmp_path)
                assert done.returncode == 0, f"{line}\n{done.stderr}"
            case ["tvident", *_]:
                done = subprocess.run(
                    ["/bin/sh", "-e", "-c", line],
                    cwd=tmp_path,
                    env=environment,
                    capture_output=True,
                    text=True,
                    check=False,
                )
                assert done.returncode == 0, f"{line}\n{done.stderr}"
            case ["make", target, *_]:
                assert target in targets or target == ".venv/.built", line
            case ["pip" | "cargo" | ".venv/bin/python", *_] | []:
                pass  # done by the tests' own set-up
            case _:
                pytest.fail(f"nobody runs this command: {line}")


@named(DOCUMENTS)
def test_links_lead_somewhere(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)]+)\)", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)):
        if target.startswith("https://"):
            continue
        path, _, anchor = target.partition("#")
        place = (document.parent / path).resolve() if path else document
        if "benches" in place.parts and not (ROOT / "benches").exists():
            continue  # the benchmarks are not part of every copy
        assert place.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", place.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings}, target


def test_links_of_the_site_that_lead_nowhere_are_found(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(
        '<h1 id="top">A</h1><a href="b.html#end">b</a><a href="#top">up</a><a href="b.html#no">x</a><a href="c.html">y</a>'
        '<img src="no.png"><a href="https://example.org/">z</a>'
    )
    (tmp_path / "b.html").write_text('<p id="end">B</p><a href="a.html">a</a>')
    wrong, elsewhere = script("links").wrong_links(tmp_path)
    assert wrong == ["a.html: b.html#no", "a.html: c.html", "a.html: no.png"]
    assert elsewhere == {"https://example.org/"}


def test_what_is_cited_is_what_the_documents_name() -> None:
    cited = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"version: {tvident.__version__}\n" in cited
    authors = re.findall(r"family-names: \"?(\w+)", cited)
    (title,) = re.findall(r"^    title: (.*)$", cited, re.MULTILINE)
    for name in ("README.md", "docs/mathematics.md"):
        page = (ROOT / name).read_text(encoding="utf-8")
        assert title in page
        assert ", ".join(f"{one}. {other}" for one, other in zip("MSD", authors, strict=True)) in page


def test_the_readme_is_read_in_three_minutes() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) <= 600


def test_the_table_of_statuses_has_every_flag() -> None:
    rows = table(ROOT / "docs" / "statuses.md", "Flag")
    assert [row["Flag"] for row in rows] == [f"`{flag.name}`" for flag in Status]
    assert all(row["What to do"] for row in rows)
    for row, flag in zip(rows, Status, strict=True):
        assert row.get("Bit", str(int(flag))) == str(int(flag))
        assert Status(flag).advice != "all is well"


def test_what_is_trusted_is_what_the_page_says() -> None:
    page = (ROOT / "docs" / "statuses.md").read_text(encoding="utf-8")
    of_samples, of_records = re.findall(r"`result\.trusted` is .* none of (.*), in a record with none of (.*)\.", page)[
        0
    ]
    for said, flags in ((of_samples, DOUBTFUL), (of_records, DOUBTFUL_RECORD)):
        assert set(re.findall(r"`(\w+)`", said)) == {flag.name for flag in Status if flag in flags}


def script(name: str) -> ModuleType:
    """Load a script of `docs`."""
    spec = spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_command_line_reference_is_what_the_commands_say() -> None:
    page = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
    assert page == script("command_line_reference").reference(), "run `make docs`"


@pytest.mark.slow
def test_the_readmes_first_table_is_measured() -> None:
    shown = table(ROOT / "README.md", "How *K*(t) is found")
    measured = [line.strip("| ").split(" | ") for line in script("comparison").table().splitlines()[2:]]
    for row, again in zip(shown, measured, strict=True):
        assert [row["How *K*(t) is found"], row["what must be chosen"]] == [again[0], again[3]]
        for cell, number in ((row["error"], again[1]), (row["with 1 % of noise"], again[2])):
            assert float(cell.rstrip("% ")) == pytest.approx(float(number.rstrip("% ")), rel=MEASURED)


@pytest.mark.slow
def test_the_splines_beside_the_readmes_table_are_measured() -> None:
    shown = table(ROOT / "docs" / "compared.md", "window")
    measured = [line.strip("| ").split(" | ") for line in script("comparison").table_of_splines().splitlines()[2:]]
    for row, again in zip(shown, measured, strict=True):
        assert [row[name] for name in ("window", "order", "pieces")] == again[:3]
        for cell, number in ((row["error"], again[3]), (row["with 1 % of noise"], again[4])):
            assert float(cell.rstrip("% ")) == pytest.approx(float(number.rstrip("% ")), rel=MEASURED)


def test_the_reference_has_every_public_name() -> None:
    page = (ROOT / "docs" / "api.rst").read_text(encoding="utf-8")
    listed = re.findall(r"^   ([\w.]+)$", page, re.MULTILINE)
    doors = {f"figures.{name}" for name in figures.__all__}
    classes_and_functions = {name for name in recordings.__all__ if name != "Channels"}  # an alias has no page
    doors |= {f"recordings.{name}" for name in classes_and_functions}
    doors |= {f"baselines.{name}" for name in baselines.__all__} | {f"dask.{name}" for name in dask_arrays.__all__}
    assert sorted(listed) == sorted({*tvident.__all__, *doors})


def test_the_rooms_in_the_design_are_those_of_the_sources() -> None:
    rooms, page = script("rooms"), (ROOT / "DESIGN.md").read_text(encoding="utf-8")
    assert page.count("`make rooms` -->") == len(["core", "binding", "package"])
    assert page == rooms.design(page), "run `make rooms`"
    assert (ROOT / "docs" / "rooms.svg").read_text(encoding="utf-8") == rooms.drawing(), "run `make rooms`"


def test_files_that_the_design_names_exist() -> None:
    named = set(re.findall(r"`([\w/]+\.(?:rs|py))`", (ROOT / "DESIGN.md").read_text(encoding="utf-8")))
    files = [path for folder in ("rust", "python", "tests") for path in (ROOT / folder).rglob("*.*")]
    assert not {name for name in named if not any(path.as_posix().endswith(f"/{name}") for path in files)}


@pytest.mark.parametrize(
    ("function", "command", "without"),
    [
        (
            tvident.identify,
            "identify",
            {"share", "ensemble_axis", "phase", "dof_axis", "structure"},
        ),  # a file is one record
        (tvident.fit_local_polynomials, "derivatives", {"y", "axis"}),
        (tvident.simulate_torsional_rig, "simulate", {"inertia", "damping", "torsional_rigidity"}),
    ],
)
def test_every_argument_has_an_option_of_its_name(function: Any, command: str, without: set[str]) -> None:
    # Commands are loaded when they are asked for.
    loaded = main.get_command(click.Context(main), command)
    assert loaded is not None
    options = {option for one in loaded.params for option in one.opts if isinstance(one, click.Option)}
    renamed = {"t": "time", "terms": "term"}
    for name in inspect.signature(function).parameters.keys() - without:
        assert f"--{renamed.get(name, name).replace('_', '-')}" in options


def errors(result: tvident.Identification, truth: tvident.Recording) -> dict[str, float]:
    """Give the rms error of each parameter, in % of its mean."""
    return {
        name: float(100 * np.sqrt(np.nanmean((getattr(result, name) - getattr(truth, name)) ** 2)))
        / float(getattr(truth, name).mean())
        for name in ("inertia", "damping", "stiffness")
    }


def call(text: str) -> dict[str, Any]:
    """Give the arguments that a cell of a table shows."""
    return dict(eval(f"dict({text.strip('`')})"))  # noqa: S307 - written by us


@pytest.mark.slow
def test_settings_have_the_errors_that_are_stated() -> None:
    rows = table(ROOT / "docs" / "settings.md", "`identify(…)`")
    for column in list(rows[0])[1:]:
        recording = tvident.simulate_torsional_rig(**({} if column == "default" else call(column)))
        for row in rows:
            settings = call(row["`identify(…)`"])
            settings = settings if "method" in settings else paper(**settings)
            result = tvident.identify(recording.angle, recording.torque, sample_rate=1000, **settings)
            assert errors(result, recording)["stiffness"] == pytest.approx(float(row[column]), rel=MEASURED)


def test_windows_have_the_errors_that_are_stated() -> None:
    recording = tvident.simulate_torsional_rig(angle_noise=0.01)
    interior = slice(300, -300)
    truth = recording.true_acceleration[interior]
    for row in table(ROOT / "docs" / "settings.md", "`window_length`"):
        fit = tvident.fit_local_polynomials(recording.angle, int(row["`window_length`"]), sample_rate=1000)
        error = 100 * float(np.sqrt(np.mean((fit.derivatives[2, interior] - truth) ** 2)) / truth.std())
        assert error == pytest.approx(float(row["error of θ̈ in %"]), rel=MEASURED)
        highest = 100 * float(np.mean(fit.status & Status.HIGHEST_ORDER != 0))
        assert highest == pytest.approx(float(row["`HIGHEST_ORDER` in %"]), rel=MEASURED, abs=0.3)
        assert np.median(fit.order) == float(row["median order"])


def test_what_the_readme_says_of_the_default_holds() -> None:
    for options, limits in (
        ({}, {"stiffness": 0.4, "inertia": 0.1, "damping": 2.5}),
        ({"angle_noise": 0.1}, {"stiffness": 1.0}),
        ({"pattern": "square"}, {"stiffness": 1.0}),
    ):
        recording = tvident.simulate_torsional_rig(**options)
        result = tvident.identify(recording.angle, recording.torque, sample_rate=1000)
        found = errors(result, recording)
        assert all(found[name] < limit for name, limit in limits.items()), found
        if not options:
            covered = np.abs(result.stiffness - recording.stiffness) < 2 * result.stderr["stiffness"]
            assert covered.mean() == pytest.approx(0.97, abs=0.03)
    recording = tvident.simulate_torsional_rig()
    late = tvident.identify(recording.angle[1:], recording.torque[:-1], sample_rate=1000)
    assert Status.LAG_SUSPECTED in late.record_status
    for seed in range(8):
        recording = tvident.simulate_torsional_rig(seed=seed)
        for samples in (600, 150):  # three cycles of some 5 Hz, and less than one
            angle, torque, stiffness = (
                values[:samples] for values in (recording.angle, recording.torque, recording.stiffness)
            )
            result = tvident.identify(angle, torque, sample_rate=1000)
            if samples == 150:
                assert Status.WINDOW_LIMIT in result.record_status
            else:
                assert result.constants["inertia"][0] == pytest.approx(0.0123, rel=0.02)
                assert np.sqrt(np.mean((result.stiffness - stiffness) ** 2)) < 0.07 * stiffness.mean()


def test_the_papers_limits_are_the_stated_ones() -> None:
    recording = tvident.simulate_torsional_rig()
    result = tvident.identify(recording.angle, recording.torque, sample_rate=1000, method="paper")
    assert errors(result, recording) == pytest.approx({"inertia": 6.5, "damping": 28, "stiffness": 7.2}, rel=MEASURED)
    clean = tvident.simulate_torsional_rig(torque_snr_db=200, angle_noise=1e-9)
    alone = tvident.identify(clean.angle, clean.torque, sample_rate=1000, method="paper")
    assert errors(alone, clean) == pytest.approx({"inertia": 6.4, "damping": 25, "stiffness": 7.0}, rel=MEASURED)
    noisy_rig = tvident.simulate_torsional_rig(angle_noise=0.1)
    pulled = tvident.identify(noisy_rig.angle, noisy_rig.torque, sample_rate=1000, method="paper")
    assert errors(pulled, noisy_rig)["stiffness"] == pytest.approx(26, rel=MEASURED)
    for found, true in ((pulled.inertia, noisy_rig.inertia), (pulled.stiffness, noisy_rig.stiffness)):
        assert np.nanmean(found / true) == pytest.approx(1 - 0.12, rel=0.01)
    # Two standard errors cover the truth in 93 % of the windows.
    covered = np.abs(result.stiffness - recording.stiffness) < 2 * result.stderr["stiffness"]
    assert covered.mean() == pytest.approx(0.93, rel=MEASURED)
    assert np.nanmedian(result.condition) == pytest.approx(15, rel=0.1)

    # Under a single sine the condition number is 1000 and more, and windows are flagged.
    omega = 2 * np.pi * 3
    t = np.arange(20_000) / 1000
    generator = np.random.default_rng(0)
    angle: npt.NDArray[np.float64] = np.sin(omega * t)
    torque = (15 - 0.0123 * omega**2) * angle + 0.00825 * omega * np.cos(omega * t)
    noisy = angle + 1e-3 * generator.standard_normal(t.size)
    single = tvident.identify(noisy, torque + 0.5 * generator.standard_normal(t.size), sample_rate=1000, method="paper")
    assert np.nanmedian(single.condition) > 1000
    assert np.mean(single.status & Status.ILL_CONDITIONED != 0) > 0.8

    # A torque that comes 1 ms late changes the damping by about (I ω² - K) τ, here with ω that of the angle.
    late = tvident.simulate_torsional_rig(pattern="constant")
    kinds: Any = {"inertia": 0.0123, "damping": "constant", "stiffness": 6.0 / 0.45}
    on_time = tvident.identify(late.angle[:-1], late.torque[:-1], sample_rate=1000, method="paper", **kinds)
    shifted = tvident.identify(late.angle[1:], late.torque[:-1], sample_rate=1000, method="paper", **kinds)
    change = shifted.constants["damping"][0] - on_time.constants["damping"][0]
    squared = late.true_acceleration.var() / late.true_velocity.var()  # ω² where θ̇ weighs it
    assert change == pytest.approx((0.0123 * squared - 6.0 / 0.45) * 1e-3, rel=0.1)

    # The first and the last half window have no parameters, the next ones fewer equations.
    without = np.flatnonzero(np.isnan(result.stiffness))
    np.testing.assert_array_equal(without, [*range(100), *range(20_000 - 99, 20_000)])
    edge = result.status & Status.EDGE != 0
    assert edge[100:200].all()
    assert not edge[200 : 20_000 - 200].any()
