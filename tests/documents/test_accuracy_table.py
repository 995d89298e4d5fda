from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import linalg

import tvident
from accuracy import bound, errors, methods, report
from accuracy.cases import Case
from accuracy.methods import METHODS
from accuracy.results import Results
from accuracy.sections import sections
from accuracy.store import Store

SHORT = Case("slider", duration=6.0)


@pytest.fixture(scope="module")
def recording() -> tvident.Recording:
    return SHORT.record(0)


def test_an_error_is_the_root_mean_square_over_the_mean_of_the_truth() -> None:
    assert errors.nrmse(np.array([11.0, np.nan, 9.0]), np.array([10.0, 10.0, 10.0])) == pytest.approx(10.0)


def test_the_papers_method_has_the_errors_that_its_design_tells_of() -> None:
    # One recording scatters up to twice the design's medians of 7.0, 6.3 and 33 %.
    case = Case("slider", angle_noise=1e-3)
    values = METHODS["paper"].timed(case, case.record(0))
    for name, design in (("stiffness", 7.0), ("inertia", 6.3), ("damping", 33.0)):
        assert design / 2 < values[name] < design * 2
    assert values["varies"] == ["stiffness", "inertia", "damping"]


def test_the_bound_is_that_of_the_dense_information_matrix() -> None:
    case = Case("I and C vary", angle_noise=0.03, duration=0.4)
    recording = case.record(0)
    angle, torque = case.noise_levels(recording)
    samples = recording.time.size
    omega = 2 * np.pi * np.fft.rfftfreq(samples, 1e-3)
    first, second = (
        np.fft.irfft(k[:, None] * np.fft.rfft(np.eye(samples), axis=0), samples, axis=0)
        for k in (1j * omega, -(omega**2))
    )
    motion = recording.inertia[:, None] * second + recording.damping[:, None] * first + np.diag(recording.stiffness)
    covariance = torque**2 * np.eye(samples) + angle**2 * motion @ motion.T
    columns = np.stack(
        [
            recording.stiffness * recording.true_angle,
            recording.inertia * recording.true_acceleration,
            recording.damping * recording.true_velocity,
        ],
        axis=1,
    )
    information = columns.T @ linalg.solve(covariance, columns, assume_a="pos")
    expected = np.sqrt(np.diag(np.linalg.inv(information)))
    found = bound.relative_standard_errors(recording, angle, torque)
    np.testing.assert_allclose([found[name] for name in errors.PARAMETERS], expected, rtol=1e-4)


def test_without_noise_of_the_angle_the_bound_is_that_of_least_squares(recording: tvident.Recording) -> None:
    columns = np.stack(
        [
            recording.stiffness * recording.true_angle,
            recording.inertia * recording.true_acceleration,
            recording.damping * recording.true_velocity,
        ],
        axis=1,
    )
    expected = 0.1 * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    found = bound.relative_standard_errors(recording, 0.0, 0.1)
    np.testing.assert_allclose([found[name] for name in errors.PARAMETERS], expected, rtol=1e-6)


def test_a_tiny_table_is_computed_once_and_written(tmp_path: Path) -> None:
    store = tmp_path / "results.jsonl"
    section = sections()["identification"]
    results = Results(Store(store), 1)
    results.compute([SHORT], ["bound", "ours", "paper"], 0, "test")
    written = store.read_text()
    again = Results(Store(store), 1)
    again.compute([SHORT], ["bound", "ours", "paper"], 0, "test")
    assert store.read_text() == written
    assert again.median(SHORT, "bound", "stiffness") < again.median(SHORT, "paper", "stiffness")

    path = tmp_path / "accuracy.md"
    report.replace_section(path, "Other", ["kept"])
    report.replace_section(path, section.heading, section.lines(section, again))
    report.replace_section(path, section.heading, section.lines(section, again))
    text = path.read_text()
    assert text.count("## Identification\n") == 1
    assert "## Other\n\nkept" in text
    assert "| slider: K / I / C in % | 1e-6 |" in text


def test_a_line_that_a_run_was_cut_off_in_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    Store(path).put([("one", {"error": 1.0})])
    with path.open("a") as file:
        file.write('["two", {"err')
    assert "one" in Store(path)
    assert "two" not in Store(path)


def test_a_result_follows_a_line_that_was_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    path.write_text('["one", {"err')
    Store(path).put([("two", {"error": 2.0})])
    assert "two" in Store(path)


def test_words_alone_make_no_result_outdated() -> None:
    source = 'def f(x):\n    """Say it."""\n    return x  # as it is\n'
    reworded = 'def f(x):\n    """Say it better."""\n    return x\n'
    assert methods._code(source) == methods._code(reworded)  # noqa: SLF001 - what results are kept by
    assert methods._code(source) != methods._code(source.replace("return x", "return -x"))  # noqa: SLF001


@pytest.mark.parametrize("name", ["kalman", "savgoldiff"])
def test_peers_find_the_stiffness(name: str) -> None:
    if not METHODS[name].installed:
        pytest.skip(f"{METHODS[name].label} needs {METHODS[name].packages}; run `make accuracy`")
    case = Case("slider", angle_noise=1e-6, duration=6.0)
    assert METHODS[name].timed(case, case.record(0))["stiffness"] < 30
