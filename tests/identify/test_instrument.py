"""An instrument under feedback: estimates that noise does not bias, errors that hold, tests that say what it is worth."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from identify.closed_loop import RATE, TRUTH, closed_loop
from parameters import long
from tvident import Status

Array = npt.NDArray[np.float64]

CONSTANT: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}

SEEDS = range(100)

COVERED = {len(SEEDS): (0.90, 0.98), 20: (0.88, 1.0)}
"""Of 95 %, by the number of records. Of 300 intervals, three for each, 2.5 standard deviations are 3.1 %; of 60 they are 7 %."""

STRONG = tvident.StrongForm(window_length=101)


@pytest.fixture(scope="module")
def records() -> tuple[Array, Array, Array]:
    return closed_loop(SEEDS)


@pytest.mark.first(1)
@pytest.mark.parametrize("count", [20, *long(len(SEEDS))], ids="{} records".format)
@pytest.mark.parametrize("method", ["auto", STRONG], ids=["weak", "strong"])
def test_estimates_are_right_under_feedback_and_their_errors_hold(
    records: tuple[Array, Array, Array], method: Any, count: int
) -> None:
    inside = []
    for angle, torque, reference in zip(*(channel[:count] for channel in records), strict=True):
        result = tvident.identify(angle, torque, sample_rate=RATE, method=method, instrument=reference)
        for name, truth in TRUTH.items():
            value, error = result.constants[name]
            # 1 % is more than five standard errors.
            assert value == pytest.approx(truth, rel=0.01)
            inside.append(abs(value - truth) < 1.96 * error)
    least, most = COVERED[count]
    assert least <= np.mean(inside) <= most


@pytest.mark.parametrize(
    ("noise", "order", "window"), [(0.0, 15, 401), (0.02, 15, 401), (0.0, 3, 201)], ids=["clean", "noisy", "low order"]
)
def test_windows_that_smooth_the_motion_are_halved(
    records: tuple[Array, Array, Array], noise: float, order: int, window: int
) -> None:
    """Nearly four periods in a window: order 15 loses more of the acceleration than errors say, order 3 most of it.

    Noise of the reference must not look like lost motion: first stages of short windows would be weak.
    """
    scores = []
    form = tvident.StrongForm(window_length=window, max_order=order)
    for seed, (angle, torque, reference) in enumerate(zip(*(channel[:10] for channel in records), strict=True)):
        # Not the seeds of the records, whose angle has that noise.
        own = reference + noise * np.random.default_rng(5000 + seed).standard_normal(reference.size)
        result = tvident.identify(angle, torque, sample_rate=RATE, method=form, instrument=own)
        again = tvident.identify(angle, torque, sample_rate=RATE, settings=result.settings, instrument=own)
        assert again.constants == result.constants
        assert result.settings["window_length"] < window
        for name, truth in TRUTH.items():
            value, error = result.constants[name]
            # 2 % is more than four standard errors.
            assert value == pytest.approx(truth, rel=0.02)
            scores.append((value - truth) / error)
    # Of 30 scores, the mean square of chance is below 1 + 3 sqrt(2 / 30).
    assert np.mean(np.square(scores)) < 1.8


@pytest.mark.slow
@pytest.mark.first(1)
@pytest.mark.parametrize("every", [1, 10])
@pytest.mark.parametrize("method", ["weak", "strong"])
def test_other_units_and_rates(records: tuple[Array, Array, Array], method: str, every: int) -> None:
    """Degrees and N mm change nothing but the numbers; a tenth of the samples, nothing but the errors."""
    rate, window = RATE / every, {1: 101, 10: 11}[every]
    how: Any = "auto" if method == "weak" else tvident.StrongForm(window_length=window)
    scores = []
    for angle, torque, reference in zip(*(channel[:20, ::every] for channel in records), strict=True):
        plain = tvident.identify(angle, torque, sample_rate=rate, method=how, instrument=reference)
        other = tvident.identify(
            np.rad2deg(angle),
            1e3 * torque,
            sample_rate=rate,
            method=how,
            instrument=np.rad2deg(reference),
            angle_unit="deg",
            torque_unit="N mm",
        )
        for name, truth in TRUTH.items():
            value, error = plain.constants[name]
            assert other.constants[name] == pytest.approx((value, error), rel=1e-6)
            scores.append((value - truth) / error)
    # Of 60 scores, three for each record, the root mean square is one to 15 %.
    assert 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.4


def test_without_an_instrument_feedback_is_said(records: tuple[Array, Array, Array]) -> None:
    angle, torque, reference = (channel[0] for channel in records)
    alone = tvident.identify(angle, torque, sample_rate=RATE, **CONSTANT)
    assert is_said(alone)
    result = tvident.identify(angle, torque, sample_rate=RATE, instrument=reference)
    assert not is_said(result)
    assert "two-stage least squares" in result.summary()
    assert "test of exogeneity" in result.summary()
    assert "the instrument is strong" in result.summary()
    assert result.vaf() > 90


def is_said(result: Any) -> bool:
    return any("holds the angle's noise" in line and "instrument=" in line for line in result.advice)


@pytest.mark.first(1)
@pytest.mark.parametrize("method", ["auto", STRONG], ids=["weak", "strong"])
@pytest.mark.parametrize("samples", [20_000, 2500])
def test_feedback_is_said_in_both_forms_and_of_few_samples(
    records: tuple[Array, Array, Array], samples: int, method: Any
) -> None:
    """Of 2500 samples the spectra have too few long segments."""
    for angle, torque, reference in zip(*(channel[:4, :samples] for channel in records), strict=True):
        assert is_said(tvident.identify(angle, torque, sample_rate=RATE, method=method, **CONSTANT))
        assert not is_said(tvident.identify(angle, torque, sample_rate=RATE, method=method, instrument=reference))


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [range(2), *long(range(2, 40))], ids=str)
def test_open_loop_is_not_taken_for_feedback(seeds: range) -> None:
    for seed in seeds:
        rig = tvident.simulate_torsional_rig(duration=10.0, seed=seed, angle_noise=10.0 ** -(2 + seed % 4))
        both: list[tuple[int, Any]] = [
            (1, "auto"),
            (1, STRONG),
            (10, "auto"),
            (10, tvident.StrongForm(window_length=11)),
        ]
        for every, method in both:
            channels = rig.angle[::every], rig.torque[::every]
            result = tvident.identify(*channels, sample_rate=1000 / every, method=method, **CONSTANT)
            assert not is_said(result), seed


def test_a_channel_that_says_nothing_is_no_instrument(records: tuple[Array, Array, Array]) -> None:
    angle, torque, _ = (channel[0] for channel in records)
    noise = np.random.default_rng(5).standard_normal(angle.size)
    result = tvident.identify(angle, torque, sample_rate=RATE, instrument=noise)
    assert result.record_status & Status.ILL_CONDITIONED
    assert any("the instrument is weak" in line for line in result.advice)
    assert not result.trusted.any()
    nothing = tvident.identify(angle, torque, sample_rate=RATE, instrument=np.zeros(angle.size))
    assert nothing.record_status & Status.RANK_DEFICIENT
    assert np.isnan(nothing.inertia).all()
    assert any("does not determine" in line for line in nothing.advice)


@pytest.mark.parametrize("method", ["auto", STRONG], ids=["weak", "strong"])
def test_a_stiffness_that_changes_is_said(method: Any) -> None:
    """All unknowns are constant with an instrument; damping is 1.4 % off here, by four standard errors, beside a stiffness that is not."""
    how: dict[str, Any] = {"sample_rate": RATE, "method": method}
    for angle, torque, reference in zip(*closed_loop(range(300, 303), growth=0.1), strict=True):
        result = tvident.identify(angle, torque, instrument=reference, **how)
        assert result.record_status & Status.KIND_CONTRADICTED
        assert any("stiffness" in line and "between parts of the record" in line for line in result.advice)


@pytest.mark.parametrize("frequency", [0.15, 0.4])
def test_a_stiffness_that_comes_and_goes_within_parts_is_said(frequency: float) -> None:
    """Parts that are solved on their own take it for noise, and with wide test functions there are few of them."""
    for angle, torque, reference in zip(*closed_loop(range(4300, 4303), swing=(0.05, frequency)), strict=True):
        result = tvident.identify(angle, torque, sample_rate=RATE, instrument=reference)
        assert result.record_status & Status.KIND_CONTRADICTED
        assert any("stiffness" in line and "between parts of the record" in line for line in result.advice)


@pytest.mark.parametrize(("method", "count"), [("auto", 10), (STRONG, 10), *long(("auto", 100), (STRONG, 100))])
def test_constants_that_do_not_change_are_not_said_to(
    records: tuple[Array, Array, Array], method: Any, count: int
) -> None:
    said = 0
    for angle, torque, reference in zip(*(channel[:count] for channel in records), strict=True):
        result = tvident.identify(angle, torque, sample_rate=RATE, method=method, instrument=reference)
        said += bool(result.record_status & Status.KIND_CONTRADICTED)
        assert any("constant: noise explains the differences between parts" in line for line in result.reasons)
    assert said <= count // 50


def test_a_record_that_is_too_short_to_compare_its_parts_says_so(records: tuple[Array, Array, Array]) -> None:
    angle, torque, reference = (channel[0, :1500] for channel in records)
    method = tvident.WeakForm(window_length=151)
    result = tvident.identify(angle, torque, sample_rate=RATE, method=method, instrument=reference)
    assert any("not tested, since single parts of the record tell too little" in line for line in result.reasons)


def test_gaps_batches_terms_and_settings(records: tuple[Array, Array, Array]) -> None:
    angle, torque, reference = (channel[:2].copy() for channel in records)
    angle[0, 5000:5100], torque[1, 200], reference[1, 9000:9003] = np.nan, np.nan, np.nan
    both = tvident.identify(angle, torque, sample_rate=RATE, instrument=reference, terms=["offset", "cubic"])
    for name, truth in TRUTH.items():
        assert both.constants[name][0] == pytest.approx(np.full(2, truth), rel=0.02)
    assert np.abs(both.constants["cubic"][0] / both.constants["cubic"][1]).max() < 4
    one = tvident.identify(angle[0], torque[0], sample_rate=RATE, instrument=reference[0], terms=["offset", "cubic"])
    assert one.constants["inertia"][0] == both.constants["inertia"][0][0]
    again = tvident.identify(angle[0], torque[0], sample_rate=RATE, instrument=reference[0], settings=one.settings)
    assert again.constants == one.constants
    with pytest.raises(ValueError, match=r"settings of a result with an instrument need it again"):
        tvident.identify(angle[0], torque[0], sample_rate=RATE, settings=one.settings)


def test_what_an_instrument_cannot_tell_is_refused_with_the_rule(records: tuple[Array, Array, Array]) -> None:
    angle, torque, reference = (channel[0] for channel in records)

    def call(**changed: Any) -> None:
        tvident.identify(angle, torque, **{"sample_rate": RATE, "instrument": reference, **changed})

    with pytest.raises(
        ValueError, match=r"unknowns must be constant; got stiffness='windowed'; give stiffness='constant'"
    ):
        call(stiffness="windowed")
    with pytest.raises(ValueError, match=r"unknowns must be constant; got term 'offset' windowed"):
        call(terms=[("offset", "windowed")])
    with pytest.raises(ValueError, match=r"terms must be built-in; got 'own'"):
        call(terms=[tvident.Term("own", np.add)])
    with pytest.raises(ValueError, match=r"lag must be known; got 'auto'"):
        call(lag="auto")
    with pytest.raises(ValueError, match=r"must have the angle's shape \(20000,\); got \(100,\)"):
        call(instrument=reference[:100])
