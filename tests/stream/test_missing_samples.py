"""A stream leaves out missing samples, and weighs others, as the batch does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tvident
from parameters import examples
from stream.test_streams import ANGLE, CONSTANT, PIECES, TORQUE, WINDOWED, joined, streamed
from tvident import Status, StrongForm
from tvident._arguments import RowPolicy

Array = npt.NDArray[np.float64]

COUNT = ANGLE.size


def spoilt(seed: int, *, share: float) -> tuple[Array, Array]:
    """Give the channels with samples lost: some alone in each, short bursts in both, a long one, at the ends too."""
    generator = np.random.default_rng(seed)
    angle, torque = ANGLE.copy(), TORQUE.copy()
    for channel in (angle, torque):
        channel[generator.random(COUNT) < share] = np.nan
    for first, length in ((1, 2), (700, 5), (1500, 12), (1800, 60), (2400, 13), (COUNT - 3, 2)):
        angle[first : first + length] = torque[first : first + length] = np.nan
    return angle, torque


def weights_of(seed: int) -> Array:
    generator = np.random.default_rng(seed)
    weights = 10 ** generator.uniform(-1, 1, COUNT)
    weights[generator.random(COUNT) < 0.005] = 0
    weights[:3] = weights[1000:1008] = 0
    return weights


def pieces(
    stream: Any, lengths: Sequence[int], channels: tuple[Array, Array], weights: Array | None, resume: int
) -> Any:
    angle, torque = channels

    def push(one: Any, piece: slice) -> Any:
        return one.push(angle[piece], torque[piece], **({} if weights is None else {"weights": weights[piece]}))

    return streamed(stream, COUNT, lengths, push, resume)


@settings(max_examples=examples(6))
@given(
    PIECES,
    st.sampled_from([(201, 200, 15), (51, 301, 4), (301, 64, 15)]),
    st.sampled_from([1, 5]),
    st.sampled_from([0, 7]),
    st.sampled_from(["omit", "propagate", "raise"]),
    st.booleans(),
    st.integers(0, 3),
)
def test_windows_beside_gaps_are_those_of_the_batch(
    lengths: list[int],
    windows: tuple[int, int, int],
    step: int,
    resume: int,
    policy: RowPolicy,
    weighted: bool,
    seed: int,
) -> None:
    form = StrongForm(window_length=windows[0], regression_window=windows[1], max_order=windows[2])
    # Where nothing may be missing, samples without weight are all the same.
    channels = (ANGLE, TORQUE) if policy == "raise" else spoilt(seed, share=0.003 if policy == "omit" else 0.0)
    weights = weights_of(seed) if weighted else None
    more: dict[str, Any] = {"nan_policy": policy, "step": step, "sample_rate": 1000, "terms": ()}
    call = {**more, **WINDOWED, "method": form, "quantisation": 0, "weights": weights}
    batch = tvident.identify(*channels, **call)
    stream = tvident.IdentificationStream(**more, settings=batch.settings)
    outs = pieces(stream, lengths, channels, weights, resume)
    for name in ("inertia", "damping", "stiffness", "condition"):
        assert np.array_equal(joined(outs, name), getattr(batch, name), equal_nan=True), name
    for name in WINDOWED:
        errors = np.concatenate([out.stderr[name] for out in outs])
        assert np.array_equal(errors, batch.stderr[name], equal_nan=True), name
    assert np.array_equal(joined(outs, "status"), batch.status)
    assert np.array_equal(joined(outs, "order"), batch.order)
    # Of a sample of weight one, and of one of mean weight.
    root = 1.0 if weights is None else np.sqrt(weights[weights > 0].mean())
    np.testing.assert_allclose(joined(outs, "residual_std"), batch.residual_std * root, rtol=1e-14)


@pytest.mark.parametrize("weighted", [False, True])
def test_windows_beside_gaps_are_those_of_a_record_that_is_held_as_a_whole(weighted: bool) -> None:
    channels, weights = spoilt(1, share=0.003), weights_of(1) if weighted else None
    more: dict[str, Any] = {"sample_rate": 1000, "method": "paper", "weights": weights}
    piece_by_piece = tvident.identify(*channels, **more)
    # A mask of all samples leaves nothing out, and has a record held as a whole.
    whole = tvident.identify(*channels, **more, mask=np.ones(COUNT, bool))
    both = np.isfinite(whole.stiffness)
    # Near the ends and in long gaps the one asks for half of a window between the first equation and the last, the other of the record.
    assert np.array_equal(both[300:-300], np.isfinite(piece_by_piece.stiffness)[300:-300])
    for name in WINDOWED:
        one, other = getattr(piece_by_piece, name)[both], getattr(whole, name)[both]
        np.testing.assert_allclose(one, other, rtol=1e-7)
        np.testing.assert_allclose(piece_by_piece.stderr[name][both], whole.stderr[name][both], rtol=1e-6)
    flags = Status.GAP | Status.INVALID
    assert np.array_equal((piece_by_piece.status & flags)[300:-300], (whole.status & flags)[300:-300])


def test_windows_away_from_gaps_have_the_bits_of_the_whole_record() -> None:
    angle, torque = ANGLE.copy(), TORQUE.copy()
    angle[1500:1503] = np.nan
    more: dict[str, Any] = {"sample_rate": 1000, "method": "paper", "quantisation": 0}
    found, whole = tvident.identify(angle, torque, **more), tvident.identify(ANGLE, TORQUE, **more)
    away = np.abs(np.arange(COUNT) - 1501) > 1 + 100 + 100
    np.testing.assert_allclose(found.stiffness[away], whole.stiffness[away], rtol=1e-9)
    assert np.array_equal(found.status[away], whole.status[away])
    # The same bits from the next start of the polynomials' windows on: there are at most 256 from one to the next.
    away = np.abs(np.arange(COUNT) - 1501) > 1 + 100 + 100 + 256
    assert np.array_equal(found.stiffness[away], whole.stiffness[away], equal_nan=True)
    assert np.isfinite(found.stiffness[1501])
    assert found.status[1501] & Status.GAP


@settings(max_examples=examples(3))
@given(PIECES, st.sampled_from([0, 7]), st.booleans())
def test_constants_beside_gaps_end_where_the_batch_does(lengths: list[int], resume: int, weighted: bool) -> None:
    more: dict[str, Any] = {
        "sample_rate": 1000,
        "method": StrongForm(),
        **CONSTANT,
        "terms": ("offset",),
        "quantisation": 0,
    }
    more["nan_policy"] = "omit"
    channels, weights = spoilt(2, share=0.01), weights_of(2) if weighted else None
    batch = tvident.identify(*channels, **more, weights=weights)
    outs = pieces(tvident.IdentificationStream(**more), lengths, channels, weights, resume)
    for name, (value, error) in batch.constants.items():
        found = np.concatenate([out.values[name] for out in outs])[-1]
        assert abs(found - value) < 1e-7 * max(abs(value), error)
        assert np.concatenate([out.stderr[name] for out in outs])[-1] == pytest.approx(error, rel=0.1)


def test_constants_lose_little_where_one_sample_of_a_hundred_is_lost() -> None:
    angle = ANGLE.copy()
    angle[np.random.default_rng(3).random(COUNT) < 0.01] = np.nan
    more: dict[str, Any] = {"sample_rate": 1000, "method": StrongForm(), **CONSTANT, "terms": ()}
    whole, found = tvident.identify(ANGLE, TORQUE, **more), tvident.identify(angle, TORQUE, **more)
    for name, (value, error) in found.constants.items():
        expected, own = whole.constants[name]
        assert abs(value - expected) < 2 * own, name
        assert error < 1.3 * own, name


def test_samples_of_a_stream_all_have_weights_or_none_has() -> None:
    more: dict[str, Any] = {"sample_rate": 1000, "method": "paper"}
    stream = tvident.IdentificationStream(**more)
    stream.push(ANGLE[:10], TORQUE[:10], weights=np.zeros(10))
    with pytest.raises(ValueError, match="got some without after others with; give weights of 1"):
        stream.push(ANGLE[10:20], TORQUE[10:20])
    stream.push(ANGLE[10], TORQUE[10], weights=2.0)
    with pytest.raises(ValueError, match=r"at most 1e\+100 times the first that is not 0; got 1e\+120 after 2"):
        stream.push(ANGLE[11], TORQUE[11], weights=1e120)
    with pytest.raises(ValueError, match="must be finite and not negative"):
        stream.push(ANGLE[11], TORQUE[11], weights=-1.0)
    stream = tvident.IdentificationStream(**more)
    stream.push(ANGLE[:10], TORQUE[:10])
    with pytest.raises(ValueError, match="got some with after others without"):
        stream.push(ANGLE[10:20], TORQUE[10:20], weights=np.ones(10))
    strict = tvident.IdentificationStream(**more, nan_policy="raise")
    strict.push([np.nan, 1.0], [np.nan, 1.0], weights=[0.0, 1.0])
    with pytest.raises(ValueError, match="sample 2 is nan"):
        strict.push([np.nan], [1.0], weights=[1.0])


@pytest.mark.parametrize("value", [1e160, np.nan])
def test_samples_that_are_too_large_to_be_squared_are_missing(value: float) -> None:
    angle = ANGLE.copy()
    angle[900] = value
    batch = tvident.identify(angle, TORQUE, sample_rate=1000, method="paper")
    stream = tvident.IdentificationStream(sample_rate=1000, method="paper", nan_policy="omit")
    outs = [stream.push(angle, TORQUE), stream.finish()]
    assert np.array_equal(joined(outs, "stiffness"), batch.stiffness, equal_nan=True)
    lost = angle.copy()
    lost[900] = np.nan
    alike = tvident.identify(lost, TORQUE, sample_rate=1000, method="paper")
    assert np.array_equal(batch.stiffness, alike.stiffness, equal_nan=True)
    assert np.array_equal(batch.status, alike.status)


def test_nothing_stays_of_a_piece_that_is_refused() -> None:
    stream = tvident.IdentificationStream(sample_rate=1000, method="paper")
    ones = np.ones(4)
    with pytest.raises(ValueError, match="as many samples as each other; got 4 and 3"):
        stream.push(ANGLE[:4], TORQUE[:3], weights=ones)
    with pytest.raises(ValueError, match="give all of them in one unit"):
        stream.push(ANGLE[:4], TORQUE[:4], weights=[1e-110, 1, 1, 1])
    stream.push(ANGLE[:4], TORQUE[:4], weights=ones)
    other = tvident.IdentificationStream(sample_rate=1000, method="paper")
    with pytest.raises(ValueError, match="give all of them in one unit"):
        other.push(ANGLE[:4], TORQUE[:4], weights=[1e-110, 1, 1, 1])
    assert other.push(ANGLE[:4], TORQUE[:4]).time.size == 0
    assert other.samples == 4
    rows = tvident.RollingStream(3)
    rows.push(np.arange(4.0), ones, weights=ones)
    with pytest.raises(ValueError, match="give all of them in one unit"):
        rows.push(np.arange(4.0), ones, weights=[1e110, 1, 1, 1])
    rows.push(np.arange(4.0), ones, weights=ones)
