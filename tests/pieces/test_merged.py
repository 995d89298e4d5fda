"""What pieces say of a constant together is what all values say at once, however they come; a part has the numbers wanted of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from tvident._identify import Held
from tvident._pieces import NOTHING_SAID, Gathered, Given
from tvident._units import Axis

# A sum of some tens of numbers, each rounded a few times.
ROUNDING = 1e-12


@given(
    st.lists(st.tuples(st.floats(-9, 9), st.floats(0.1, 10)), min_size=1, max_size=30),
    st.sampled_from([1.0, 0.9]),
    st.sampled_from([1, 3]),
)
def test_sums_that_do_not_grow_tell_the_weighted_mean(
    pairs: list[tuple[float, float]], part: float, counted: int
) -> None:
    gathered = Gathered()
    for pair in pairs:
        note = {"constants": {"inertia": pair, "damping": (np.nan, np.nan)}, "samples": 100, "counted": 100 * counted}
        gathered.add(note, part)
    found = gathered.means()
    assert found["damping"] == NOTHING_SAID
    values, errors = np.array(pairs).T
    fading = part ** np.arange(len(pairs))[::-1]
    weight = fading / errors**2
    mean = np.sum(weight * values) / weight.sum()
    error = np.sqrt(counted * np.sum(fading * weight)) / weight.sum()
    assert found["inertia"].value == pytest.approx(mean, rel=ROUNDING, abs=9 * ROUNDING)
    assert found["inertia"].error == pytest.approx(error * max(1, found["inertia"].spread), rel=ROUNDING)


@pytest.mark.parametrize(("counted", "part"), [(1, 1.0), (4, 1.0), (1, 0.97), (4, 0.97)])
def test_the_scatter_of_pieces_is_held_against_their_errors(counted: int, part: float) -> None:
    """Pieces that overlap are means over the same samples: they differ less, and the sums know."""
    generator = np.random.default_rng(counted)
    spreads: list[float] = []
    steady: list[bool] = []
    drifting: list[bool] = []
    for _ in range(60):
        samples = generator.standard_normal(120 + counted)
        values = np.convolve(samples, np.ones(counted) / np.sqrt(counted), "valid")[:120]
        for drift, into in ((0.0, steady), (6.0, drifting)):
            gathered = Gathered()
            for place, value in enumerate(values):
                one = {"inertia": (value + drift * place / 120, 1.0)}
                gathered.add({"constants": one, "samples": 1, "counted": counted}, part)
            mean = gathered.means()["inertia"]
            into.append(mean.agree)
            if not drift:
                spreads.append(mean.spread**2)
    # The mean of 60 variances, each of at least 20 independent values: known to 4 %, four times over.
    assert np.mean(spreads) == pytest.approx(1.0, abs=0.16)
    assert all(steady)
    assert np.mean(drifting) < 0.5


def test_a_part_has_its_numbers_where_they_are_wanted_with_what_was_chosen() -> None:
    rig = tvident.simulate_torsional_rig(duration=6.0)
    chosen = tvident.identify(rig.angle, rig.torque, sample_rate=1000).settings
    held = Held(rig.angle, rig.torque, [(10_000, 16_000)])
    given = Given("auto", {}, None, "omit", 1e-3, Axis(), 1)
    whole = given.identified(held, chosen=chosen)
    part = given.identified(held, chosen=chosen, wanted=(13_000, 13_900), diagnose=False)
    # Running sums of squared errors begin elsewhere, which is rounding, amplified by exponents of some tens.
    inside = slice(3000, 3900)
    assert part.stiffness[inside] == pytest.approx(whole.stiffness[inside], rel=1e3 * ROUNDING)
    for name in ("stiffness", "inertia"):
        assert part.stderr[name][inside] == pytest.approx(whole.stderr[name][inside], rel=1e3 * ROUNDING)
    assert part.constants == whole.constants
    assert np.isnan(part.stiffness[:2000]).all()
    assert np.isnan(part.stiffness[5000:]).all()
    # Windows of the length that was chosen before, even where another predicts better here.
    assert given.identified(held, chosen={**chosen, "regression_window": 1000}).settings["regression_window"] > 800
