"""A pytest plugin that puts tvident.savgol_filter in the place of SciPy's in SciPy's own tests."""

from __future__ import annotations

from typing import Any

import pytest

import tvident

_calls: list[int] = []


def _counted(*arguments: Any, **options: Any) -> Any:
    _calls.append(1)
    return tvident.savgol_filter(*arguments, **options)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Replace the name that the tests imported."""
    for item in items:
        if isinstance(item, pytest.Function):
            item.module.savgol_filter = _counted


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say how often it was called, so that the caller knows that it was."""
    terminalreporter.write_line(f"{len(_calls)} calls of tvident.savgol_filter")
