"""The angle's noise is taken off inside triangular factors; here it is taken off normal matrices, window by window."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from parameters import examples
from reference.noise_correction import Column, Rows, fit, row_covariance, window
from reference.weak_form import companion_kernels, kernels, stride_of
from tvident import Status, _core

Array = npt.NDArray[np.float64]

DELTA = 1e-3
SAMPLES = 1500
# A normal equation holds sums over some hundred rows, whose rounding its condition number amplifies.
ROUNDING = 1e3 * float(np.finfo(np.float64).eps)
NAMES = ("inertia", "damping", "stiffness", "offset")


@dataclass
class Case:
    """A record, and how it is to be identified."""

    angle: Array
    torque: Array
    half: int
    exponent: int
    windowed: tuple[str, ...]
    known: dict[str, float]
    linear: bool
    noise: tuple[float, float]
    equations: int
    mask: npt.NDArray[np.bool_] | None = None

    @property
    def stride(self) -> int:
        """Samples from one row to the next."""
        return stride_of(self.half)

    @property
    def span(self) -> int:
        """Rows of a window."""
        return max(1, (self.equations + self.stride // 2) // self.stride)

    @property
    def constant(self) -> list[str]:
        """Unknowns that are the same over the record."""
        return [name for name in NAMES if name not in self.windowed and name not in self.known]


def identified(case: Case) -> _core.Identification:
    """Identify with everything fixed, the noise's variances too."""
    known: list[Any] = [case.known.get(name) for name in NAMES[:3]]
    motions = _core.Motions(case.angle[None], case.torque[None], known, ["offset"])
    kinds = ["windowed" if name in case.windowed else "constant" for name in NAMES if name not in case.known]
    form = _core.WeakForm(
        [2 * case.half + 1],
        [case.exponent],
        [case.equations],
        averaging=False,
        linear=case.linear,
        noise=case.noise,
    )
    masks = None if case.mask is None else [case.mask]
    (found,) = _core.identify(motions, kinds, form, delta=DELTA, lag=[0.0], quantisation=0.0, masks=masks)
    return found


def of_kind(found: _core.Identification, kind: str) -> list[_core.Unknown]:
    """Give the unknowns of a kind."""
    return [one for one in found.unknowns if one.kind == kind]


def rows_of(case: Case) -> Rows:
    """Give the record's rows."""
    half, centres = case.half, np.arange(case.half, SAMPLES - case.half, case.stride)
    every = centres[:, None] + np.arange(-half, half + 1)
    values, companions = kernels(half, case.exponent, DELTA), companion_kernels(half, case.exponent, DELTA)
    columns = {
        name: Column(case.angle[every] @ value, value, case.angle[every] @ companion, companion)
        for name, value, companion in zip(NAMES, values, companions, strict=False)
    }
    nothing = np.zeros(2 * half + 1)
    columns["offset"] = Column(np.ones(centres.size), nothing, np.zeros(centres.size), nothing)
    side, kernel = case.torque[every] @ values[2], nothing
    for name, value in case.known.items():
        side, kernel = side - value * columns[name].values, kernel - value * columns[name].kernel
    return Rows(
        windowed=[columns[name] for name in NAMES if name in case.windowed],
        constant=[columns[name] for name in case.constant],
        side=Column(side, kernel, nothing, nothing),
        usable=np.ones(centres.size, bool) if case.mask is None else case.mask[centres],
        period=case.stride * DELTA,
        linear=case.linear,
        variance=case.noise[0],
    )


def record(seed: int, angle_noise: float) -> tuple[Array, Array, float]:
    """Give angle and torque of a spring that changes, and the variance of the angle's noise, a part of the angle's own deviation."""
    generator = np.random.default_rng(seed)
    t = np.arange(SAMPLES) * DELTA
    angle, velocity, acceleration = np.zeros((3, SAMPLES))
    for frequency in generator.uniform(1, 20, 10):
        omega, phase = 2 * np.pi * frequency, generator.uniform(0, 6)
        wave, slope = np.sin(omega * t + phase), np.cos(omega * t + phase)
        angle, velocity, acceleration = angle + wave, velocity + omega * slope, acceleration - omega**2 * wave
    stiffness = 15 + 3 * np.sin(2 * np.pi * generator.uniform(0.2, 1) * t)
    torque = 0.01 * acceleration + 0.1 * velocity + stiffness * angle + 0.5
    level = angle_noise * float(angle.std())
    noisy = angle + level * generator.standard_normal(SAMPLES)
    return noisy, torque + 0.1 * generator.standard_normal(SAMPLES), level**2


cases = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 2**32),
        "half": st.integers(8, 40),
        "exponent": st.integers(4, 10),
        # From nothing to so much that only a part of it is believed.
        "angle_noise": st.sampled_from([0.0, 1e-3, 1e-2, 0.1, 0.5]),
        "windowed": st.sampled_from(
            [("stiffness",), ("stiffness", "offset"), ("inertia", "stiffness"), ("offset",), ()]
        ),
        "known": st.sampled_from([{}, {"damping": 0.1}, {"damping": 0.12}]),
        "linear": st.booleans(),
        "window": st.integers(40, 120),
        "masked": st.booleans(),
    }
)


def case_of(drawn: dict[str, Any], torque_noise: float) -> Case:
    angle, torque, variance = record(drawn["seed"], drawn["angle_noise"])
    mask = None
    if drawn["masked"]:
        # A gap of half a window, and every seventh sample.
        mask = np.ones(SAMPLES, bool)
        mask[::7], mask[400 : 400 + drawn["window"] * stride_of(drawn["half"]) // 2] = False, False
    stride = stride_of(drawn["half"])
    return Case(
        angle,
        torque,
        drawn["half"],
        drawn["exponent"],
        drawn["windowed"],
        drawn["known"],
        drawn["linear"],
        (variance, torque_noise * float(torque.var())),
        min(drawn["window"] * stride, SAMPLES // 3),
        mask,
    )


def fitted(case: Case, parameters: Array) -> tuple[Rows, Array, Any]:
    """Fit the rows by the reference, for the noise that some parameters make of the angle's."""
    rows = rows_of(case)
    values = kernels(case.half, case.exponent, DELTA)
    gamma = row_covariance(values, parameters, case.noise, case.stride, rows.usable.size)
    # Windows begin eight in the length of one; where nothing is windowed the record is one.
    step = max(1, case.span // 8)
    span = case.span // step * step if case.windowed else rows.usable.size
    return rows, gamma, fit(rows, span, step, gamma, case.noise[1] * float(values[2] @ values[2]))


def parameters_of(case: Case, rows: Rows, found: Any) -> Array:
    """Give inertia, damping and stiffness, what is windowed by its median."""
    values = dict(zip(case.constant, found.values, strict=True)) | case.known
    for place, name in enumerate(name for name in NAMES if name in case.windowed):
        each = [one.own[place] - one.dependence[place] @ found.values for one in found.windows]
        held = [one.count > rows.local + len(rows.constant) + 1 for one in found.windows]
        each = sorted(value for value, held in zip(each, held, strict=True) if held)
        values[name] = each[len(each) // 2]
    return np.array([values["inertia"], max(values["damping"], 0.0), values["stiffness"]])


@pytest.mark.slow
@settings(max_examples=examples(25))
@given(drawn=cases)
@example(
    drawn={
        "seed": 127211,
        "exponent": 4,
        "half": 8,
        "window": 40,
        "known": {},
        "windowed": ("inertia", "stiffness"),
        "linear": True,
        "angle_noise": 0.5,
        "masked": False,
    }
)
def test_the_noise_of_the_angle_is_taken_off_every_window(drawn: dict[str, Any]) -> None:
    # The torque's noise is said to be so large that every window is as good as it should be, and all count alike.
    case = case_of(drawn, torque_noise=100.0)
    result = identified(case)
    # A torque that so much noise makes by chance determines nothing: tests/identify/test_noise_determines_nothing.py.
    assume(not result.record_status & Status.RANK_DEFICIENT)
    rows, _, first = fitted(case, np.zeros(3))
    parameters = parameters_of(case, rows, first)
    rows, gamma, found = fitted(case, parameters)
    assert (found.weights[found.weights > 0] == 1).all()
    allowed = ROUNDING * found.condition
    errors = np.sqrt(np.diag(found.covariance))
    inflation = max(1.0, float(np.mean(found.misfits)))
    norms = np.sqrt([np.mean(one.values**2) for one in rows.constant])
    scale = np.sqrt(np.mean(rows.side.values**2)) / norms
    for place, constant in enumerate(of_kind(result, "constant")):
        value, error = constant.values[0], constant.stderr[0]
        assert abs(value - found.values[place]) <= allowed * (scale[place] + abs(found.values[place]))
        if case.windowed:
            assert error == pytest.approx(np.sqrt(inflation) * errors[place], rel=allowed)
    # A window around every row, for these constants.
    for row in range(0, rows.usable.size if case.windowed else 0, 7):
        sample = case.half + row * case.stride
        if result.status[sample] & Status.INVALID:
            continue
        before = row - case.span // 2
        held = np.arange(max(before, 0), min(before + case.span, rows.usable.size))
        one = window(rows, held, row, gamma)
        own = one.own - one.dependence @ found.values
        covariance, sizes = one.covariance(gamma[0, 0])
        between = covariance + one.dependence @ found.covariance @ one.dependence.T
        exact = ROUNDING * max(one.condition, found.condition)
        for place, windowed in enumerate(of_kind(result, "windowed")):
            values, deviations = windowed.values, windowed.stderr
            assert abs(values[sample] - own[place]) <= exact * (abs(own[place]) + np.linalg.norm(own)), row
            # A sum that is less than nothing, of rows that agree with their neighbours, counts as nothing.
            variance, size = max(0.0, between[place, place]), sizes[place, place] + between[place, place]
            assert abs(deviations[sample] ** 2 - inflation * variance) <= exact * inflation * size, row


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("linear", [False, True])
def test_windows_that_fit_badly_count_less(seed: int, linear: bool) -> None:
    angle, torque, _ = record(seed, 0.0)
    torque[600:660] += 20.0  # something touches the beam
    # Without noise of the angle a row's variance does not depend on the parameters.
    case = Case(angle, torque, 20, 8, ("stiffness",), {}, linear, (0.0, 0.01), 200)
    rows, _, found = fitted(case, np.zeros(3))
    assert 0 < (found.weights < 1).mean() < 0.5
    condition, norms = found.condition, np.array([np.mean(one.values**2) for one in rows.constant])
    scale = np.sqrt(np.mean(rows.side.values**2) / norms)
    for place, constant in enumerate(of_kind(identified(case), "constant")):
        value, error = constant.values[0], constant.stderr[0]
        assert abs(value - found.values[place]) <= ROUNDING * condition * (scale[place] + abs(found.values[place]))
        if np.mean(found.misfits) < 4:  # beyond, errors come from the residuals
            spread = np.sqrt(max(1.0, float(np.mean(found.misfits))) * found.covariance[place, place])
            assert error == pytest.approx(spread, rel=ROUNDING * condition)
