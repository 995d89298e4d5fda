"""Medians of windowed parameters are known better than their samples, but for what these have in common."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from parameters import long
from tvident._results.medians import error_of_median, median_of

Array = npt.NDArray[np.float64]

SAMPLES, WINDOW = 2000, 80
TIME = np.arange(SAMPLES) / SAMPLES


def scatter_and_error(truth: Array, own: float, common: float) -> tuple[float, float]:
    """Give the deviation of medians over many draws of errors that are one in a window, and the mean of what is said of it."""
    generator = np.random.default_rng(7)
    medians, errors = [], []
    whole = float(np.hypot(own, common))
    for _ in range(400):
        each = np.repeat(own * generator.standard_normal(SAMPLES // WINDOW), WINDOW)
        values = truth + each + common * generator.standard_normal()
        medians.append(np.median(values))
        errors.append(error_of_median(values, np.full(SAMPLES, whole), (common / whole) ** 2, WINDOW))
    return float(np.std(medians)), float(np.mean(errors))


@pytest.mark.parametrize("common", [0.05, *long(0.0, 0.3)])
@pytest.mark.parametrize(
    "truth",
    [np.full(SAMPLES, 5.0), 5 + TIME, 5 + 20 * TIME, 5 + np.sin(2 * np.pi * 3 * TIME), 5 + 10 * (TIME > 0.3)],
    ids=["constant", "slow ramp", "fast ramp", "sine", "step"],
)
def test_the_error_of_a_median_is_how_much_it_scatters(truth: Array, common: float) -> None:
    scatter, error = scatter_and_error(truth, 0.2, common)
    assert error == pytest.approx(scatter, rel=0.3)


def test_of_a_fast_ramp_one_window_passes_the_median() -> None:
    alone, steady = (scatter_and_error(truth, 0.2, 0.0)[1] for truth in (5 + 100 * TIME, np.full(SAMPLES, 5.0)))
    assert alone == pytest.approx(0.2, rel=0.1)
    assert steady == pytest.approx(0.2 * np.sqrt(np.pi / 2 * WINDOW / SAMPLES), rel=0.3)


def test_where_a_parameter_jumps_over_its_median_nothing_is_known_of_that() -> None:
    values = np.where(TIME < 0.5, 4.0, 8.0)
    assert error_of_median(values, np.full(SAMPLES, 0.1), 0.0, WINDOW) > 1


def test_what_all_samples_have_in_common_is_not_divided() -> None:
    values, errors = np.full(SAMPLES, 5.0), np.full(SAMPLES, 0.2)
    assert error_of_median(values, errors, 1.0, WINDOW) == pytest.approx(0.2)
    assert error_of_median(values, errors, 0.5, WINDOW) > 0.2 * np.sqrt(0.5)
    errors[WINDOW:] = np.nan
    assert error_of_median(values, errors, 0.0, WINDOW) == pytest.approx(0.2 * np.sqrt(np.pi / 2), rel=0.01)
    assert np.isnan(error_of_median(values, np.full(SAMPLES, np.nan), 0.0, WINDOW))


def test_constants_that_are_found_are_what_samples_have_in_common(tmp_path: Path) -> None:
    """With known constants each window is on its own."""
    rig = tvident.simulate_torsional_rig(20.0, seed=11)
    rate = rig.sample_rate
    found = tvident.identify(rig.angle, rig.torque, sample_rate=rate)
    assert found.settings["kinds"]["stiffness"] == "windowed"
    part = found._found.in_common  # noqa: SLF001 - what is tested
    assert 0 < part["stiffness"] < 1
    assert part["inertia"] == 1
    value, error, *_ = found.value("stiffness")
    assert median_of(found, "stiffness")[0] == value
    assert np.sqrt(part["stiffness"]) * error < median_of(found, "stiffness")[1] < error
    assert median_of(found, "inertia") == found.value("inertia")[:2]

    inertia, damping, offset = (found.value(name).value for name in ("inertia", "damping", "offset"))
    known = tvident.identify(
        rig.angle,
        rig.torque - offset,
        sample_rate=rate,
        inertia=inertia,
        damping=damping,
        terms=(),
        stiffness="windowed",
    )
    assert known._found.in_common["stiffness"] == 0  # noqa: SLF001 - what is tested
    own = np.median(known.stderr["stiffness"]) / np.median(found.stderr["stiffness"])
    assert 1 - own**2 == pytest.approx(part["stiffness"], abs=0.1)

    found.save(tmp_path / "found.npz")
    loaded = tvident.load(tmp_path / "found.npz")
    assert median_of(loaded, "stiffness") == median_of(found, "stiffness")


def test_of_several_records_each_has_its_own() -> None:
    rigs = [tvident.simulate_torsional_rig(10.0, seed=seed) for seed in (1, 2)]
    angle, torque = (np.stack([getattr(rig, name) for rig in rigs]) for name in ("angle", "torque"))
    found = tvident.identify(angle, torque, sample_rate=rigs[0].sample_rate)
    for record, rig in enumerate(rigs):
        alone = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate)
        assert median_of(found[record], "stiffness") == pytest.approx(median_of(alone, "stiffness"), rel=1e-9)


def test_a_record_that_determines_nothing_has_no_median() -> None:
    """Its settings have no length of windows, by which an error of a median would count."""
    draw = np.random.default_rng(0)
    result = tvident.identify(draw.standard_normal(500), draw.standard_normal(500), sample_rate=100.0)
    assert result.settings["regression_window"] == "auto"
    assert np.isnan(median_of(result, "stiffness")).all()
