"""Comparison of models: the criterion finds the equation, weights and averages know of the choice."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from commands import run
from parameters import long
from tvident._compare.criterion import akaike_weights, averaged
from tvident._identify import aicc, effective_observations

Array = npt.NDArray[np.float64]

CONSTANT: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}

CANDIDATES: dict[str, dict[str, Any]] = {
    "plain": {"terms": ()},
    "cubic": {"terms": ("cubic",)},
    "coulomb": {"terms": ("coulomb",)},
}


def oscillator(seed: int, *, cubic: float = 0.0, n: int = 6000) -> tuple[Array, Array]:
    """Give a motion and the torque that its equation asks for, 0.01 θ̈ + 0.05 θ̇ + 12 θ + cubic θ³, with white noise of the torque."""
    generator = np.random.default_rng(seed)
    t = np.arange(n) / 1000
    angle, velocity, acceleration = np.zeros((3, n))
    for frequency in (1.1, 2.3, 4.7):
        rate, phase = 2 * np.pi * frequency, generator.uniform(0, 6)
        angle += 0.1 * np.sin(rate * t + phase)
        velocity += 0.1 * rate * np.cos(rate * t + phase)
        acceleration -= 0.1 * rate**2 * np.sin(rate * t + phase)
    torque = 0.01 * acceleration + 0.05 * velocity + 12 * angle + cubic * angle**3
    return angle + 1e-6 * generator.standard_normal(n), torque + 0.05 * generator.standard_normal(n)


# A term that is not needed lowers 2 ln L by more than AICc's 2 in 16 % of records; 40 records with two such terms: 13 are expected,
# and more than 23 with a probability of 1e-3; of 10 records, more than 8.
@pytest.mark.parametrize(("records", "most"), [(10, 8), *long((40, 23))])
def test_the_equation_is_found_and_no_other_term_is_believed(records: int, most: int) -> None:
    assert (
        tvident.compare_models(*oscillator(1, cubic=20), models=CANDIDATES, sample_rate=1000, **CONSTANT).best
        == "cubic"
    )
    chosen = [
        tvident.compare_models(*oscillator(seed), models=CANDIDATES, sample_rate=1000, **CONSTANT)
        for seed in range(records)
    ]
    assert sum(one.best != "plain" for one in chosen) <= most
    # A difference of 10 is one in 1000.
    assert sum(float(one.averaged["cubic"][0]) > 3 * float(one.averaged["cubic"][1]) for one in chosen) <= 2


@pytest.mark.slow
def test_terms_with_inner_parameters_are_searched_and_pay_for_them() -> None:
    generator = np.random.default_rng(5)
    t = np.arange(2500) / 500
    rates = 2 * np.pi * np.array([0.5, 1.3, 2.9, 4.7])
    swing = [(0.3 / rate, rate, phase) for rate, phase in zip(rates, generator.uniform(0, 6, 4), strict=True)]
    angle = sum(one * np.sin(rate * t + phase) for one, rate, phase in swing)
    velocity = sum(one * rate * np.cos(rate * t + phase) for one, rate, phase in swing)
    acceleration = -sum(one * rate**2 * np.sin(rate * t + phase) for one, rate, phase in swing)
    friction = 0.2 + 0.15 * np.exp(-((velocity / 0.15) ** 2))
    torque = 0.02 * acceleration + 0.1 * velocity + 8 * angle + friction * np.sign(velocity)
    models: dict[str, dict[str, Any]] = {
        "coulomb": {"terms": ("coulomb",)},
        "stribeck": {"terms": ("coulomb", "stribeck")},
    }
    compared = tvident.compare_models(
        angle + 1e-6 * generator.standard_normal(t.size),
        torque + 0.02 * generator.standard_normal(t.size),
        models=models,
        sample_rate=500,
        **CONSTANT,
    )
    assert compared.best == "stribeck"
    assert compared.table["difference"][1] > 10
    np.testing.assert_array_equal(compared.table["parameters"], [6, 4])
    value, error = compared.results["stribeck"].constants["stribeck.velocity"]
    assert abs(value - 0.15) < 4.5 * error


def test_what_a_record_does_not_determine_chooses_nothing_and_is_said() -> None:
    """A motion in one direction does not tell friction from an offset: the model with both must not choose the test function of all."""
    generator = np.random.default_rng(2)
    t = np.arange(8000) / 1000
    rates, phases = 2 * np.pi * np.array([0.4, 1.1, 2.3]), (0.5, 2.0, 4.0)
    pairs = list(zip(rates, phases, strict=True))
    angle = 3 * t + sum(0.5 / rate * np.sin(rate * t + phase) for rate, phase in pairs)
    velocity = 3 + sum(0.5 * np.cos(rate * t + phase) for rate, phase in pairs)
    acceleration = -sum(0.5 * rate * np.sin(rate * t + phase) for rate, phase in pairs)
    torque = 0.02 * acceleration + 0.1 * velocity + 0.3 + 0.01 * generator.standard_normal(t.size)
    models: dict[str, dict[str, Any]] = {"offset": {"terms": ("offset",)}, "both": {"terms": ("offset", "coulomb")}}
    call: dict[str, Any] = {"sample_rate": 1000, **CONSTANT, "stiffness": 0.0}
    alone = tvident.identify(angle, torque, terms=["offset"], **call)
    compared = tvident.compare_models(angle, torque, models=models, **call)
    assert compared.results["offset"].settings["window_length"] == alone.settings["window_length"]
    assert compared.averaged["inertia"] == pytest.approx(alone.constants["inertia"])
    assert "the record does not determine 'both'" in compared.summary()
    assert "in no model that counts: coulomb" in compared.summary()


def test_a_model_that_cannot_tell_its_own_parameters_apart_is_not_averaged() -> None:
    """A spring and gravity are one function of small angles: a stiffness of 8 N m/rad was averaged to 8 ± 246."""
    angle, torque = oscillator(1)
    angle, torque = 0.02 * angle, 0.02 * torque
    models: dict[str, dict[str, Any]] = {"spring": {"terms": ()}, "both": {"terms": ("gravity",)}}
    compared = tvident.compare_models(angle, torque, models=models, sample_rate=1000, **CONSTANT)
    assert tvident.Status.ILL_CONDITIONED & int(compared.results["both"].record_status)
    assert compared.results["both"].constants["stiffness"][1] > 10
    assert compared.averaged["stiffness"] == pytest.approx(compared.results["spring"].constants["stiffness"])
    words = compared.summary()
    assert "'both' cannot tell its own parameters apart, so averages leave it out; see its advice" in words
    assert "in no model that counts: gravity" in words
    models["spring"] = {"stiffness": 0.0}
    alone = tvident.compare_models(angle, torque, models=models, sample_rate=1000, **CONSTANT)
    assert "leave it out" not in alone.summary()
    assert alone.averaged["stiffness"] == pytest.approx(alone.results["both"].constants["stiffness"])


def test_errors_know_of_the_choice() -> None:
    compared = tvident.compare_models(*oscillator(3, cubic=0.4), models=CANDIDATES, sample_rate=1000, **CONSTANT)
    weights = dict(zip(compared.table["model"], compared.table["weight"], strict=True))
    assert sum(weights.values()) == pytest.approx(1)
    value, error = compared.averaged["stiffness"]
    each = {name: one.constants["stiffness"] for name, one in compared.results.items()}
    assert value == pytest.approx(sum(weights[name] * each[name][0] for name in each))
    assert error == pytest.approx(sum(weights[name] * np.hypot(each[name][1], each[name][0] - value) for name in each))
    assert error > min(error for _, error in each.values())
    assert compared.averaged["cubic"][0] == pytest.approx(weights["cubic"] * each_of(compared, "cubic"))


def each_of(compared: tvident.ModelComparison, name: str) -> float:
    return float(compared.results[name].constants[name][0])


def test_the_criterion_is_akaikes() -> None:
    assert aicc(2.0, 50, 3) == pytest.approx(50 * np.log(2) + 2 * 4 * 50 / 45)
    assert aicc(2.0, 4, 3) == np.inf
    np.testing.assert_allclose(
        akaike_weights(np.array([3.0, 1.0, np.inf])), np.array([np.exp(-1), 1, 0]) / (1 + np.exp(-1))
    )
    assert not akaike_weights(np.full(2, np.inf)).any()
    mean, error = averaged(
        np.array([[1.0], [3.0], [np.nan]]), np.array([[0.0], [0.0], [1.0]]), np.array([0.25, 0.25, 0.5])
    )
    assert (mean[0], error[0]) == (2.0, 1.0)


def test_overlapping_rows_are_worth_so_many_independent_ones() -> None:
    """The variance of the logarithm of the mean square of N independent normal numbers is 2/N."""
    generator = np.random.default_rng(1)
    x = np.linspace(-1, 1, 41)
    rows = np.array([np.convolve(generator.standard_normal(4000), (1 - x**2) ** 8, mode="valid") for _ in range(400)])
    scatter = np.var(np.log(np.mean(rows**2, axis=1)))
    # 400 draws tell a variance to 7 %.
    assert 2 / scatter == pytest.approx(effective_observations(3960, 41, 8), rel=0.2)


def test_drag_is_a_default_candidate() -> None:
    """Gravity with dry friction was best of the others, and a damping of 0.34 for 0.05."""
    angle, torque = oscillator(4)
    velocity = np.gradient(angle, 1e-3)
    compared = tvident.compare_models(angle, torque + 0.05 * velocity * np.abs(velocity), sample_rate=1000, **CONSTANT)
    assert compared.best == "quadratic_drag"
    value, error = compared.averaged["damping"]
    assert abs(value - 0.05) < 4 * error


@pytest.mark.slow
def test_default_candidates_windowed_stiffness_and_words(tmp_path: Path) -> None:
    rig = tvident.simulate_torsional_rig(duration=3.0, seed=2)
    compared = tvident.compare_models(rig.angle, rig.torque, sample_rate=1000)
    assert compared.table["model"][-1] == "undamped"
    value, error = compared.averaged["stiffness"]
    assert np.median(np.abs(value / rig.stiffness - 1)) < 0.02
    assert (error > 0).all()
    words = compared.summary()
    assert words.splitlines()[0].startswith("9 models, ")
    assert "best: " in words or "hardly tells" in words
    compared.save(str(tmp_path / "table.csv"))
    assert (tmp_path / "table.csv").read_text(encoding="utf-8").startswith("model,parameters,residual_std [N m],aicc,")
    assert "ModelComparison of 9 models" in repr(compared)
    assert compared.plot().axes[0].get_title(loc="left") == "Models compared"
    pandas = pytest.importorskip("pandas")
    assert isinstance(compared.to_pandas(), pandas.DataFrame)


def test_gravity_is_no_candidate_of_what_slides() -> None:
    """It was a spring: a positioning system had a stiffness of 5014 N/m beside a gravity of -5082 N."""
    rig = tvident.simulate_torsional_rig(duration=3.0)
    sliding = tvident.compare_models(rig.angle, rig.torque, sample_rate=1000, angle_unit="m", torque_unit="N")
    assert {"cubic", "coulomb"} < set(sliding.results)
    assert not any("gravity" in name for name in sliding.results)
    channels = tvident.Channel(rig.angle, "m"), tvident.Channel(rig.torque, "N")
    assert set(tvident.compare_models(*channels, sample_rate=1000).results) == set(sliding.results)


def test_what_cannot_be_compared_is_refused_with_the_rule() -> None:
    angle, torque = oscillator(1, n=3000)
    with pytest.raises(ValueError, match=r"on a single record; got shape \(1, 3000\)"):
        tvident.compare_models(angle[np.newaxis], torque[np.newaxis], sample_rate=1000)
    with pytest.raises(ValueError, match=r"needs two models or more; got 1"):
        tvident.compare_models(angle, torque, sample_rate=1000, models={"one": {}})
    with pytest.raises(TypeError, match=r"mapping of names to arguments; got \['cubic'\]"):
        tvident.compare_models(angle, torque, sample_rate=1000, models=["cubic"])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"same weak form, or their rows differ; got StrongForm"):
        tvident.compare_models(
            angle, torque, sample_rate=1000, models={"weak": {}, "strong": {"method": tvident.StrongForm()}}
        )


def test_the_command_compares(tmp_path: Path) -> None:
    angle, torque = oscillator(5, cubic=30)
    np.savetxt(tmp_path / "r.csv", np.stack([angle, torque], axis=1), delimiter=",", header="angle,torque", comments="")
    call = ["compare", str(tmp_path / "r.csv"), "--angle", "angle", "--torque", "torque", "--sample-rate", "1000"]
    call += ["--stiffness", "constant", "--model", "none", "--model", "cubic", "--model", "cubic,offset"]
    done = run(*call, "-o", str(tmp_path / "t.csv"))
    assert done.returncode == 0, done.stderr
    assert "3 models" in done.stdout
    assert (tmp_path / "t.csv").read_text(encoding="utf-8").splitlines()[1].startswith(
        "'cubic"
    ) or "cubic" in done.stdout
    assert run(*call[:6]).returncode == 2


def test_models_of_nothing_have_no_score() -> None:
    still = np.zeros(100)
    compared = tvident.compare_models(still, np.random.default_rng(0).standard_normal(100), sample_rate=100.0)
    assert np.isinf(compared.table["aicc"]).all()
    assert not compared.table["weight"].any()
    assert np.isnan(compared.averaged["stiffness"][0]).all()
    assert "nan" in compared.summary()


def test_a_models_name_is_drawn_as_text(tmp_path: Path) -> None:
    """A control character has no glyph, "$x_" was read as a formula, and a long name left no room for the bars."""
    rig = tvident.simulate_torsional_rig(duration=1.0)
    names = ("bell\x07", "$x_$", "x" * 300)
    models: dict[str, Any] = {name: {"damping": 0.03 + place / 100} for place, name in enumerate(names)}
    found = tvident.compare_models(rig.angle, rig.torque, models=models, sample_rate=1000, stiffness="constant")
    figure = found.plot()
    drawn = {one.get_text() for one in figure.axes[0].get_yticklabels()}
    assert drawn == {r"bell\x07", r"\$x_\$", "x" * 57 + "..."}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure.savefig(tmp_path / "x.png")


def test_channels_of_two_clocks_are_compared() -> None:
    """They were to have one shape, with the advice to give the rates of both, which had been given."""
    rig = tvident.simulate_torsional_rig(duration=4.0, seed=1)
    angle, torque, t = (np.asarray(one) for one in (rig.angle, rig.torque, rig.time))
    models: dict[str, Any] = {"spring": {"damping": 0.0}, "damped": {}, "known": {"inertia": 0.0123}}
    alone = tvident.compare_models(angle, torque, models=models, sample_rate=1000)
    for call in ({"sample_rate": (1000, 500)}, {"delta": (1e-3, 2e-3)}, {"t": (t, t[::2])}):
        compared = tvident.compare_models(angle, torque[::2], models=models, **call)
        assert compared.best in {"damped", "known"}
        assert compared.table["weight"][list(compared.table["model"]).index("spring")] < 1e-6
        value, error = compared.averaged["damping"]
        expected, own = alone.averaged["damping"]
        assert abs(np.median(value) - np.median(expected)) < 4 * np.hypot(np.median(error), np.median(own))
    # Samples that are missing are no observations.
    angle[1000:2500] = np.nan
    one = tvident.compare_models(angle, torque, models=models, sample_rate=1000)
    two = tvident.compare_models(angle, torque[:-1], models=models, sample_rate=(1000, 1000))
    assert two.observations == pytest.approx(one.observations, rel=0.02)
