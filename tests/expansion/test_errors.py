"""Standard errors of expansions whose functions are hardly told from each other."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import tvident
from tvident import Expansion

Array = npt.NDArray[np.float64]


def monomials(x: Array, size: int) -> Array:
    """Give powers of the time in parts of the record: condition numbers grow by 30 with every two."""
    return np.asarray((np.asarray(x) / 6)[:, np.newaxis] ** np.arange(size))


@pytest.mark.parametrize("size", [8, 16])
def test_errors_of_a_curve_do_not_depend_on_which_functions_span_it(size: int) -> None:
    # Of 16 monomials variances of their factors cancel: errors were 0 to 135 times those of Legendre's polynomials.
    rig = tvident.simulate_torsional_rig(duration=6.0, seed=3, angle_noise=1e-3)
    kinds: dict[str, Any] = {"inertia": "constant", "damping": "constant"}
    found, expected = (
        tvident.identify(rig.angle, rig.torque, sample_rate=1000, stiffness=one, **kinds)
        for one in (Expansion(monomials, size=size), Expansion("legendre", size=size))
    )
    np.testing.assert_allclose(
        found.stiffness, expected.stiffness, atol=0.01 * float(expected.stderr["stiffness"].min()) + 1e-3
    )
    np.testing.assert_allclose(found.stderr["stiffness"], expected.stderr["stiffness"], rtol=1e-3)
    at = [1.0, 3.0, 5.0]
    np.testing.assert_allclose(
        found.expansions["stiffness"].stderr_at(at), expected.expansions["stiffness"].stderr_at(at), rtol=1e-3
    )
    for name in ("inertia", "damping"):
        assert found.constants[name][1] == pytest.approx(expected.constants[name][1], rel=1e-3)


@pytest.mark.slow
def test_errors_that_follow_from_residuals_do_not_either() -> None:
    # Half of a torque that no term explains: the covariance follows from what is left.
    rig = tvident.simulate_torsional_rig(duration=6.0, seed=3, angle_noise=1e-3)
    torque = rig.torque + 0.5 * rig.torque.std() * np.sin(2 * np.pi * 7.3 * rig.time)
    found, expected = (
        tvident.identify(rig.angle, torque, sample_rate=1000, inertia="constant", damping="constant", stiffness=one)
        for one in (Expansion(monomials, size=16), Expansion("legendre", size=16))
    )
    assert found.record_status & tvident.Status.NOISE_MODEL
    np.testing.assert_allclose(found.stderr["stiffness"], expected.stderr["stiffness"], rtol=0.01)
