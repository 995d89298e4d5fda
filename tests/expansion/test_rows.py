"""Rows of expanded coefficients, their noise, and their least squares, compared with slow references."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from parameters import examples
from reference.expansion import generalised, product_column
from tvident._expansion import Basis, Coordinate, ExpandedRecord, ExpandedUnknown, Linearised
from tvident._expansion.covariance import RIDGE, Whitening
from tvident._expansion.families import FAMILIES, family_of

ROUNDING = 1e-9
"""Sums of some hundred products, relative to the largest; second derivatives lose some digits in differences."""

PERIOD = 0.01


def record(seed: int, samples: int, half: int, exponent: int) -> ExpandedRecord:
    generator = np.random.default_rng(seed)
    there = np.ones(samples, bool)
    angle, torque = generator.standard_normal((2, samples))
    return ExpandedRecord(angle, torque, there, there, PERIOD, half, exponent)


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
    unknown = ExpandedUnknown(role, role, of_time("legendre", size, samples))
    found = one.columns([unknown], one.angle, slice(0, (one.rows - 1) * one.stride + one.length))
    for number in range(size):
        # A Legendre polynomial of time in seconds.
        legendre = np.polynomial.Legendre.basis(number)(Polynomial([-1, 2 / ((samples - 1) * PERIOD)]))
        if isinstance(legendre, float):
            legendre = Polynomial([legendre])
        expected = product_column(one.angle, legendre, parts, half, exponent, PERIOD)[:: one.stride]
        scale = np.abs(expected).max() + np.abs(found).max()
        # The library also takes the sum of every kernel to what an integral would be.
        x = np.arange(-half, half + 1) / half
        lost = abs(np.sum((Polynomial([1, 0, -1]) ** exponent).deriv(parts)(x))) if parts else 0.0
        tolerance = ROUNDING * scale + 3 * lost / (half * PERIOD) ** parts * np.abs(one.angle).max()
        assert np.abs(found[:, number] - expected).max() <= tolerance


def test_momentum_is_inertia_and_its_rate() -> None:
    # d(Iθ̇)/dt = I θ̈ + İ θ̇, of which the second is a damping of the inertia's rate.
    one, samples = record(1, 300, 20, 6), 300
    everything = slice(0, (one.rows - 1) * one.stride + one.length)
    basis = of_time("chebyshev", 4, samples)
    columns = {
        role: one.columns([ExpandedUnknown(role, role, basis)], one.angle, everything)
        for role in ("inertia", "momentum")
    }
    factors = np.array([1.0, 0.3, -0.2, 0.1])
    rate = np.polynomial.Chebyshev(factors).deriv() * (2 / ((samples - 1) * PERIOD))
    damping = rate.convert(kind=np.polynomial.Chebyshev)
    more = one.columns([ExpandedUnknown("damping", "damping", of_time("chebyshev", 3, samples))], one.angle, everything)
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
def test_least_squares_are_those_of_dense_matrices_with_the_noise_of_the_angle_taken_off(role: str) -> None:
    one, samples = record(3, 400, 24, 6), 400
    basis = of_time("bspline", 5, samples)
    level = 1 + 0.5 * np.sin(np.arange(samples) / 60)
    nothing = np.zeros(samples)
    curves = [(role, [level, nothing, nothing])]
    noise = (0.04, 0.3)
    around = Linearised(one, curves, nothing, noise, [])
    unknowns = [ExpandedUnknown(role, role, basis), ExpandedUnknown("offset", "term", None, np.ones(samples))]
    found = around.solve(unknowns)

    everything = slice(0, (one.rows - 1) * one.stride + one.length)
    weights, kernel = one.noise_kernels(curves, everything), one.kernels.value
    entering, torque = np.zeros((one.rows, samples)), np.zeros((one.rows, samples))
    for row in range(one.rows):
        some = slice(row * one.stride, row * one.stride + one.length)
        entering[row, some], torque[row, some] = weights[row], kernel
    covariance = noise[0] * entering @ entering.T + noise[1] * torque @ torque.T
    covariance += RIDGE * np.diag(np.diagonal(covariance))
    rhs = torque @ one.torque
    shown = -noise[0] * entering.T @ np.linalg.solve(covariance, rhs - entering @ one.angle)
    design = one.columns(unknowns, one.angle - shown, everything)
    values, normal, misfit = generalised(design, rhs - entering @ shown, covariance)
    # The covariance is ill-conditioned where the test function suppresses noise: its condition number times rounding.
    tolerance = np.linalg.cond(covariance) * 1e-13 + 1e-8
    np.testing.assert_allclose(found.values, values, rtol=tolerance, atol=tolerance * np.abs(values).max())
    np.testing.assert_allclose(found.covariance, normal, rtol=tolerance, atol=tolerance * np.abs(normal).max())
    assert found.misfit == pytest.approx(misfit, rel=tolerance)


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
        one.columns([ExpandedUnknown("k", "stiffness", each)], one.angle, slice(None)) for each in (both, plain)
    )
    np.testing.assert_allclose(found, expected, atol=ROUNDING * np.abs(expected).max())
    unknowns = [ExpandedUnknown("k", "stiffness", both), ExpandedUnknown("c", "damping")]
    # Columns that are made of others are left to decompositions.
    unknowns += [ExpandedUnknown("again", "damping")] if same else []
    nothing = ("stiffness", [np.zeros(samples)])
    around = Linearised(one, [nothing], np.zeros(samples), (1e-6, 1.0), [])
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
