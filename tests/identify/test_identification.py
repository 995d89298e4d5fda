from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from calls import paper
from parameters import examples
from reference.identification import derivatives, windowed
from reference.regression import solve
from reference.scatter import scatter, variance_inflation
from tvident import Status

Array = npt.NDArray[np.float64]

# Parameters agree to this times the condition number: derivatives to 1e-9 of scale decide, not the least squares.
PARAMETERS = 1e-8


def system(seed: int, n: int, rate: float = 1000.0) -> tuple[Array, Array]:
    """Give an angle with several frequencies and a torque that is not quite that of a constant system."""
    generator = np.random.default_rng(seed)
    t = np.arange(n) / rate
    angle, velocity, acceleration = np.zeros(n), np.zeros(n), np.zeros(n)
    for frequency in generator.uniform(1, 15, 6):
        omega, phase = 2 * np.pi * frequency, generator.uniform(0, 6)
        angle += np.sin(omega * t + phase)
        velocity += omega * np.cos(omega * t + phase)
        acceleration -= omega**2 * np.sin(omega * t + phase)
    torque = 0.01 * acceleration + 0.1 * velocity + (15 + 3 * np.sin(5 * t)) * angle + 0.3
    return angle + 1e-4 * generator.standard_normal(n), torque + 0.5 * generator.standard_normal(n)


@settings(max_examples=examples(25))
@given(
    seed=st.integers(0, 2**32),
    half=st.integers(5, 40),
    equations=st.integers(20, 90),
    more=st.integers(60, 200),
    extra=st.sets(st.sampled_from(["offset", "coulomb", "cubic"])),
    known=st.sampled_from(["nothing", "no damping", "inertia", "stiffness over time"]),
    weighted=st.booleans(),
)
def test_every_window_is_the_papers(
    seed: int, half: int, equations: int, more: int, extra: set[str], known: str, weighted: bool
) -> None:
    n = 2 * half + equations + more
    angle, torque = system(seed, n)
    stiffness = np.linspace(10, 20, n)
    given: dict[str, dict[str, Any]] = {
        "nothing": {},
        "no damping": {"damping": 0},
        "inertia": {"inertia": 0.01},
        "stiffness over time": {"stiffness": stiffness},
    }
    call = given[known]
    names: list[Any] = sorted(extra)
    weights = np.random.default_rng(seed).uniform(0.1, 3, n) if weighted else np.ones(n)
    result = tvident.identify(
        angle,
        torque,
        sample_rate=1000,
        weights=weights if weighted else None,
        **paper(window_length=2 * half + 1, regression_window=equations, terms=names, **call),
    )
    theta, velocity, acceleration = derivatives(angle, half, 1e-3, result.order)
    factors = {"inertia": acceleration, "damping": velocity, "stiffness": theta}
    factors |= {"offset": np.where(np.isnan(theta), np.nan, 1.0), "coulomb": np.sign(velocity), "cubic": theta**3}
    side = torque.copy()
    for name, value in call.items():
        side = side - value * factors[name]
    unknowns = [name for name in ("inertia", "damping", "stiffness", *names) if name not in call]
    A = np.stack([factors[name] for name in unknowns], axis=1)
    root = np.sqrt(weights / weights.mean())
    A, side = A * root[:, np.newaxis], side * root
    values: dict[str, Any] = {name: getattr(result, name, None) for name in unknowns} | result.terms
    scale = np.nanmax(np.abs(A), axis=0)
    solutions = windowed(A, side, equations)
    found = np.stack([values[name] for name in unknowns], axis=1)
    larger = scatter(found, solutions.stderr, equations, half)
    # A factor is taken from all windows, so the worst decides how exact it is.
    worst = float(np.nanmax(solutions.condition, initial=1.0))
    if larger is None:
        larger = variance_inflation(A, side, half)
        worst = max(worst, solve(*(rows[half : n - half] for rows in (A, side))).condition)
    flagged = {flag: result.status & flag != 0 for flag in (Status.INVALID, Status.RANK_DEFICIENT, Status.EDGE)}
    solved = solutions.rows > 0
    assert flagged[Status.INVALID][~solved].all()
    deficient = solved & flagged[Status.RANK_DEFICIENT]
    assert (solutions.condition[deficient] > 1e12).all()  # a coulomb column that is constant beside an offset
    good = solved & ~deficient
    assert not flagged[Status.INVALID][good].any()
    np.testing.assert_array_equal(flagged[Status.EDGE][good], solutions.rows[good] < equations)
    condition, params = solutions.condition[good], solutions.params[good]
    allowed = PARAMETERS * condition**2 * np.maximum(1.0, np.abs(params * scale).sum(axis=1))
    assert (np.abs(found[good] - params) * scale <= allowed[:, None]).all()
    errors = np.stack([result.stderr[name] for name in unknowns], axis=1)
    np.testing.assert_allclose(errors[good], larger * solutions.stderr[good], rtol=1e-6 * worst, atol=1e-12)
    assert (np.abs(result.condition[good] - condition) <= PARAMETERS * condition**2).all()
    deviation = np.sqrt(solutions.rss[good] / (solutions.rows[good] - len(unknowns)))
    np.testing.assert_allclose(result.residual_std[good], deviation, rtol=1e-6, atol=1e-12)


def test_natural_frequency_and_damping_ratio_come_with_their_errors() -> None:
    angle, torque = system(1, 800)
    result = tvident.identify(angle, torque, sample_rate=1000, **paper(window_length=51, regression_window=100))
    theta, velocity, acceleration = derivatives(angle, 25, 1e-3, result.order)
    solutions = windowed(np.stack([acceleration, velocity, theta], axis=1), torque, 100)
    i = 400
    solution = solutions.one(i)
    assert solution is not None
    values = np.stack([result.inertia, result.damping, result.stiffness], axis=1)
    larger = scatter(values, solutions.stderr, 100, 25)
    assert larger is not None
    assert (larger > 1).any()
    covariance = solution.covariance * np.outer(larger, larger)
    I, C, K = solution.params  # noqa: E741 - the paper's letters
    frequency, ratio = np.sqrt(K / I) / (2 * np.pi), C / (2 * np.sqrt(K * I))
    assert result.natural_frequency[i] == pytest.approx(frequency)
    assert result.damping_ratio[i] == pytest.approx(ratio)
    for name, gradient in (
        ("natural_frequency", np.array([-frequency / (2 * I), 0, frequency / (2 * K)])),
        ("damping_ratio", np.array([-ratio / (2 * I), 1 / (2 * np.sqrt(K * I)), -ratio / (2 * K)])),
    ):
        expected = np.sqrt(gradient @ covariance @ gradient)
        assert result.stderr[name][i] == pytest.approx(expected, rel=1e-5)
    assert set(result.stderr) == {"inertia", "damping", "stiffness", "natural_frequency", "damping_ratio"}


@given(seed=st.integers(0, 2**32), nan_policy=st.sampled_from(["omit", "propagate"]))
@settings(max_examples=examples(10))
def test_constant_parameters_are_one_least_squares_over_the_record(seed: int, nan_policy: Any) -> None:
    angle, torque = system(seed, 700)
    angle[300] = np.nan
    call: dict[str, Any] = dict.fromkeys(("inertia", "damping", "stiffness"), "constant") | {"nan_policy": nan_policy}
    result = tvident.identify(angle, torque, sample_rate=1000, **paper(window_length=51, terms=["offset"], **call))
    theta, velocity, acceleration = derivatives(angle, 25, 1e-3, result.order)
    A = np.stack([acceleration, velocity, theta, np.ones(700)], axis=1)
    hit = np.abs(np.arange(700) - 300) <= 25
    # Costs its own equation, and those of its windows where they are not fitted on what is there.
    there = np.flatnonzero(hit & (np.arange(700) != 300)) if nan_policy == "omit" else np.arange(0)
    fit = tvident.fit_local_polynomials(angle, 51, sample_rate=1000, nan_policy="omit")
    A[there, :3] = fit.derivatives[2::-1, there].T
    hit[there] = False
    usable = np.isfinite(A).all(axis=1) & ~hit
    expected = solve(A[usable], torque[usable])
    A[~usable] = np.nan
    larger = variance_inflation(A, torque, 25)
    for k, name in enumerate(("inertia", "damping", "stiffness", "offset")):
        value, error = result.constants[name]
        assert value == pytest.approx(expected.params[k], rel=1e-6)
        assert error == pytest.approx(larger[k] * expected.stderr[k], rel=1e-6)
        whole = result.terms[name] if name == "offset" else getattr(result, name)
        np.testing.assert_array_equal(whole, np.full(700, value))
    assert result.condition[0] == pytest.approx(expected.condition, rel=1e-6)
    assert result.residual_std[0] == pytest.approx(np.sqrt(expected.rss / (usable.sum() - 4)), rel=1e-6)
    assert not (result.status & Status.INVALID).any()


def test_a_term_of_ones_own_is_like_a_built_in_one() -> None:
    angle, torque = system(2, 600)
    call: dict[str, Any] = {"sample_rate": 1000, "window_length": 51, "regression_window": 80}
    expected = tvident.identify(angle, torque, **paper(terms=["cubic"], **call))
    own = tvident.Term("hardening", lambda _t, theta, _velocity: theta**3)
    found = tvident.identify(angle, torque, **paper(terms=[own], **call))
    np.testing.assert_allclose(found.terms["hardening"], expected.terms["cubic"], rtol=1e-9)
    drag = tvident.Term("late", lambda t, _theta, _velocity: (t > 0.3) * 1.0)
    assert "late" in tvident.identify(angle, torque, **paper(terms=[drag], **call)).terms


def test_a_batch_is_its_records_one_by_one() -> None:
    pairs = [system(seed, 500) for seed in range(6)]
    angle, torque = (np.array([pair[k] for pair in pairs]).reshape(2, 3, 500) for k in range(2))
    stiffness = np.linspace(10, 20, 500)
    for kind in ("windowed", "constant"):
        call: dict[str, Any] = {
            "sample_rate": 1000,
            "window_length": 51,
            "regression_window": 80,
            "stiffness": stiffness,
        }
        call |= {"inertia": kind, "damping": kind, "terms": ["offset"]}
        result = tvident.identify(angle, torque, **paper(**call))
        assert result.inertia.shape == (2, 3, 500)
        assert result.time.shape == (500,)
        for i, j in np.ndindex(2, 3):
            alone = tvident.identify(angle[i, j], torque[i, j], **paper(**call))
            for name in ("inertia", "damping", "stiffness", "condition", "residual_std", "order", "status"):
                np.testing.assert_array_equal(getattr(result, name)[i, j], getattr(alone, name))
            np.testing.assert_array_equal(result.stderr["damping_ratio"][i, j], alone.stderr["damping_ratio"])
            np.testing.assert_array_equal(result.terms["offset"][i, j], alone.terms["offset"])
            for name, (value, error) in alone.constants.items():
                assert result.constants[name][0][i, j] == value
                assert result.constants[name][1][i, j] == error


@pytest.mark.parametrize("step", [2, 7, 333])
def test_a_step_gives_every_so_manieth_result(step: int) -> None:
    angle, torque = system(3, 900)
    call: dict[str, Any] = {"sample_rate": 1000, "window_length": 51, "regression_window": 80}
    full = tvident.identify(angle, torque, **paper(**call))
    found = tvident.identify(angle, torque, **paper(step=step, **call))
    np.testing.assert_array_equal(found.time, full.time[::step])
    for name in ("inertia", "damping", "stiffness", "condition", "residual_std", "order", "status", "damping_ratio"):
        np.testing.assert_array_equal(getattr(found, name), getattr(full, name)[::step])


@given(workers=st.integers(2, 6), equations=st.integers(50, 3000))
@settings(max_examples=examples(10))
def test_the_numbers_do_not_depend_on_the_number_of_workers(workers: int, equations: int) -> None:
    angle, torque = system(4, 60_000)
    one = tvident.identify(angle, torque, sample_rate=1000, **paper(regression_window=equations, workers=1))
    many = tvident.identify(angle, torque, sample_rate=1000, **paper(regression_window=equations, workers=workers))
    for name in ("inertia", "damping", "stiffness", "condition", "status"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name))
    call: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
    one = tvident.identify(angle, torque, sample_rate=1000, method="paper", workers=1, **call)
    many = tvident.identify(angle, torque, sample_rate=1000, method="paper", workers=workers, **call)
    assert one.constants == many.constants


def test_missing_values_cost_their_own_windows_only() -> None:
    angle, torque = system(5, 3000)
    clean = tvident.identify(angle, torque, sample_rate=1000, method="paper")
    angle[1000], torque[2500] = np.nan, np.inf
    dirty = tvident.identify(angle, torque, sample_rate=1000, method="paper", nan_policy="propagate")
    i = np.arange(3000)
    hit = ((i > 1000 - 200) & (i <= 1000 + 200)) | ((i > 2500 - 100) & (i <= 2500 + 100))
    np.testing.assert_array_equal((dirty.status & Status.INVALID != 0)[200:-200], hit[200:-200])
    np.testing.assert_allclose(dirty.stiffness[~hit], clean.stiffness[~hit], rtol=1e-9)


def test_nothing_excited_is_flagged_and_nan() -> None:
    result = tvident.identify(np.zeros(1000), np.zeros(1000), sample_rate=1000, method="paper")
    assert (result.status & Status.INVALID != 0).all()
    assert (result.status[200:-200] & Status.RANK_DEFICIENT != 0).all()
    assert np.isnan(result.inertia).all()
    call: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
    constant = tvident.identify(np.zeros(1000), np.zeros(1000), sample_rate=1000, method="paper", **call)
    assert Status.RANK_DEFICIENT in constant.record_status
    assert (constant.status & Status.INVALID != 0).all()
    assert np.isnan(constant.constants["inertia"][0])


def test_a_single_sine_is_flagged_as_hardly_determined() -> None:
    t = np.arange(5000) / 1000
    angle = np.sin(2 * np.pi * 3 * t) + 1e-4 * np.random.default_rng(0).standard_normal(t.size)
    result = tvident.identify(angle, 10 * angle, sample_rate=1000, method="paper")
    assert (result.status[200:-200] & Status.ILL_CONDITIONED != 0).mean() > 0.95
    recording = tvident.simulate_torsional_rig(duration=5.0)
    multisine = tvident.identify(recording.angle, recording.torque, sample_rate=1000, method="paper")
    assert (multisine.status & Status.ILL_CONDITIONED != 0).mean() < 0.01


def test_settings_and_words_say_what_was_done() -> None:
    angle, torque = system(6, 1000)
    result = tvident.identify(
        angle, torque, sample_rate=1000, **paper(window_length="51 ms", terms=["offset"], damping=0.1)
    )
    assert result.settings["window_length"] == 51
    assert result.settings["kinds"] == {
        "inertia": "windowed",
        "damping": "known",
        "stiffness": "windowed",
        "offset": "windowed",
    }
    words = result.summary()
    for part in ("1000 samples", "1000 Hz", "windows of 51 samples", "stiffness  windowed", "N m/rad", "EDGE", "good"):
        assert part in words
    assert "inertia 0.00" in repr(result)


def test_the_sample_period_may_come_from_times() -> None:
    angle, torque = system(7, 600)
    t = 12.5 + np.arange(600) / 1000
    expected = tvident.identify(angle, torque, delta=1e-3, method="paper")
    found = tvident.identify(angle, torque, t=t, method="paper")
    np.testing.assert_allclose(found.stiffness, expected.stiffness, rtol=1e-6)
    np.testing.assert_allclose(found.time, t)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        ({"torque": np.ones(999)}, ValueError, r"same shape; got \(1000,\) and \(999,\)"),
        ({"sample_rate": None}, TypeError, "needs the sample period"),
        ({"sample_rate": -1000}, ValueError, "sample_rate must be positive and finite; got -1000"),
        ({"sample_rate": np.inf}, ValueError, "sample_rate must be positive and finite; got inf"),
        ({"method": "magic"}, ValueError, "method must be 'auto', 'paper', a WeakForm or a StrongForm; got 'magic'"),
        (
            {"method": tvident.WeakForm},
            TypeError,
            r"method must be an object; got the class WeakForm; write WeakForm\(\)",
        ),
        ({"window_length": 1001}, ValueError, "window_length must be less than or equal to the length of the record"),
        ({"regression_window": 3}, ValueError, "regression_window must be at least 4"),
        (
            {"regression_window": 2000},
            ValueError,
            "regression_window must be less than or equal to the length of the record; got 2000",
        ),
        ({"inertia": "wobbly"}, ValueError, "inertia must be .* got 'wobbly'"),
        ({"inertia": np.nan}, ValueError, "inertia must be finite; got nan"),
        (
            {"stiffness": np.ones(5)},
            ValueError,
            r"known stiffness must have one value for every sample; got shape \(5,\)",
        ),
        ({"inertia": 1, "damping": 1, "stiffness": 1}, ValueError, "at least one parameter must be unknown"),
        (
            {"terms": ["viscous"]},
            ValueError,
            "a term must be 'offset', 'coulomb', 'cubic', 'preload', 'gravity', 'viscous_asymmetric', 'quadratic_drag' or 'stribeck'; got ",
        ),
        ({"terms": "offset"}, TypeError, r"terms must be a sequence.*write \('offset',\)"),
        ({"terms": ["offset", "offset"]}, ValueError, "'offset' comes twice"),
        ({"terms": [tvident.Term("x", lambda t, a, v: 1.0)]}, ValueError, r"term 'x' must return an array of shape"),  # noqa: ARG005
        ({"angle": np.ones(1000) * 1j}, TypeError, "angle must be real"),
        ({"angle": np.full(1000, np.nan), "nan_policy": "raise"}, ValueError, "angle must hold finite numbers"),
    ],
)
def test_misuse_says_the_rule_the_value_and_the_cure(
    call: dict[str, Any], error: type[Exception], message: str
) -> None:
    angle, torque = system(0, 1000)
    good: dict[str, Any] = {"angle": angle, "torque": torque, "sample_rate": 1000}
    call = good | call
    with pytest.raises(error, match=message):
        tvident.identify(call.pop("angle"), call.pop("torque"), **paper(**call))
