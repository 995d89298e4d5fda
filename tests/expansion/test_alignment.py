"""Curves that records share, at the samples of a record that lies elsewhere along them."""

import numpy as np
import pytest

from tvident._expansion import AlignedSamples, Basis, Coordinate
from tvident._expansion.families import family_of

SAMPLES, PERIOD = 400, 0.01


def stretched() -> AlignedSamples:
    """Give a record that goes along a curve unevenly."""
    part = np.linspace(0, 1, 300)
    return AlignedSamples((SAMPLES - 1) * (0.1 + 0.6 * part + 0.2 * part**2), SAMPLES)


def time_of_curves() -> Coordinate:
    places = np.arange(SAMPLES) / (SAMPLES - 1)
    rate = 1 / ((SAMPLES - 1) * PERIOD)
    return Coordinate(places, np.broadcast_to(np.array([[rate], [0.0]]), (2, SAMPLES)), (0.0, 1.0), is_of_time=True)


@pytest.mark.parametrize("is_of_time", [True, False])
def test_rates_of_functions_are_those_along_the_record(*, is_of_time: bool) -> None:
    coordinate = time_of_curves()
    if not is_of_time:
        places, first = coordinate.places, coordinate.rates[0, 0]
        bent = places**2
        rates = np.stack([2 * places * first, np.full(SAMPLES, 2 * first**2)])
        coordinate = Coordinate(bent, rates, (0.0, 1.0))
    basis = stretched().basis(Basis([coordinate], [family_of("legendre", 3)], [4]), PERIOD)
    values, first, second = (basis.along(slice(None), rate) for rate in range(3))
    inner = slice(3, -3)
    # Central differences: the next derivative but one, of a curve that bends once in three seconds, times the step squared.
    assert np.abs(np.gradient(values, PERIOD, axis=0) - first)[inner].max() < 2e-3 * np.abs(first).max()
    assert np.abs(np.gradient(first, PERIOD, axis=0) - second)[inner].max() < 1e-2 * np.abs(second).max()


def test_curves_are_interpolated_with_their_rates() -> None:
    one, time = stretched(), np.arange(SAMPLES) * PERIOD
    values = [np.sin(2 * time), 2 * np.cos(2 * time), -4 * np.sin(2 * time)]
    along, first, second = one.curve(values, PERIOD)
    there = one.positions * PERIOD
    np.testing.assert_allclose(along, np.sin(2 * there), atol=1e-4)
    assert np.abs(np.gradient(along, PERIOD) - first)[2:-2].max() < 5e-3
    assert np.abs(np.gradient(first, PERIOD) - second)[3:-3].max() < 5e-2
    assert one.is_inside.all()


def test_a_cycle_goes_on_into_the_next() -> None:
    positions = np.array([-1.0, 0.0, 398.6, 399.5, 401.0])
    alone, periodic = AlignedSamples(positions, SAMPLES), AlignedSamples(positions, SAMPLES, is_periodic=True)
    np.testing.assert_array_equal(alone.is_inside, [False, True, True, False, False])
    assert periodic.is_inside.all()
    # What lies in two cycles is the centre of an equation in one of them.
    np.testing.assert_array_equal(periodic.is_centre, [False, True, True, True, False])
    np.testing.assert_array_equal(periodic.nearest, [399, 0, 399, 0, 1])
    curve = np.cos(2 * np.pi * np.arange(SAMPLES) / SAMPLES)
    np.testing.assert_allclose(periodic.values(curve), np.cos(2 * np.pi * positions / SAMPLES), atol=1e-4)
