"""Rows of expanded coefficients, their noise, and their least squares, compared with slow references."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from parameters import examples
from reference.expansion import generalised, product_column
from tvident._expansion import (
    Basis,
    Coordinate,
    Curves,
    ExpandedRecord,
    ExpandedUnknown,
    Linearised,
    Noise,
    of_one,
)
from tvident._expansion.covariance import RIDGE, Whitening
from tvident._expansion.families import FAMILIES, family_of

ROUNDING = 1e-9
"""Sums of some hundred products, relative to the largest; second derivatives lose some digits in differences."""

Array = npt.NDArray[np.float64]

PERIOD = 0.01


def record(seed: int, samples: int, half: int, exponent: int) -> ExpandedRecord:
    generator = np.random.default_rng(seed)
    there = np.ones((1, samples), bool)
    angle, torque = generator.standard_normal((2, 1, samples))
    return ExpandedRecord(angle, torque, there, there[0], PERIOD, half, exponent)


def of_time(family: str, size: int, samples: int) -> Basis:
    seconds = (samples - 1) * PERIOD
    rates = np.broadcast_to(np.array([[1 / seconds], [0.0]]), (2, samples))
    places = np.asarray(np.arange(samples) * PERIOD / seconds, np.float64)
    return Basis([Coordinate(places, rates, (0, seconds))], [family_of(family, 3)], [size])


@pytest.mark.first(1)
@pytest.mark.parametrize(("role", "parts"), [("inertia", 2), ("damping", 1), ("stiffness", 0)])
@settings(max_examples=examples(8))
@given(seed=st.integers(0, 1000), half=st.integers(14, 25), exponent=st.integers(5, 8), size=st.integers(1, 4))
def test_columns_are_the_integrals_of_products(
    role: str, parts: int, seed: int, half: int, exponent: int, size: int
) -> None:
    samples = 90
    one = record(seed, samples, half, exponent)
    unknown = ExpandedUnknown(role, of_one(role), of_time("legendre", size, samples))
    found = one.columns([unknown], one.angles, slice(0, (one.rows - 1) * one.stride + one.length))[:, 0]
    for number in range(size):
        # A Legendre polynomial of time in seconds.
        legendre = np.polynomial.Legendre.basis(number)(Polynomial([-1, 2 / ((samples - 1) * PERIOD)]))
        if isinstance(legendre, float):
            legendre = Polynomial([legendre])
        expected = product_column(one.angles[0], legendre, parts, half, exponent, PERIOD)[:: one.stride]
        scale = np.abs(expected).max() + np.abs(found).max()
        # The library also takes the sum of every kernel to what an integral would be.
        x = np.arange(-half, half + 1) / half
        lost = abs(np.sum((Polynomial([1, 0, -1]) ** exponent).deriv(parts)(x))) if parts else 0.0
        tolerance = ROUNDING * scale + 3 * lost / (half * PERIOD) ** parts * np.abs(one.angles).max()
        assert np.abs(found[:, number] - expected).max() <= tolerance


def test_momentum_is_inertia_and_its_rate() -> None:
    # d(Iθ̇)/dt = I θ̈ + İ θ̇, of which the second is a damping of the inertia's rate.
    one, samples = record(1, 300, 20, 6), 300
    everything = slice(0, (one.rows - 1) * one.stride + one.length)
    basis = of_time("chebyshev", 4, samples)
    columns = {
        role: one.columns([ExpandedUnknown(role, of_one(role), basis)], one.angles, everything)[:, 0]
        for role in ("inertia", "momentum")
    }
    factors = np.array([1.0, 0.3, -0.2, 0.1])
    rate = np.polynomial.Chebyshev(factors).deriv() * (2 / ((samples - 1) * PERIOD))
    damping = rate.convert(kind=np.polynomial.Chebyshev)
    unknown = ExpandedUnknown("damping", of_one("damping"), of_time("chebyshev", 3, samples))
    more = one.columns([unknown], one.angles, everything)[:, 0]
    found = columns["momentum"] @ factors - columns["inertia"] @ factors
    np.testing.assert_allclose(
        found, more @ np.asarray(damping.coef, np.float64), atol=ROUNDING * np.abs(columns["inertia"]).max()
    )


@settings(max_examples=examples(25))
@given(seed=st.integers(0, 1000), rows=st.integers(1, 120), lags=st.integers(2, 12), lost=st.integers(0, 5))
def test_whitening_is_that_of_the_dense_covariance(seed: int, rows: int, lags: int, lost: int) -> None:
    generator = np.random.default_rng(seed)
    factor = np.tril(np.triu(generator.standard_normal((rows, rows)), 1 - lags)) + 3 * np.eye(rows)
    dense = factor @ factor.T
    band = np.zeros((rows, lags))
    for lag in range(min(lags, rows)):
        band[lag:, lag] = np.diagonal(dense, -lag)
    usable = np.ones(rows, bool)
    usable[generator.integers(0, rows, lost)] = False
    columns = generator.standard_normal((rows, 3)) * usable[:, np.newaxis]
    whitening = Whitening(band, usable)
    there = np.flatnonzero(usable)
    if not there.size:
        return
    small = dense[np.ix_(there, there)]
    small = small + RIDGE * np.diag(np.diagonal(small))
    expected = np.linalg.solve(np.linalg.cholesky(small), columns[there])
    np.testing.assert_allclose(whitening.whiten(columns)[0][there], expected, atol=1e-9)
    np.testing.assert_allclose(
        whitening.solve(columns[:, 0])[there], np.linalg.solve(small, columns[there, 0]), atol=1e-9
    )


@pytest.mark.parametrize("role", ["stiffness", "damping", "inertia"])
@pytest.mark.parametrize("equations", [1, 2])
@pytest.mark.parametrize("trials", [1, 2])
@pytest.mark.parametrize("weighted", [False, True])
def test_least_squares_are_those_of_dense_matrices_with_the_noise_of_the_angles_taken_off(
    role: str, equations: int, trials: int, *, weighted: bool
) -> None:
    samples, generator = 400, np.random.default_rng(3)
    basis = of_time("bspline", 5, samples)
    nothing = np.zeros(samples)
    level = 1 + 0.5 * np.sin(np.arange(samples) / 60)
    # Between the first mass and the second, or the ground; then what only the last equation has.
    between = [(e, role, c, 1.0 if e == c else -1.0) for e in range(equations) for c in range(equations)]
    other = "damping" if role == "stiffness" else "stiffness"
    last = ((equations - 1, other, equations - 1, 2.0),)
    noise = [0.04, 0.01][:equations], [0.3, 0.2][:equations]
    records = []
    for trial in range(trials):
        length = samples - 60 * trial
        there = np.ones((equations, length), bool)
        there[-1, 100:103] = trial == 0
        angles, torques = generator.standard_normal((2, equations, length))
        spread = generator.uniform(0.2, 5, length) if weighted else None
        # A torque that is late by some samples takes their weights with it.
        late: Any = {"lag": 2.0 if weighted else 0.0, "spread": spread, "terms": [np.ones(length)]}
        records.append(ExpandedRecord(angles, torques, there, np.ones(length, bool), PERIOD, 24, 6, **late))
    curves: Curves = [(between, [level, nothing, nothing]), (last, [0.3 * level, nothing])]
    around = Linearised(records, curves, noise, [])
    unknowns = [
        ExpandedUnknown(role, between, basis),
        ExpandedUnknown("last", last),
        ExpandedUnknown("offset", ((0, "term", 0, 1.0),)),
    ]
    found = around.solve(unknowns)
    covariances, designs, sides = zip(*(_dense(one, curves, noise, unknowns) for one in records), strict=True)
    covariance = _block_diagonal(covariances)
    values, normal, misfit = generalised(np.concatenate(designs), np.concatenate(sides), covariance)
    # The covariance is ill-conditioned where the test function suppresses noise: its condition number times rounding.
    tolerance = np.linalg.cond(covariance) * 1e-13 + 1e-8
    np.testing.assert_allclose(found.values, values, rtol=tolerance, atol=tolerance * np.abs(values).max())
    np.testing.assert_allclose(found.covariance, normal, rtol=tolerance, atol=tolerance * np.abs(normal).max())
    assert found.misfit == pytest.approx(misfit, rel=tolerance)


def _dense(one: ExpandedRecord, curves: Curves, noise: Noise, unknowns: list[ExpandedUnknown]) -> tuple[Array, ...]:
    """Return the covariance, the columns and the right-hand sides of a record's rows that are usable, with dense matrices."""
    everything = slice(0, (one.rows - 1) * one.stride + one.length)
    weights, kernel = one.noise_kernels(curves, everything), one.kernels.value
    count, channels, samples = one.equations, len(one.angles), one.samples
    entering = np.zeros((one.rows, count, channels, samples))
    torque = np.zeros((one.rows, count, count, samples))
    for row in range(one.rows):
        some = slice(row * one.stride, row * one.stride + one.length)
        for (equation, channel), each in weights.items():
            entering[row, equation, channel, some] = each[row]
        for equation in range(count):
            torque[row, equation, equation, some] = kernel
    usable = one.usable_rows().ravel()
    entering, torque = (each.reshape(one.rows * count, -1)[usable] for each in (entering, torque))
    spread = np.ones(samples) if one.spread is None else one.spread
    of_angles = np.repeat(noise[0], samples) * np.tile(spread, channels)
    late = round(one.lag)
    # What is moved in from beyond the end is in no row that is usable.
    of_torques = np.repeat(noise[1], samples) * np.tile(np.roll(spread, -late), count)
    covariance = entering * of_angles @ entering.T + torque * of_torques @ torque.T
    covariance += RIDGE * np.diag(np.diagonal(covariance))
    rhs = torque @ np.roll(one.torques, -late, axis=1).ravel()
    # None of the terms is known about.
    left = rhs - entering @ one.angles.ravel()
    shown = -of_angles * (entering.T @ np.linalg.solve(covariance, left))
    columns = one.columns(unknowns, one.angles - shown.reshape(channels, samples), everything)
    return covariance, columns.reshape(one.rows * count, -1)[usable], rhs - entering @ shown


def _block_diagonal(blocks: Sequence[Array]) -> Array:
    found = np.zeros((sum(map(len, blocks)),) * 2)
    first = 0
    for one in blocks:
        found[first : first + len(one), first : first + len(one)] = one
        first += len(one)
    return found


@pytest.mark.parametrize("name", [*FAMILIES, "bspline"])
def test_derivatives_of_families_are_those_of_their_values(name: str) -> None:
    family, step = family_of(name, 3), 1e-5
    places = np.linspace(0.013, 0.987, 41)
    size = list(islice(family.sizes(), 4))[-1]
    for derivative in range(1, max(family.smooth, 0) + 1):
        before, after = (family.values(places + move, size, derivative - 1) for move in (-step, step))
        found = family.values(places, size, derivative)
        # Central differences: the third derivative times the step squared, and rounding over the step.
        assert np.abs((after - before) / (2 * step) - found).max() < 1e-6 * max(1, np.abs(found).max())


@settings(max_examples=examples(10))
@given(seed=st.integers(0, 1000), sizes=st.tuples(st.integers(1, 5), st.integers(1, 4)), same=st.booleans())
def test_blocks_are_summed_and_sizes_compared_as_if_each_were_solved(
    seed: int, sizes: tuple[int, int], *, same: bool
) -> None:
    samples = 900
    one = record(seed, samples, 16, 6)
    walk = np.cumsum(np.random.default_rng(seed).standard_normal(samples))
    channel = Coordinate((walk - walk.min()) / np.ptp(walk), np.zeros((2, samples)), (0.0, 1.0))
    pulse = family_of("block_pulse", 3)
    both = Basis([channel, of_time("legendre", 1, samples).coordinates[0]], [pulse, pulse], sizes)
    # The same functions without their blocks.
    plain = Basis(both.coordinates, [replace(pulse, block=None)] * 2, sizes)
    found, expected = (
        one.columns([ExpandedUnknown("k", of_one("stiffness"), each)], one.angles, slice(None))[:, 0]
        for each in (both, plain)
    )
    np.testing.assert_allclose(found, expected, atol=ROUNDING * np.abs(expected).max())
    unknowns = [ExpandedUnknown("k", of_one("stiffness"), both), ExpandedUnknown("c", of_one("damping"))]
    # Columns that are made of others are left to decompositions.
    unknowns += [ExpandedUnknown("again", of_one("damping"))] if same else []
    nothing = (of_one("stiffness"), [np.zeros(samples)])
    around = Linearised([one], [nothing], ([1e-6], [1.0]), [])
    scored, fitted = around.score(unknowns), around.solve(unknowns)
    assert scored.criterion == pytest.approx(fitted.scored.criterion, rel=1e-9)
    white = np.concatenate(list(around.whitened(unknowns)))
    values, left, rank, _ = np.linalg.lstsq(white[:, :-1], white[:, -1])
    assert np.isfinite(fitted.condition) == (rank == white.shape[1] - 1)
    if np.isfinite(fitted.condition):
        # The condition number, some hundred here, times rounding.
        np.testing.assert_allclose(fitted.values, values, atol=1e-9 * np.abs(values).max())
        assert scored.misfit == pytest.approx(float(left[0]), rel=1e-9)


def test_functions_of_two_channels_are_products() -> None:
    time = np.linspace(0, 1, 50)
    other = time**2
    rates = [np.stack([np.full(50, 1.0), np.zeros(50)]), np.stack([2 * time, np.full(50, 2.0)])]
    places = [Coordinate(one, rate, (0, 1)) for one, rate in zip((time, other), rates, strict=True)]
    families = [family_of("powers", 3), family_of("bspline", 3)]
    basis = Basis(places, families, [3, 4])
    values, first, second = (basis.along(slice(None), rate) for rate in (0, 1, 2))
    expected = families[0].values(time, 3, 0)[:, 1] * families[1].values(other, 4, 0)[:, 2]
    np.testing.assert_allclose(values[:, 4 + 2], expected, atol=1e-15)
    # One sample apart: differences are wrong by a sixth of the third derivative times the step squared.
    rate = np.gradient(values, time, axis=0)[2:-2]
    np.testing.assert_allclose(rate, first[2:-2], atol=0.02 * np.abs(first).max())
    np.testing.assert_allclose(np.gradient(first, time, axis=0)[4:-4], second[4:-4], atol=0.1 * np.abs(second).max())
