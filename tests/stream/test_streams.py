"""Streams give the batch's numbers, whatever the pieces that samples come in."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable, Sequence
from typing import Any, get_args

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from parameters import examples
from signals import signal
from tvident import Status, StrongForm
from tvident._regression import Alignment

Array = npt.NDArray[np.float64]

RIG = tvident.simulate_torsional_rig(duration=3.0, seed=4)
ANGLE, TORQUE = np.asarray(RIG.angle), np.asarray(RIG.torque)
WINDOWED: dict[str, Any] = dict.fromkeys(("inertia", "damping", "stiffness"), "windowed")
CONSTANT: dict[str, Any] = dict.fromkeys(("inertia", "damping", "stiffness"), "constant")

PIECES = st.lists(st.sampled_from([1, 2, 3, 31, 32, 100, 201, 1000]), min_size=1, max_size=5)


def cut(count: int, lengths: Sequence[int]) -> list[slice]:
    """Give slices of these lengths, again and again, until all is cut."""
    found: list[slice] = []
    first = 0
    while first < count:
        length = lengths[len(found) % len(lengths)]
        found.append(slice(first, min(first + length, count)))
        first += length
    return found


def joined(outs: Sequence[Any], name: str) -> npt.NDArray[Any]:
    return np.concatenate([np.atleast_1d(getattr(out, name)) for out in outs], axis=-1)


def streamed(
    stream: Any, count: int, lengths: Sequence[int], push: Callable[[Any, slice], Any], resume: int
) -> list[Any]:
    """Push everything in pieces, through a pickle after every so manieth of them, and finish."""
    outs = []
    for number, piece in enumerate(cut(count, lengths)):
        outs.append(push(stream, piece))
        if resume and number % resume == 0:
            stream = pickle.loads(pickle.dumps(stream))  # noqa: S301 - our own
    return [*outs, stream.finish()]


@settings(max_examples=examples(6))
@given(
    PIECES,
    st.sampled_from([21, 101, 201]),
    st.sampled_from([None, 5]),
    st.sampled_from([1, 3]),
    st.sampled_from([0, 7]),
)
def test_derivatives_are_those_of_the_batch(
    lengths: list[int], window: int, order: int | None, step: int, resume: int
) -> None:
    y = signal(window, 1200)
    y[500] = np.nan
    stream = tvident.LocalPolynomialStream(window, sample_rate=100, order=order, step=step, stderr=True)
    outs = streamed(stream, y.size, lengths, lambda one, piece: one.push(y[piece]), resume)
    fit = tvident.fit_local_polynomials(y, window, sample_rate=100, order=order, step=step, quantisation=0)
    for name in ("derivatives", "stderr", "order", "sigma", "status"):
        assert np.array_equal(
            joined(outs, name), getattr(fit, name), equal_nan=name in {"derivatives", "stderr", "sigma"}
        )
    assert np.allclose(joined(outs, "time"), np.arange(0, y.size, step) / 100)


SHAPES = (st.integers(1, 5), st.integers(1, 2), st.sampled_from([9, 64, 300]))
"""Regressors, right-hand sides and rows of a window."""
TOLD = st.tuples(st.sampled_from(get_args(Alignment)), st.sampled_from([None, 6, 9]), st.sampled_from([None, 30.0]))
"""Alignment, fewest rows and half-life."""


def assert_same_windows(outs: Sequence[Any], batch: tvident.RollingRegression) -> None:
    for name in ("params", "stderr", "rss", "condition", "status"):
        found = np.concatenate([getattr(out, name) for out in outs])
        assert np.array_equal(found, getattr(batch, name), equal_nan=name != "status"), name


@settings(max_examples=examples(12))
@given(
    PIECES,
    *SHAPES,
    st.sampled_from([1, 4]),
    st.sampled_from([0, 7]),
    TOLD,
)
def test_windows_of_rows_are_those_of_the_batch(
    lengths: list[int],
    p: int,
    q: int,
    window: int,
    step: int,
    resume: int,
    told: tuple[Alignment, int | None, float | None],
) -> None:
    generator = np.random.default_rng(p + 10 * q + window)
    A, b = generator.standard_normal((1000, p)), generator.standard_normal((1000, q))
    A[400, 0] = np.nan
    b[[0, 405, 998], -1] = np.nan
    alignment, least, half_life = told
    options: dict[str, Any] = {"alignment": alignment, "min_observations": least, "step": step}
    if alignment != "centre":
        options["half_life"] = half_life
    stream = tvident.RollingStream(window, **options)
    assert stream.delay == {"centre": window - 1 - window // 2, "trailing": 0, "leading": window - 1}[alignment]
    outs = streamed(stream, 1000, lengths, lambda one, piece: one.push(A[piece], b[piece]), resume)
    batch = tvident.rolling_least_squares(A, b, window, **options)
    assert_same_windows(outs, batch)
    assert np.array_equal(np.concatenate([out.row for out in outs]), np.arange(0, 1000, step))


@settings(max_examples=examples(12))
@given(
    PIECES,
    *SHAPES,
    st.sampled_from([0, 7]),
    TOLD,
    st.sampled_from([1.0, 3e-7, 1e200]),
)
def test_windows_of_weighted_rows_are_those_of_the_batch(
    lengths: list[int],
    p: int,
    q: int,
    window: int,
    resume: int,
    told: tuple[Alignment, int | None, float | None],
    scale: float,
) -> None:
    generator = np.random.default_rng(p + 10 * q + window)
    A, b = generator.standard_normal((1000, p)), generator.standard_normal((1000, q))
    weights = scale * 10 ** generator.uniform(-2, 2, 1000)
    weights[generator.random(1000) < 0.1] = 0
    weights[700:730] = 0
    A[400, 0] = np.nan
    weights[400] = 0
    b[[10, 405, 998], -1] = np.nan
    weights[10] = 0
    alignment, least, half_life = told
    options: dict[str, Any] = {"alignment": alignment, "min_observations": least}
    if alignment != "centre":
        options["half_life"] = half_life
    stream = tvident.RollingStream(window, **options)
    outs = streamed(
        stream, 1000, lengths, lambda one, piece: one.push(A[piece], b[piece], weights=weights[piece]), resume
    )
    batch = tvident.rolling_least_squares(A, b, window, weights=weights, **options)
    assert_same_windows(outs, batch)


@settings(max_examples=examples(4))
@given(PIECES, st.sampled_from([(201, 200), (51, 301), (301, 64)]), st.sampled_from([1, 5]), st.sampled_from([0, 7]))
def test_windowed_parameters_are_those_of_the_batch(
    lengths: list[int], windows: tuple[int, int], step: int, resume: int
) -> None:
    form = StrongForm(window_length=windows[0], regression_window=windows[1])
    angle = ANGLE.copy()
    angle[1500] = np.nan
    more: dict[str, Any] = {
        "terms": (("coulomb", "windowed"),),
        "damping": 0.05,
        "inertia": "windowed",
        "quantisation": 0,
    }
    more |= {"nan_policy": "propagate", "step": step, "sample_rate": 1000, "method": form}
    stream = tvident.IdentificationStream(**more)
    outs = streamed(stream, angle.size, lengths, lambda one, piece: one.push(angle[piece], TORQUE[piece]), resume)
    batch = tvident.identify(angle, TORQUE, **more)
    for name in ("inertia", "stiffness", "residual_std", "condition"):
        assert np.array_equal(joined(outs, name), getattr(batch, name), equal_nan=True), name
    assert np.array_equal(joined(outs, "status"), batch.status)
    assert np.array_equal(joined(outs, "order"), batch.order)
    assert np.array_equal(
        np.concatenate([out.terms["coulomb"] for out in outs]), batch.terms["coulomb"], equal_nan=True
    )
    # Errors so far, at the same samples whatever the pieces: in the end they are those of the record, to a fifth.
    errors = np.concatenate([out.stderr["stiffness"] for out in outs])
    again = tvident.IdentificationStream(**more)
    whole = [again.push(angle, TORQUE), again.finish()]
    assert np.array_equal(errors, np.concatenate([out.stderr["stiffness"] for out in whole]), equal_nan=True)
    ratio = errors / batch.stderr["stiffness"]
    assert np.abs(ratio[np.isfinite(ratio)][-100 // step :] - 1).max() < 0.2


def test_settings_of_a_result_bring_its_standard_errors() -> None:
    batch = tvident.identify(ANGLE, TORQUE, sample_rate=1000, method="paper")
    stream = tvident.IdentificationStream(sample_rate=1000, settings=batch.settings)
    out = stream.push(ANGLE, TORQUE)
    for name in ("inertia", "damping", "stiffness"):
        assert np.array_equal(out.values[name], getattr(batch, name)[: out.time.size], equal_nan=True)
        assert np.array_equal(out.stderr[name], batch.stderr[name][: out.time.size], equal_nan=True)


def test_the_delay_is_what_it_is_said_to_be() -> None:
    for stream in (
        tvident.IdentificationStream(sample_rate=1000, method="paper"),
        tvident.IdentificationStream(sample_rate=1000, method=StrongForm(), **CONSTANT, terms=()),
    ):
        given_so_far = 0
        for sample in range(700):
            out = stream.push(float(ANGLE[sample]), float(TORQUE[sample]))
            given_so_far += out.time.size
            # Nothing is known before the first window of 201 samples is full.
            assert given_so_far == (max(0, sample + 1 - stream.delay) if sample >= 200 else 0)
        # Half of 201 and half of 200 samples, and half of a span of windows.
        assert stream.delay < 400


# Both sum the same rows, of which faer's QR and rotations lose a few digits each: 1e3 roundings, times the condition.
_TO_ROUNDING = 1e3 * np.finfo(float).eps


@settings(max_examples=examples(2))
@given(PIECES, st.sampled_from([0, 7]))
def test_constants_end_where_the_batch_does(lengths: list[int], resume: int) -> None:
    more: dict[str, Any] = {
        "sample_rate": 1000,
        "method": StrongForm(),
        **CONSTANT,
        "terms": ("offset",),
        "quantisation": 0,
    }
    outs = streamed(
        tvident.IdentificationStream(**more),
        ANGLE.size,
        lengths,
        lambda one, piece: one.push(ANGLE[piece], TORQUE[piece]),
        resume,
    )
    batch = tvident.identify(ANGLE, TORQUE, **more)
    for name, (value, error) in batch.constants.items():
        found = np.concatenate([out.values[name] for out in outs])[-1]
        assert abs(found - value) < _TO_ROUNDING * batch.condition[0] ** 2 * max(abs(value), error)
        # Read off before the last of the equations came: their correlation is known to a few percent.
        assert np.concatenate([out.stderr[name] for out in outs])[-1] == pytest.approx(error, rel=0.05)


def _rows(angle: Array) -> Array:
    """Give angle, velocity, acceleration at every sample around which a full window lies."""
    fit = tvident.fit_local_polynomials(angle, 201, sample_rate=1000, quantisation=0)
    return fit.derivatives[::-1, 100:-100].T


def test_forgetting_weighs_equations_by_their_age() -> None:
    stream = tvident.IdentificationStream(
        sample_rate=1000, method=StrongForm(), **CONSTANT, terms=(), half_life="0.3 s", quantisation=0
    )
    out = stream.push(ANGLE, TORQUE)
    rows, sides = _rows(ANGLE), TORQUE[100:-100]
    for sample in (600, 1500, out.time.size - 1):
        upto = sample - 100 + 1
        root = np.sqrt(0.5 ** (np.arange(upto)[::-1] / 300))
        expected = np.linalg.lstsq(rows[:upto] * root[:, None], sides[:upto] * root, rcond=None)[0]
        found = [out.values[name][sample] for name in CONSTANT]
        assert np.allclose(found, expected, rtol=1e-6)


def test_what_a_stream_gave_pickles_with_its_names() -> None:
    more: dict[str, Any] = {"sample_rate": 1000, "method": "paper", "inertia": 0.0124, "start": 2.0}
    out = tvident.IdentificationStream(**more).push(ANGLE[:1000], TORQUE[:1000])
    kept = pickle.loads(pickle.dumps(out))  # noqa: S301 - our own
    assert list(kept.values) == list(kept.stderr) == ["damping", "stiffness", "inertia"]
    for one in (out, kept):
        assert one.time[0] == 2.0
        assert np.all(one.inertia == 0.0124)
        assert np.all(one.stderr["inertia"] == 0)
        assert one.terms == {}
        assert one.values is one.values
    for name in ("time", "stiffness", "residual_std", "condition", "order", "status", "trusted"):
        assert np.array_equal(getattr(kept, name), getattr(out, name), equal_nan=name != "trusted"), name
    assert np.array_equal(kept.stderr["damping"], out.stderr["damping"], equal_nan=True)
    assert repr(out) == f"<StreamedIdentification of damping, stiffness at {out.time.size} samples>"


def test_what_is_held_stays_and_what_is_reset_begins_anew() -> None:
    more: dict[str, Any] = {"sample_rate": 1000, "method": StrongForm(), **CONSTANT, "terms": (), "quantisation": 0}
    stream = tvident.IdentificationStream(**more)
    before = stream.push(ANGLE[:1500], TORQUE[:1500]).stiffness[-1]
    stream.hold = True
    held = pickle.loads(pickle.dumps(stream)).push(ANGLE[1500:2000], TORQUE[1500:2000])  # noqa: S301 - our own
    assert np.array_equal(held.stiffness, np.full(500, before))
    stream.hold = False
    stream.reset()
    out = stream.push(ANGLE[1500:], TORQUE[1500:])
    done = ANGLE.size - stream.delay
    rows, sides = _rows(ANGLE), TORQUE[100:-100]
    first = 1500 - stream.delay - 100
    expected = np.linalg.lstsq(rows[first : done - 100], sides[first : done - 100], rcond=None)[0]
    assert np.allclose([out.values[name][-1] for name in CONSTANT], expected, rtol=1e-6)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({}, "whole record.*settings= of an earlier result"),
        ({"method": tvident.WeakForm()}, "whole record.*settings= of an earlier result"),
        ({"method": StrongForm()}, "all 'windowed' or all 'constant'; got auto"),
        ({"method": StrongForm(selection="pooled"), **WINDOWED}, "selection='pooled'"),
        ({"method": StrongForm(filter_torque=True), **WINDOWED}, "filter_torque=True"),
        ({"method": "paper", "lag": 0.002}, "got lag.*so many samples later"),
        ({"method": "paper", "period": 6.28}, "got period.*unwrap"),
        ({"method": "paper", "terms": ("stribeck",)}, "built-in, without inner parameters"),
        ({"method": "paper", "half_life": 100}, "half_life is for constants"),
        ({"method": StrongForm(), "inertia": 1.0, "damping": 1.0, "stiffness": 1.0, "terms": ()}, "at least one"),
    ],
)
def test_what_needs_the_whole_record_says_so(more: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        tvident.IdentificationStream(sample_rate=1000, **more)


def test_wrong_calls_say_what_would_be_right() -> None:
    with pytest.raises(TypeError, match="sample period"):
        tvident.IdentificationStream(method="paper")
    for length, words in (("auto", "whole record"), (20, "odd"), (3, "at least 5")):
        with pytest.raises(ValueError, match=words):
            tvident.LocalPolynomialStream(length)
    with pytest.raises(ValueError, match="windows after"):
        tvident.LocalPolynomialStream(21, selection="pooled")
    stream = tvident.LocalPolynomialStream(21, nan_policy="raise")
    stream.push(np.ones(30))
    with pytest.raises(ValueError, match="sample 31 is nan"):
        stream.push([1.0, np.nan])
    stream.finish()
    with pytest.raises(ValueError, match="after its end"):
        stream.push(1.0)
    rolling = tvident.RollingStream(5)
    with pytest.raises(ValueError, match="must have rows"):
        rolling.finish()
    rolling.push(np.ones((3, 2)), np.ones(3))
    with pytest.raises(ValueError, match="alignment must be"):
        tvident.RollingStream(5, alignment="left")  # type: ignore[arg-type]
    for least in (0, 6):
        with pytest.raises(ValueError, match="min_observations"):
            tvident.RollingStream(5, min_observations=least)
    with pytest.raises(ValueError, match="half_life must go with alignment"):
        tvident.RollingStream(5, half_life=3)
    with pytest.raises(ValueError, match="more rows than the 3 regressors"):
        tvident.RollingStream(9, half_life=0.5, alignment="trailing").push(np.ones((9, 3)), np.ones(9))
    with pytest.raises(ValueError, match="more than the 3 regressors"):
        tvident.RollingStream(5, min_observations=3).push(np.ones((9, 3)), np.ones(9))
    with pytest.raises(ValueError, match="2 regressors and 1 right-hand sides"):
        rolling.push(np.ones((3, 3)), np.ones(3))
    with pytest.raises(ValueError, match="as many samples"):
        tvident.IdentificationStream(sample_rate=1, method="paper").push([1.0, 2.0], 1.0)


def test_a_stream_of_another_version_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = tvident.LocalPolynomialStream(51)
    stream.push(ANGLE[:500])
    kept = pickle.dumps(stream)
    assert pickle.loads(kept).samples == 500  # noqa: S301 - our own
    monkeypatch.setattr("tvident._stream.pieces.VERSION", "9.9")
    with pytest.raises(ValueError, match=r"one of tvident 0\.\S+ in 9\.9; begin another"):
        pickle.loads(kept)  # noqa: S301 - our own


def test_pieces_of_nothing_change_nothing() -> None:
    A, b = np.stack([ANGLE, TORQUE], axis=1), TORQUE

    def rows(stream: Any, piece: slice) -> Any:
        return stream.push(A[piece], b[piece])

    def pairs(stream: Any, piece: slice) -> Any:
        return stream.push(ANGLE[piece], TORQUE[piece])

    weak = tvident.identify(ANGLE, TORQUE, sample_rate=1000).settings
    for make, push, name in (
        (lambda: tvident.LocalPolynomialStream(51), lambda one, piece: one.push(ANGLE[piece]), "derivatives"),
        (lambda: tvident.RollingStream(50), rows, "rss"),
        (lambda: tvident.IdentificationStream(sample_rate=1000, method="paper"), pairs, "stiffness"),
        (lambda: tvident.IdentificationStream(sample_rate=1000, settings=weak), pairs, "stiffness"),
    ):
        stream = make()
        outs = [push(stream, slice(*ends)) for ends in ((0, 0), (0, 1500), (1500, 1500), (1500, 3000), (3000, 3000))]
        outs.append(stream.finish())
        other = make()
        whole = [push(other, slice(0, 3000)), other.finish()]
        assert np.array_equal(joined(outs, name), joined(whole, name), equal_nan=True), name


def test_a_short_stream_knows_nothing() -> None:
    stream = tvident.IdentificationStream(sample_rate=1000, method="paper")
    stream.push(ANGLE[:50], TORQUE[:50])
    out = stream.finish()
    assert out.time.size == 50
    assert np.isnan(out.stiffness).all()
    assert (out.status & Status.INVALID != 0).all()
    assert not out.trusted.any()


def test_one_sample_takes_few_calls() -> None:
    stream = tvident.IdentificationStream(sample_rate=1000.0, method="paper")
    calls = 0

    def count(_frame: Any, event: str, _argument: Any) -> None:
        nonlocal calls
        calls += event in {"call", "c_call"}

    # What comes a thousand times a second is not asked for its unit, nor is the equation for its names: 53 calls before, 16 since then.
    sys.setprofile(count)
    try:
        for place in range(600):
            stream.push(ANGLE[place : place + 1], TORQUE[place : place + 1])
    finally:
        sys.setprofile(None)
    assert calls <= 20 * 600


@pytest.mark.parametrize("rows", [10**14, 2**62])
def test_windows_without_memory_are_refused(rows: int) -> None:
    """Nothing is lost: the process goes on."""
    sine = np.sin(np.arange(300) / 20)
    with pytest.raises(MemoryError, match="memory"):
        tvident.RollingStream(rows).push(sine, sine)
    form = StrongForm(21, regression_window=rows)
    windowed: dict[str, Any] = {"inertia": "windowed", "damping": "windowed", "terms": ()}
    with pytest.raises(MemoryError, match="memory"):
        tvident.IdentificationStream(sample_rate=100.0, method=form, **windowed)
