"""A first look: what terms leave of equations in blocks."""

from __future__ import annotations

import numpy as np
import pytest

from tvident._identify.blocks import products, solved, without


def test_blocks_leave_what_least_squares_in_each_leaves() -> None:
    """Unknowns of every block go first, constants of all of them after: as one least squares of all columns."""
    rng = np.random.default_rng(1)
    blocks, length = 14, 30
    rows = rng.normal(size=(blocks * length, 4)) * [1.0, 1e-3, 1e4, 1.0]
    made = products(rows[np.newaxis], length)
    assert made is not None
    (within,), (norms,) = made
    left, factors = solved(without(within, [0]).sum(axis=0), [1, 2])
    own = np.zeros((blocks * length, blocks))
    own[np.arange(blocks * length), np.repeat(np.arange(blocks), length)] = rows[:, 0]
    columns = np.column_stack([own, rows[:, 1:3]])
    values, squares, *_ = np.linalg.lstsq(columns, rows[:, 3], rcond=None)
    assert left * norms[3] ** 2 == pytest.approx(squares[0])
    np.testing.assert_allclose(factors * norms[3] / norms[1:3], values[-2:])


def test_few_blocks_tell_nothing() -> None:
    assert products(np.ones((1, 300, 3)), 30) is None
