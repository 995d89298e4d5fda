from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from calls import plain_weak, weak
from parameters import examples, long
from reference.weak_form import profile, roots, rows
from tvident import Status

Array = npt.NDArray[np.float64]

EXACT = 1e-9
"""Promised error of inertia, damping and stiffness without noise, for half-widths from 80 samples and exponents from 8."""
CONSTANT: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
SYSTEM = {"inertia": 0.0123, "damping": 0.00825, "stiffness": 13.0}


def multisine(n: int, seed: int = 0, delta: float = 1e-3) -> tuple[Array, Array]:
    """Give angle and torque of a constant system that moves with 24 frequencies, at any time as it should be."""
    generator = np.random.default_rng(seed)
    t = np.arange(n) * delta
    angle, torque = np.zeros(n), np.zeros(n)
    for frequency in np.linspace(0.5, 12, 24):
        omega, phase = 2 * np.pi * frequency, generator.uniform(0, 2 * np.pi)
        angle += np.sin(omega * t + phase) / (1 + frequency)
        torque += (SYSTEM["stiffness"] - SYSTEM["inertia"] * omega**2) * np.sin(omega * t + phase) / (1 + frequency)
        torque += SYSTEM["damping"] * omega * np.cos(omega * t + phase) / (1 + frequency)
    return angle, torque


def errors(result: tvident.Identification) -> list[float]:
    """Give the relative errors of the constants."""
    return [abs(result.constants[name][0] / SYSTEM[name] - 1) for name in result.constants if name in SYSTEM]


@pytest.mark.parametrize("half", [80, 113, 226, 320])
@pytest.mark.parametrize("exponent", [8, 9, 12])
def test_without_noise_the_parameters_are_exact(half: int, exponent: int) -> None:
    angle, torque = multisine(20_000)
    call: dict[str, Any] = {
        "sample_rate": 1000,
        "window_length": 2 * half + 1,
        "exponent": exponent,
    }
    assert max(errors(tvident.identify(angle, torque, **plain_weak(**call, **CONSTANT)))) < EXACT
    # An offset of the angle that the spring bears.
    leaning = tvident.identify(angle + 1e3, torque + SYSTEM["stiffness"] * 1e3, **plain_weak(**call, **CONSTANT))
    assert max(errors(leaning)) < EXACT
    windowed = tvident.identify(
        angle, torque, **plain_weak(regression_window=3000, **call, inertia="constant", damping="constant")
    )
    assert max(errors(windowed)) < EXACT
    valid = windowed.status & Status.INVALID == 0
    np.testing.assert_allclose(windowed.stiffness[valid], SYSTEM["stiffness"], rtol=1e-7)


@pytest.mark.parametrize("n", [1_000_000, *long(10_000_000)])
def test_millions_of_samples_with_a_drift_lose_no_digits(n: int) -> None:
    angle, torque = multisine(8000)
    angle, torque = np.tile(angle, n // 8000), np.tile(torque, n // 8000)
    drift = np.linspace(0, 100, n)
    found = tvident.identify(
        angle + drift, torque + SYSTEM["stiffness"] * drift, sample_rate=1000, **plain_weak(step=100_000, **CONSTANT)
    )
    # A drift has a velocity too.
    expected = SYSTEM["stiffness"]
    assert abs(found.constants["stiffness"][0] / expected - 1) < 1e-6
    assert abs(found.constants["inertia"][0] / SYSTEM["inertia"] - 1) < 1e-4


@settings(max_examples=examples(15))
@given(
    seed=st.integers(0, 2**32),
    half=st.integers(5, 60),
    exponent=st.integers(3, 12),
    lag=st.sampled_from([0.0, 3.0, -0.4, 1.7]),
    weighted=st.booleans(),
)
def test_constants_are_least_squares_of_the_rows(
    seed: int, half: int, exponent: int, lag: float, weighted: bool
) -> None:
    generator = np.random.default_rng(seed)
    angle, torque = multisine(2000, seed)
    torque = torque + 0.3 * generator.standard_normal(2000)
    weights = generator.uniform(0.1, 3, 2000) * np.exp(generator.uniform(-3, 3) * np.linspace(-1, 1, 2000))
    found = tvident.identify(
        angle,
        torque,
        sample_rate=1000,
        weights=weights if weighted else None,
        **plain_weak(window_length=2 * half + 1, exponent=exponent, lag=lag * 1e-3, **CONSTANT),
    )
    A, b = rows(angle, torque, half, exponent, 1e-3, lag)
    if weighted:
        root = roots(weights, half, exponent, 1e-3, lag)
        A, b = A * root[:, np.newaxis], b * root
    usable = np.isfinite(b)
    expected = np.linalg.lstsq(A[usable], b[usable])[0]
    # The angle is a sum of sines, so what is taken for its noise is rounding, and nothing is corrected for.
    for value, (name, (constant, _)) in zip(expected, found.constants.items(), strict=True):
        assert constant == pytest.approx(value, rel=1e-6), name


@pytest.mark.parametrize("variation", ["constant", "linear"])
def test_constants_beside_what_is_windowed_are_best_for_all_windows_together(variation: str) -> None:
    half, exponent, window = 40, 8, 64
    generator = np.random.default_rng(1)
    angle, torque = multisine(6000)
    torque = torque + 0.05 * generator.standard_normal(6000)
    found = tvident.identify(
        angle,
        torque,
        sample_rate=1000,
        **plain_weak(
            window_length=2 * half + 1,
            regression_window=window * 6,
            variation=variation,
            inertia="constant",
            damping="constant",
        ),
    )
    A, b = rows(angle, torque, half, exponent, 1e-3)
    columns = [A[:, 2]]
    if variation == "linear":
        # ⟨φ τ θ⟩ around each row's centre, and the row's own time.
        kernel = np.arange(-half, half + 1) * 1e-3 * (1 - (np.arange(-half, half + 1) / half) ** 2) ** exponent
        kernel /= ((1 - (np.arange(-half, half + 1) / half) ** 2) ** exponent).sum()
        centres = np.arange(half, angle.size - half, 6)
        companion = np.array([kernel @ angle[c - half : c + half + 1] for c in centres])
        columns.append(companion + centres * 1e-3 * A[:, 2])
    expected = profile(np.stack(columns, axis=1), A[:, :2], b, window, 8)
    assert found.constants["inertia"][0] == pytest.approx(expected[0], rel=1e-7)
    assert found.constants["damping"][0] == pytest.approx(expected[1], rel=1e-6)


def test_known_coefficients_that_change_are_integrated_by_parts_too() -> None:
    n = 20_000
    t = np.arange(n) / 1000
    generator = np.random.default_rng(2)
    angle, velocity, acceleration = np.zeros(n), np.zeros(n), np.zeros(n)
    for frequency in generator.uniform(1, 10, 12):
        omega, phase = 2 * np.pi * frequency, generator.uniform(0, 6)
        angle += np.sin(omega * t + phase)
        velocity += omega * np.cos(omega * t + phase)
        acceleration -= omega**2 * np.sin(omega * t + phase)
    inertia = 0.01 * (1 + 0.3 * np.sin(2 * np.pi * 0.4 * t))
    damping = 0.1 * (1 + 0.5 * np.cos(2 * np.pi * 0.3 * t))
    stiffness = 15 + 3 * np.sin(2 * np.pi * 0.5 * t)
    torque = inertia * acceleration + damping * velocity + stiffness * angle
    everything = {"inertia": inertia, "damping": damping, "stiffness": stiffness}
    for unknown, true in (("inertia", 1.0), ("damping", 1.0), ("stiffness", 1.0)):
        known: dict[str, Any] = {name: value for name, value in everything.items() if name != unknown}
        extra = {"inertia": acceleration, "damping": velocity, "stiffness": angle}[unknown]
        result = tvident.identify(
            angle,
            torque + extra,
            sample_rate=1000,
            **plain_weak(window_length=161, regression_window=200, variation="linear", **known),
        )
        valid = result.status & (Status.INVALID | Status.EDGE) == 0
        found = getattr(result, unknown)[valid]
        # A coefficient that bends within a window of 0.2 s is followed by a line.
        np.testing.assert_allclose(found, everything[unknown][valid] + true, rtol=0.02)


def test_missing_and_masked_samples_cost_their_own_rows_only() -> None:
    angle, torque = multisine(6000)
    noisy = torque + 0.05 * np.random.default_rng(3).standard_normal(6000)
    call: dict[str, Any] = {
        "sample_rate": 1000,
        "window_length": 161,
        "exponent": 8,
        **CONSTANT,
    }
    angle[3000], noisy[1000] = np.nan, np.inf
    found = tvident.identify(angle, noisy, **plain_weak(**call))
    centres = np.arange(80, 6000 - 80, 13)
    hit = (np.abs(centres - 3000) <= 80) | (np.abs(centres - 1000) <= 80)
    A, b = rows(np.nan_to_num(angle), np.nan_to_num(noisy, posinf=0.0), 80, 8, 1e-3)
    expected = np.linalg.lstsq(A[~hit], b[~hit])[0]
    for value, (name, (constant, _)) in zip(expected, found.constants.items(), strict=True):
        assert constant == pytest.approx(value, rel=1e-6), name
    mask = np.abs(np.arange(6000) - 4000) > 300
    masked = tvident.identify(angle, noisy, **plain_weak(mask=mask, **call))
    hit |= np.abs(centres - 4000) <= 300
    expected = np.linalg.lstsq(A[~hit], b[~hit])[0]
    assert masked.constants["stiffness"][0] == pytest.approx(expected[2], rel=1e-6)


def test_a_window_of_rows_around_every_sample_shrinks_towards_the_ends() -> None:
    angle, torque = multisine(4000)
    torque = torque + 0.01 * np.random.default_rng(4).standard_normal(4000)
    result = tvident.identify(angle, torque, sample_rate=1000, **plain_weak(window_length=81, regression_window=400))
    middle = result.status[600:-600]
    assert (middle & (Status.EDGE | Status.INVALID) == 0).all()
    assert result.status[0] & Status.EDGE
    assert (np.isnan(result.stiffness) == (result.status & Status.INVALID != 0)).all()
    assert np.nanmedian(result.stiffness) == pytest.approx(13.0, rel=1e-2)


@pytest.mark.first(1)
@pytest.mark.parametrize("workers", [2, 5])
def test_the_numbers_do_not_depend_on_the_number_of_workers(workers: int) -> None:
    recording = tvident.simulate_torsional_rig(60.0, angle_noise=1e-2)
    calls: list[dict[str, Any]] = [{}, plain_weak(inertia="constant")]
    for call in calls:
        one, many = (
            tvident.identify(recording.angle, recording.torque, sample_rate=1000, workers=count, **call)
            for count in (1, workers)
        )
        assert one.constants == many.constants
        for name, values in one.columns().items():
            np.testing.assert_array_equal(values, many.columns()[name], err_msg=name)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        ({"exponent": 2}, ValueError, "exponent must be between 3 and 20; got 2"),
        ({"exponent": 8.5}, TypeError, "exponent must be a whole number; got 8.5"),
        ({"window_length": 7}, ValueError, "window_length must be at least 9; got 7"),
        ({"regression_window": 0}, ValueError, "regression_window must be at least 1; got 0"),
        ({"averaging": 1}, TypeError, "averaging must be True or False; got 1"),
        ({"variation": "cubic"}, ValueError, "variation must be .* got 'cubic'"),
        ({"mask": np.ones(5, bool)}, ValueError, r"mask must have one value for every sample; got shape \(5,\)"),
        ({"mask": np.ones(1000)}, TypeError, "mask must hold True and False; got float64"),
        ({"settings": {"form": "weak"}}, TypeError, "settings must be those of an earlier result"),
        ({"lag": np.inf}, ValueError, "lag must be finite; got inf"),
    ],
)
def test_misuse_says_the_rule_the_value_and_the_cure(
    call: dict[str, Any], error: type[Exception], message: str
) -> None:
    angle, torque = multisine(1000)
    with pytest.raises(error, match=message):
        tvident.identify(angle, torque, sample_rate=1000, **plain_weak(**call))


@pytest.mark.slow
def test_constants_alone_are_weighted_by_their_noise(rig_of_constants: list[tvident.Recording]) -> None:
    squares: dict[Literal["average", "window"], list[float]] = {"average": [], "window": []}
    scores = []
    for rig in rig_of_constants:
        truth = {"inertia": rig.inertia[0], "damping": rig.damping[0], "stiffness": rig.stiffness[0]}
        for selection, list_of in squares.items():
            found = tvident.identify(
                rig.angle, rig.torque, sample_rate=1000, **weak(averaging=selection == "average", **CONSTANT)
            )
            weighted = [reason for reason in found.reasons if "weighted by the inverse" in reason]
            assert len(weighted) == (selection == "average")
            list_of.append(found.constants["stiffness"][0] / truth["stiffness"] - 1)
            if selection == "average":
                scores += [(found.constants[name][0] - true) / found.constants[name][1] for name, true in truth.items()]
    weighted, alike = (np.sqrt(np.mean(np.square(values))) for values in squares.values())
    # With 10 % of noise those that count alike err 1.9 times as much as maximum likelihood may (`make accuracy`); 16 tell ± 18 %.
    assert weighted < 0.75 * alike
    # 48 scores of which each three are dependent: their mean square is that of some 16 independent ones at worst.
    assert 0.4 < np.mean(np.square(scores)) < 2.0


@pytest.fixture
def rig_of_constants() -> list[tvident.Recording]:
    return [tvident.simulate_torsional_rig(12.0, seed=seed, pattern="constant", angle_noise=0.1) for seed in range(16)]


def test_equations_count_alike_where_the_noise_model_fails() -> None:
    angle, torque = multisine(8000)
    generator = np.random.default_rng(4)
    torque = torque + 0.02 * generator.standard_normal(8000) + 0.2 * np.sign(np.gradient(angle))
    both = [
        tvident.identify(
            angle,
            torque,
            sample_rate=1000,
            **weak(averaging=selection == "average", window_length=121, exponent=8, **CONSTANT),
        )
        for selection in ("average", "window")
    ]
    assert Status.NOISE_MODEL in both[0].record_status
    assert both[0].constants == both[1].constants


@pytest.mark.first(1)
@pytest.mark.parametrize("samples", [16_393, 16_425, 16_440])
def test_records_that_end_just_behind_a_piece_of_work_are_like_others(samples: int) -> None:
    # Rows are worked on by the 8192, of every second sample with this test function.
    rig = tvident.simulate_torsional_rig(17.0, seed=1)
    found = tvident.identify(rig.angle[:samples], rig.torque[:samples], sample_rate=1000, **weak(window_length=31))
    assert abs(found.constants["inertia"][0] / rig.inertia[0] - 1) < 0.05


def test_a_disturbance_where_the_noise_is_least_is_not_given_weight() -> None:
    # At 5 Hz, near the resonance, the angle's noise hides nothing of it; equations that count alike hardly notice.
    rig = tvident.simulate_torsional_rig(12.0, seed=0, pattern="constant", angle_noise=0.1)
    hum = 0.05 * rig.torque.std() * np.sin(2 * np.pi * 5.0 * rig.time + 1)
    found = tvident.identify(rig.angle, rig.torque + hum, sample_rate=1000, **CONSTANT)
    alike = tvident.identify(rig.angle, rig.torque + hum, sample_rate=1000, **weak(averaging=False, **CONSTANT))
    assert found.constants == alike.constants


@pytest.mark.slow
def test_windows_as_long_as_the_record_are_told() -> None:
    rig = tvident.simulate_torsional_rig(12.0, seed=5)
    for more, is_told in (({}, True), ({"regression_window": "0.2 s"}, False), (CONSTANT, False)):
        found = tvident.identify(rig.angle, rig.torque, sample_rate=1000, **weak(averaging=False, **more))
        lines = [line for line in found.advice if line.startswith("windows are as long as the record")]
        assert bool(lines) == is_told
        assert found.advice[:1] == tuple(lines) or not is_told
        assert not is_told or "give regression_window=, such as '0.2 s', or ask for averaging" in lines[0]
    both = tvident.identify(
        [rig.angle] * 2, [rig.torque] * 2, sample_rate=1000, method=tvident.WeakForm(averaging=False)
    )
    assert any("windows are as long as the record" in line for line in both[1].advice)


def test_residuals_of_weighted_equations_are_those_of_the_torque() -> None:
    rig = tvident.simulate_torsional_rig(12.0, seed=3, pattern="constant", angle_noise=1e-2)
    left = [
        np.median(
            tvident.identify(
                rig.angle, scale * rig.torque, sample_rate=1000, **weak(averaging=selection == "average", **CONSTANT)
            ).residual_std
        )
        for selection in ("average", "window")
        for scale in (1.0, 1000.0)
    ]
    # The constants differ by a part of their standard errors, so what they leave does by far less than a hundredth.
    np.testing.assert_allclose(left, [left[0], 1000 * left[0]] * 2, rtol=0.01)


def test_rows_outside_a_mask_of_short_runs_are_made_as_white_as_those_inside() -> None:
    rig = tvident.simulate_torsional_rig(12.0, seed=3, pattern="constant", angle_noise=1e-2)
    mask = np.arange(rig.angle.size) % 400 < 60
    found = tvident.identify(rig.angle, rig.torque, sample_rate=1000, mask=mask, **CONSTANT)
    assert "outside the mask" not in found.summary()
    assert Status.NOISE_MODEL not in found.record_status
    assert (found.status & Status.NOISE_MODEL == 0).all()


def test_enormous_samples_are_in_the_residuals_of_their_windows_only() -> None:
    angle, torque = multisine(20_000)
    torque += 0.01 * np.random.default_rng(3).standard_normal(torque.size)
    known = {name: SYSTEM[name] for name in ("inertia", "damping")}
    call = plain_weak(sample_rate=1000, window_length=161, regression_window=500, **known)
    clean = tvident.identify(angle, torque, **call).residual_std
    torque[5000:5002] = 1e8  # a single one would be left out
    hit = tvident.identify(angle, torque, **call).residual_std
    # A row reaches as far as its test function, a residual as far as the window of its row.
    far = np.abs(np.arange(20_000) - 5000) > 2 * (161 + 500)
    assert hit[5000] > 1e3
    np.testing.assert_allclose(hit[far], clean[far], rtol=1e-6)
