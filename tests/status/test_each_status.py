"""Every flag of a status: a record that raises it, where it should be, and one much like it that does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from calls import paper, strong, weak
from tvident import Status

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

CONSTANT: dict[str, Any] = {"inertia": "constant", "damping": "constant", "stiffness": "constant"}
RATE = 1000.0


@dataclass
class Shown:
    """Flags of samples and of the record, and where the one in question should be."""

    samples: npt.NDArray[np.uint16]
    record: int = 0
    expected: Mask | None = None
    """Samples that should have the flag, all others should not; without it the flag is one of the record."""


@cache
def rig(pattern: Any = "slider", angle_noise: float = 1e-3) -> tvident.Recording:
    return tvident.simulate_torsional_rig(12.0, pattern=pattern, angle_noise=angle_noise)


def waves(frequencies: list[float], n: int = 1000) -> Array:
    t = np.arange(n) / RATE
    return np.asarray(sum(np.sin(2 * np.pi * f * t + f) for f in frequencies))


def noise(n: int = 1000, seed: int = 0) -> Array:
    return np.random.default_rng(seed).standard_normal(n)


def fitted(y: Array, window: int = 101, *, expected: Callable[[Any], Mask] | None = None, **call: Any) -> Shown:
    """Fit local polynomials."""
    fit = tvident.fit_local_polynomials(y, window, sample_rate=RATE, **call)
    assert isinstance(fit.status, np.ndarray)
    nowhere = np.zeros(y.size, bool)
    return Shown(fit.status, 0, nowhere if expected is None else expected(fit))


def identified(angle: Array, torque: Array, expected: Mask | None = None, rate: float = RATE, **call: Any) -> Shown:
    """Identify."""
    result = tvident.identify(angle, torque, sample_rate=rate, **call)
    assert isinstance(result.record_status, int)
    return Shown(result.status, result.record_status, expected)


def of_rig(expected: Mask | None = None, pattern: Any = "slider", more: Array | None = None, **call: Any) -> Shown:
    """Identify the simulated rig, something more acting on it than it is told of."""
    recording = rig(pattern)
    return identified(recording.angle, recording.torque + (0 if more is None else more), expected, **call)


def nowhere() -> Mask:
    return np.zeros(rig().angle.size, bool)


def around(n: int, first: int, end: int) -> Mask:
    places = np.arange(n)
    return np.asarray((places >= first) & (places < end))


def friction(part: float, pattern: Any = "constant") -> Array:
    recording = rig(pattern)
    return np.asarray(part * recording.torque.std() * np.sign(recording.true_velocity))


def growing_inertia() -> tuple[Array, Array]:
    recording = tvident.simulate_torsional_rig(
        20.0, angle_noise=1e-3, inertia=lambda t: 0.0123 * (1 + 0.2 * np.sin(2 * np.pi * 0.05 * t))
    )
    return recording.angle, recording.torque


def with_hole() -> Array:
    y = waves([3.0, 7.0]) + 0.01 * noise()
    y[500] = np.nan
    return y


def single_sine() -> tuple[Array, Array]:
    angle = waves([3.0], 5000)
    return angle + 1e-4 * noise(5000), 10 * angle + 0.01 * noise(5000, 1)


def disturbed(frequency: float) -> Array:
    """Give a disturbance of a fifth of the torque."""
    recording = rig("constant")
    return np.asarray(0.2 * recording.torque.std() * np.sin(2 * np.pi * frequency * recording.time))


def masked() -> dict[str, Any]:
    return {"mask": ~around(rig().angle.size, 5000, 5300)}


def another_system_outside() -> tuple[Array, Array, Mask]:
    """Give a record of which a second was taken with a spring half as stiff again."""
    recording = rig("constant")
    outside = around(recording.angle.size, 6000, 7000)
    more = np.where(outside, 0.5 * recording.stiffness * recording.true_angle, 0.0)
    return recording.angle, recording.torque + more, outside


def late(samples: int, **call: Any) -> Shown:
    recording = rig()
    return identified(recording.angle[samples:], recording.torque[: recording.torque.size - samples], **call)


def touched(torque: float) -> Shown:
    """Identify a record while which somebody touched the machine for a second, with so many times its torque."""
    recording = rig("constant")
    n = recording.angle.size
    push = waves([5.3, 8.9], n)
    push *= torque * recording.torque.std() / push.std()
    begins, ends = 6000, 7000
    more = np.where(around(n, begins, ends), push, 0.0)
    result = tvident.identify(recording.angle, recording.torque + more, sample_rate=RATE, **weak(regression_window=500))
    # What is left around a row is averaged over a window of its own, of equations that each hold a test function.
    reach = result.settings["regression_window"] + result.settings["window_length"]
    inner, outer = around(n, begins, ends), around(n, begins - reach, ends + reach)
    assert outer.mean() < 0.5
    samples = np.where(outer & ~inner, np.uint16(0), result.status)
    return Shown(samples, int(result.record_status), inner if torque else np.zeros(n, bool))


def outside_a_mask(*, differs: bool) -> Shown:
    angle, torque, outside = another_system_outside()
    if not differs:
        torque = rig("constant").torque
    expected = outside if differs else np.zeros(outside.size, bool)
    return identified(angle, torque, expected, mask=~outside, **CONSTANT)


CASES: list[tuple[Status, str, Callable[[], Shown], Callable[[], Shown]]] = [
    (
        Status.INVALID,
        "a missing sample",
        lambda: fitted(with_hole(), expected=lambda _: around(1000, 450, 551)),
        lambda: fitted(waves([3.0, 7.0]) + 0.01 * noise()),
    ),
    (
        Status.INVALID,
        "missing samples that are to be propagated",
        lambda: invalid_in_strong_form("propagate"),
        lambda: invalid_in_strong_form("omit"),
    ),
    (
        Status.EDGE,
        "half a window at either end",
        lambda: fitted(waves([3.0]) + 0.01 * noise(), expected=lambda _: ~around(1000, 50, 950)),
        lambda: without_ends(fitted(waves([3.0]) + 0.01 * noise())),
    ),
    (
        Status.GAP,
        "masked samples",
        lambda: of_rig(around(rig().angle.size, 5000, 5300), **masked()),
        lambda: of_rig(nowhere()),
    ),
    (
        Status.LOWEST_ORDER,
        "noise about a constant",
        lambda: fitted(5 + noise(), expected=lambda fit: chosen(fit, 0)),
        lambda: fitted(waves([3.0, 7.0]) + 0.01 * noise()),
    ),
    (
        Status.HIGHEST_ORDER,
        "a cubic for a cycle and a half a window",
        lambda: fitted(waves([15.0]) + 1e-3 * noise(), max_order=3, expected=lambda fit: chosen(fit, 3)),
        lambda: fitted(waves([3.0]) + 0.01 * noise(), max_order=15, criterion="bic"),
    ),
    (
        Status.EXACT,
        "a parabola without noise",
        lambda: fitted(np.linspace(-1, 1, 1000) ** 2, expected=lambda fit: fit.order >= 0),
        lambda: fitted(np.linspace(-1, 1, 1000) ** 2 + 1e-9 * noise()),
    ),
    (
        Status.RANK_DEFICIENT,
        "an angle that rests for a second",
        lambda: resting(rests=True),
        lambda: resting(rests=False),
    ),
    (
        Status.RANK_DEFICIENT,
        "constants of a record at rest",
        lambda: identified(np.zeros(2000), np.zeros(2000), **CONSTANT),
        lambda: of_rig(pattern="constant", **CONSTANT),
    ),
    (
        Status.ILL_CONDITIONED,
        "windows of a single sine",
        lambda: sine_in_windows(known={}),
        lambda: sine_in_windows(known={"inertia": 0.01}),
    ),
    (
        Status.ILL_CONDITIONED,
        "constants of a single sine",
        lambda: identified(*single_sine(), **CONSTANT),
        lambda: identified(*single_sine(), **(CONSTANT | {"inertia": 0.01})),
    ),
    (
        Status.NOISE_MODEL,
        "dry friction of a third of the torque that nothing is told of",
        lambda: of_rig(pattern="constant", more=friction(0.3)),
        lambda: of_rig(pattern="constant", more=friction(0.3), terms=("offset", "coulomb")),
    ),
    (
        Status.NOISE_MODEL,
        "another system outside the mask",
        lambda: outside_a_mask(differs=True),
        lambda: outside_a_mask(differs=False),
    ),
    (
        Status.NOISE_MODEL,
        "a touch",
        lambda: touched(0.5),
        lambda: touched(0.0),
    ),
    (
        Status.COLOURED,
        "a slow disturbance",
        lambda: of_rig(pattern="constant", more=disturbed(0.3), **CONSTANT),
        lambda: of_rig(
            pattern="constant", more=0.2 * rig("constant").torque.std() * noise(rig().angle.size), **CONSTANT
        ),
    ),
    (
        Status.KIND_CONTRADICTED,
        "an inertia that changes and was given as constant",
        lambda: identified(*growing_inertia(), inertia="constant"),
        lambda: identified(*growing_inertia(), inertia="varying"),
    ),
    (
        Status.WINDOW_LIMIT,
        "few samples a cycle",
        lambda: identified(rig().angle[::30], rig().torque[::30], rate=RATE / 30),
        lambda: identified(rig().angle[::10], rig().torque[::10], rate=RATE / 10),
    ),
    (
        Status.LAG_SUSPECTED,
        "a torque two samples late",
        lambda: late(2),
        lambda: late(2, lag=2 / RATE),
    ),
    (
        Status.SCALES_DISAGREE,
        "an angle that holds its values, which stay",
        lambda: identified(np.repeat(rig().angle[::5], 5), rig().torque, nan_policy="propagate"),
        of_rig,
    ),
    (
        Status.CHANNEL_SUSPECTED,
        "a clipped angle",
        lambda: identified(np.clip(rig().angle, *np.quantile(rig().angle, [0.02, 0.98])), rig().torque),
        of_rig,
    ),
    (
        Status.TERM_SUSPECTED,
        "dry friction",
        lambda: of_rig(pattern="constant", more=friction(0.05)),
        lambda: of_rig(pattern="constant", more=friction(0.05), terms=("offset", "coulomb")),
    ),
    (
        Status.TERM_SUSPECTED,
        "an offset",
        lambda: of_rig(more=np.full(rig().angle.size, 0.1 * rig().torque.std()), terms=()),
        lambda: of_rig(more=np.full(rig().angle.size, 0.1 * rig().torque.std()), terms=("offset",)),
    ),
]


def chosen(fit: tvident.LocalPolynomialFit, order: int) -> Mask:
    """Give the samples with an order, which most have."""
    found = np.asarray(fit.order == order)
    assert found[50:-50].mean() > 0.5
    return found


def without_ends(shown: Shown) -> Shown:
    inside = slice(50, -50)
    assert shown.expected is not None
    return Shown(shown.samples[inside], shown.record, shown.expected[inside])


def invalid_in_strong_form(nan_policy: Any) -> Shown:
    angle, torque = rig().angle.copy(), rig().torque
    angle[6000] = np.nan
    call = strong(window_length=101, regression_window=200, inertia="windowed", damping="windowed")
    expected = around(angle.size, 0, 0)
    if nan_policy == "propagate":
        # 51 equations before and behind hold the sample, and the windows of 200 that hold one of these.
        expected = around(angle.size, 6000 - 50 - 99, 6000 + 50 + 100 + 1)
    ends = ~around(angle.size, 50, angle.size - 50)
    shown = identified(angle, torque, expected, nan_policy=nan_policy, **call)
    shown.samples = np.where(ends, np.uint16(0), shown.samples)
    return shown


def resting(*, rests: bool) -> Shown:
    """Identify in windows of 0.2 s a record that rests, or not, from 4 s to 5 s."""
    angle, torque = rig().angle.copy(), rig().torque.copy()
    if rests:
        angle[4000:5000] = torque[4000:5000] = 0.0
    # Polynomials of 201 samples and windows of 200 of their equations see nothing but rest.
    expected = around(angle.size, 4200, 4800) if rests else nowhere()
    shown = identified(angle, torque, expected, **paper())
    # Between those that see nothing and those that see half of it, rounding decides.
    unclear = around(angle.size, 3900, 5100) & ~expected & rests
    shown.samples = np.where(unclear, np.uint16(0), shown.samples)
    return shown


def sine_in_windows(known: dict[str, float]) -> Shown:
    angle, torque = single_sine()
    expected = np.ones(angle.size, bool) if not known else np.zeros(angle.size, bool)
    shown = identified(angle, torque, expected, **paper(**known))
    inside = slice(200, -200)
    return Shown(shown.samples[inside], shown.record, expected[inside])


NAMES = [f"{flag.name}, {what}" for flag, what, _, _ in CASES]


def has(shown: Shown, flag: Status) -> Any:
    if shown.expected is None:
        return bool(shown.record & flag)
    return shown.samples & flag != 0


@pytest.mark.parametrize(("flag", "raised"), [(flag, raised) for flag, _, raised, _ in CASES], ids=NAMES)
def test_a_flag_is_raised_where_it_should_be(flag: Status, raised: Callable[[], Shown]) -> None:
    shown = raised()
    if shown.expected is None:
        assert has(shown, flag)
    else:
        assert shown.expected.any()
        np.testing.assert_array_equal(has(shown, flag), shown.expected)


@pytest.mark.parametrize(("flag", "quiet"), [(flag, quiet) for flag, _, _, quiet in CASES], ids=NAMES)
def test_a_flag_is_not_raised_where_it_should_not_be(flag: Status, quiet: Callable[[], Shown]) -> None:
    shown = quiet()
    assert not (shown.samples & flag).any()
    assert not shown.record & flag


def test_every_flag_is_in_the_table() -> None:
    assert {flag for flag, *_ in CASES} == set(Status)


@pytest.mark.parametrize("pattern", ["slider", "ramp", "square", "constant"])
@pytest.mark.parametrize("angle_noise", [1e-3, 1e-2])
def test_a_record_that_is_as_it_should_be_has_no_flag_but_at_its_ends(pattern: str, angle_noise: float) -> None:
    recording = rig(pattern, angle_noise)
    shown = identified(recording.angle, recording.torque, **weak())
    assert shown.record == 0
    assert (shown.samples & ~np.uint16(Status.EDGE) == 0).all()
