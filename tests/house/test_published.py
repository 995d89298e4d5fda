"""What builds and checks releases names things that are there: `make wheels` itself takes minutes, and runs in continuous integration."""

from __future__ import annotations

import re
import tomllib
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def pins(name: str) -> set[str]:
    """Give the versions of a package that files of requirements lock."""
    lines = [line for path in ROOT.glob("requirements-*.txt") for line in path.read_text(encoding="utf-8").splitlines()]
    return {line.partition("==")[2] for line in lines if line.partition("==")[0] == name}


@pytest.mark.parametrize("name", [".ci/run", ".github/workflows/check.yml"])
def test_continuous_integration_calls_targets_that_users_have(name: str) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    called = re.findall(r"^(?:\s*- run: )?make ([a-z-]+)", (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)
    assert called
    assert set(called) <= targets


def test_every_system_runs_what_depends_on_it() -> None:
    text = (ROOT / ".github" / "workflows" / "check.yml").read_text(encoding="utf-8")
    jobs = dict(re.findall(r"^  ([a-z]+):\n(.*?)(?=^  [a-z]+:\n|\Z)", text, re.MULTILINE | re.DOTALL))
    for job, called in (
        ("tests", {"lint-rust", "test-rust", "lint-core", "test-python", "test-slow", "test-long"}),
        ("wheels", {"wheels"}),
    ):
        assert {"macos-14", "windows-2022"} <= set(re.findall(r"[a-z]+-\d[\w.-]*", jobs[job]))
        assert called == set(re.findall(r"run: make ([a-z-]+)", jobs[job]))
    assert "run: .ci/run" in jobs["everything"]


def test_the_tests_of_a_wheel_are_there_and_what_they_need_is_locked() -> None:
    spec = spec_from_file_location("wheels", ROOT / ".ci" / "wheels.py")
    assert spec is not None
    assert spec.loader is not None
    wheels = module_from_spec(spec)
    spec.loader.exec_module(wheels)
    assert all((ROOT / name).exists() for name in wheels.TESTS)
    assert all(pins(name) for name in wheels.TESTED_WITH)


def test_every_environment_builds_with_one_maturin_which_the_project_allows() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert len(pins("maturin")) == 1
    assert project["build-system"]["requires"] == ["maturin>=1.16,<2"]
    assert next(iter(pins("maturin"))).startswith("1.")
    assert project["tool"]["maturin"]["sbom"]["rust"]
