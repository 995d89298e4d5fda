"""What pieces say of a constant together is what all values say at once, however they come and whatever they count."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvident._pieces import NOTHING_SAID, Gathered

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
