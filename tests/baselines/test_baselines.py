"""Methods that came before: against slow references and simulated truth."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from commands import run
from parameters import examples
from tvident import baselines

ROUNDING = 1e-6
"""Some hundred sums, of numbers of one size; a vague beginning costs six digits."""


def problem(seed: int, rows: int) -> tuple[Any, Any]:
    generator = np.random.default_rng(seed)
    regressors = generator.standard_normal((rows, 2)) * [1.0, 100.0]
    return regressors, regressors @ [2.0, 0.03] + 0.1 * generator.standard_normal(rows)


@settings(max_examples=examples(20))
@given(seed=st.integers(0, 1000), rows=st.integers(8, 60), forgetting=st.floats(0.8, 1.0))
def test_recursive_least_squares_are_weighted_least_squares_of_the_past(
    seed: int, rows: int, forgetting: float
) -> None:
    regressors, rhs = problem(seed, rows)
    found = baselines.recursive_least_squares(regressors, rhs, forgetting=forgetting)
    weight = np.sqrt(forgetting ** np.arange(rows - 1, -1, -1.0))
    expected = np.linalg.lstsq(regressors * weight[:, np.newaxis], rhs * weight, rcond=None)[0]
    np.testing.assert_allclose(found.values[-1], expected, rtol=1e-4)
    assert np.all(found.stderr[-1] > 0)


@settings(max_examples=examples(10))
@given(seed=st.integers(0, 1000), rows=st.integers(5, 25))
def test_the_smoother_is_least_squares_with_steps(seed: int, rows: int) -> None:
    regressors, rhs = problem(seed, rows)
    steps, noise = np.array([0.3, 0.01]), 0.2
    found = baselines.random_walk_smoother(regressors, rhs, steps=steps, noise=noise)
    # All parameters at once: rows over the noise, differences over their steps.
    design = np.zeros((rows, 2 * rows))
    for row in range(rows):
        design[row, 2 * row : 2 * row + 2] = regressors[row] / noise
    walk = (np.eye(2 * rows)[2:] - np.eye(2 * rows)[:-2]) / np.tile(steps, rows - 1)[:, np.newaxis]
    matrix = np.concatenate([design, walk])
    expected = np.linalg.lstsq(matrix, np.concatenate([rhs / noise, np.zeros(2 * rows - 2)]), rcond=None)[0]
    errors = np.sqrt(np.diag(np.linalg.inv(matrix.T @ matrix)))
    np.testing.assert_allclose(found.values.ravel(), expected, rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(found.stderr.ravel(), errors, rtol=1e-3)


def test_derivatives_of_polynomials_are_exact() -> None:
    t = np.arange(400) * 0.01
    cubic = 1 + 2 * t - t**2 + 0.5 * t**3
    truth = np.stack([cubic, 2 - 2 * t + 1.5 * t**2, -2 + 3 * t])
    np.testing.assert_allclose(baselines.chebyshev_derivatives(cubic, 4, delta=0.01), truth, atol=ROUNDING)
    np.testing.assert_allclose(baselines.savgol_derivatives(cubic, 31, 3, delta=0.01), truth, atol=ROUNDING)
    parabola = 1 + 2 * t - t**2
    found = baselines.lanczos_derivatives(parabola, 21, delta=0.01)
    np.testing.assert_allclose(found[1, 10:-10], (2 - 2 * t)[10:-10], atol=ROUNDING)
    np.testing.assert_allclose(found[2, 10:-10], -2, atol=ROUNDING)
    assert np.isnan(found[:, :10]).all()


def test_sums_of_functions_are_found() -> None:
    generator = np.random.default_rng(0)
    regressors = generator.standard_normal((500, 2))
    changing = 1 + 0.5 * np.linspace(-1, 1, 500) ** 2
    rhs = 3 * regressors[:, 0] + changing * regressors[:, 1] + 0.01 * generator.standard_normal(500)
    found = baselines.expanded_least_squares(regressors, rhs, family="chebyshev", sizes=[1, 3])
    assert np.abs(found.values[:, 1] - changing).max() < 5 * found.stderr[:, 1].max() < 0.02
    assert abs(found.values[0, 0] - 3) < 5 * found.stderr[0, 0]


def test_a_discrete_model_has_the_parameters_of_the_rig() -> None:
    rig = tvident.simulate_torsional_rig(duration=6.0, pattern="constant", torque_snr_db=100, angle_noise=1e-7)
    found = baselines.tvarx(rig.angle, rig.torque, 2000, delta=1e-3, degree=0, every=4)
    middle = found.values[3000]
    # The torque is taken as constant within a group of 4 samples, at up to 12 Hz.
    wrong = np.abs(middle / np.array([0.0123, 0.00825, rig.stiffness[0]]) - 1)
    assert np.all(wrong < 1e-3)


@pytest.mark.slow
def test_methods_are_compared(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=6.0, pattern="square", seed=3)
    truth = {name: getattr(rig, name) for name in ("inertia", "damping", "stiffness")}
    names = ["tvident", "paper", "savgol, windows", "forgetting"]
    found = baselines.compare_methods(rig.angle, rig.torque, sample_rate=1000, truth=truth, methods=names)
    table = found.table
    assert table["method"].tolist() == names
    assert table["stiffness"][0] < 0.5 * table["stiffness"][1:].min()
    np.testing.assert_allclose(np.hypot(table["bias"], table["random"]), table["stiffness"], rtol=1e-6)
    assert 0 < table["rise_time"][0] < 0.02
    assert table["vaf"][0] > 99
    assert "tvident" in found.summary()
    tvident.simulate_torsional_rig(duration=2.0).save(tmp_path / "rig.csv")
    words = [
        "compare",
        str(tmp_path / "rig.csv"),
        "--angle",
        "angle",
        "--torque",
        "torque",
        "--time",
        "time",
        "--methods",
    ]
    ran = run(*words)
    assert ran.returncode == 0, ran.stderr
    assert "random walk" in ran.stdout


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: baselines.recursive_least_squares(np.ones(3), np.ones(3)), "transpose"),
        (lambda: baselines.tvarx(np.ones(50), np.ones(50), 5, delta=1.0), "window"),
        (lambda: baselines.chebyshev_derivatives(np.ones(5), 9, delta=1.0), "fewer"),
        (lambda: baselines.compare_methods(np.ones(50), np.ones(50), sample_rate=1, methods=["none"]), "method"),
    ],
)
def test_what_does_not_fit_is_said(call: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        call()


ROWS = np.random.default_rng(0).standard_normal((50, 2))
SUM = ROWS.sum(axis=1)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: baselines.recursive_least_squares(np.where(ROWS > 2, np.nan, ROWS), SUM), "finite numbers"),
        (lambda: baselines.recursive_least_squares(ROWS[:0], SUM[:0]), "shape"),
        (lambda: baselines.recursive_least_squares(ROWS, 1e300 * SUM), "finite numbers"),
        (lambda: baselines.random_walk_smoother(ROWS, SUM, steps=["x", "y"], noise=1), "hold numbers"),
        (lambda: baselines.random_walk_smoother(ROWS, SUM, steps=[0.1], noise=1), "one for each of 2"),
        (lambda: baselines.expanded_least_squares(ROWS, SUM, family="legendre", sizes=[1, 2.5]), "whole number"),
        (lambda: baselines.tvarx(SUM, SUM.astype("U9"), 20, delta=0.1), "hold numbers"),
        (lambda: baselines.tvarx(SUM, SUM[1:], 20, delta=0.1), "shape"),
    ],
)
def test_wrong_calls_say_what_would_be_right(call: Callable[[], Any], words: str) -> None:
    with pytest.raises((ValueError, TypeError), match=words):
        call()


@pytest.mark.filterwarnings("error")
def test_records_beyond_doubles_are_not_known() -> None:
    """No warning of NumPy's is all that is said of them."""
    large = SUM * 1e300
    assert np.isnan(baselines.tvarx(large, large, 20, delta=0.1).values).all()
    assert not np.isfinite(baselines.chebyshev_derivatives(SUM * 1e300, 20, delta=1e-300)[2]).any()
