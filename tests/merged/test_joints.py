"""Terms of the motion between two masses: named where they are missing, found where they are given."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import savgol_filter

import tvident
from merged.simulated import Masses, chain
from merged.test_without_a_word import wrong
from parameters import long
from tvident import Chain, Status

Array = npt.NDArray[np.float64]

SPRINGS: list[tuple[Any, int]] = [("base", 0), (0, 1)]


def velocity(angle: Array) -> Array:
    """Give the velocity, by polynomials that leave a hundredth of the noise."""
    return np.asarray(savgol_filter(angle, 41, 5, deriv=1, delta=1e-3))


SHAPES: dict[str, Callable[[Array], Array]] = {
    "coulomb": lambda angle: np.sign(velocity(angle)),
    "cubic": lambda angle: (angle / angle.std()) ** 3,
    "quadratic_drag": lambda angle: velocity(angle) * np.abs(velocity(angle)) / velocity(angle).std() ** 2,
}


def constant(value: float) -> Any:
    return lambda t: np.full(t.shape, value)


def with_term(term: str, part: float, *, seed: int, base: bool = False) -> tuple[Masses, Array, float]:
    """Give masses, torques that a term between two takes a part of, and its factor."""
    simulated = chain([constant(12.0), constant(18.0)], 10_000, seed=seed, base=base)
    angle, torque = simulated.angle, simulated.torque.copy()
    if base:
        assert simulated.base is not None
        moves = angle[0] - simulated.base
    else:
        moves = angle[1] - angle[0]
    size = part * torque[1].std()
    acts = size * SHAPES[term](moves)
    if base:
        torque[0] += acts
    else:
        torque[1] += acts
        torque[0] -= acts
    unit = {"coulomb": 1.0, "cubic": moves.std() ** 3, "quadratic_drag": velocity(moves).std() ** 2}
    return simulated, torque, size / unit[term]


def identified(simulated: Masses, torque: Array, structure: Chain, **options: Any) -> Any:
    return tvident.identify(simulated.angle, torque, structure=structure, sample_rate=1000, dof_axis=0, **options)


@pytest.mark.parametrize("where", ["masses", *long("base")])
@pytest.mark.parametrize(("part", "seed"), [(0.1, 1), *long((0.03, 2), (0.3, 3), (0.1, 4))])
@pytest.mark.parametrize("term", SHAPES)
def test_a_term_between_two_is_named_and_the_advice_finds_it(term: str, part: float, seed: int, where: str) -> None:
    """Friction and drag of a joint were taken for a damping that was 5 to 30 % too large, and up to 110 errors off, without a word."""
    base = where == "base"
    simulated, torque, size = with_term(term, part, seed=seed, base=base)
    without = Chain(2, SPRINGS, base=simulated.base if base else None)
    found = identified(simulated, torque, without)
    # What is trusted has errors that hold what the term would change.
    assert not found.trusted.any() or max(wrong(found, simulated).values()) < 4
    link: Any = ("base", 0) if base else (0, 1)
    if base and not found.record_status & Status.TERM_SUSPECTED:
        # Windows follow a spring that hardens within their errors.
        return
    assert found.record_status & Status.TERM_SUSPECTED
    who = "the base and mass 0" if base else "masses 0 and 1"
    given = [line for line in found.advice if line.startswith(f"between {who}: ")]
    named = rf"terms=\[.*{re.escape(str((term, link)))}.*\]\)$"
    assert any(re.search(named, line) for line in given), found.advice
    cured = identified(simulated, torque, Chain(2, SPRINGS, base=without.base, terms=[(term, link)]))
    value, error = cured.constants[f"{term}_{link[0]}_{link[1]}"]
    # Signs and squares of noisy velocities are a little smaller than those of true ones.
    assert abs(value - size) < 5 * error + 0.02 * size
    assert not cured.record_status & (Status.TERM_SUSPECTED | Status.NOISE_MODEL)
    assert max(wrong(cured, simulated).values()) < 5


def test_both_ends_of_a_joint_say_the_same() -> None:
    """A term acts on the second as it moves against the first: the other way round it has the same factor, as all of them are odd."""
    simulated, torque, _ = with_term("coulomb", 0.1, seed=1)
    one, other = (
        identified(simulated, torque, Chain(2, SPRINGS, terms=[("coulomb", link)])) for link in ((0, 1), (1, 0))
    )
    assert other.constants["coulomb_1_0"][0] == pytest.approx(one.constants["coulomb_0_1"][0], rel=1e-9)
    # Beside friction of each mass.
    all_three = identified(
        simulated, torque, Chain(2, SPRINGS, terms=[("coulomb", (0, 1))]), terms=["offset", "coulomb"]
    )
    for name in ("coulomb_0", "coulomb_1"):
        value, error = all_three.constants[name]
        assert abs(value) < 4 * error
    again = identified(simulated, torque, Chain(2, SPRINGS, terms=[("coulomb", (0, 1))]), settings=one.settings)
    for name, (value, error) in one.constants.items():
        assert again.constants[name] == pytest.approx((value, error), rel=1e-6, abs=1e-6 * error)


@pytest.mark.parametrize("term", SHAPES)
def test_what_was_found_is_simulated_with_its_joint(term: str) -> None:
    """The motion of the recording, from torques with the term in them; friction slides where it would stick."""
    simulated, torque, _ = with_term(term, 0.1, seed=1)
    found = identified(simulated, torque, Chain(2, SPRINGS, terms=[(term, (0, 1))]))
    assert (found.vaf(simulated.angle[:, :2000], torque[:, :2000]) > 98).all()


def test_an_own_base_moves_the_joint(tmp_path: Any) -> None:
    simulated, torque, _ = with_term("coulomb", 0.1, seed=1, base=True)
    structure = Chain(2, SPRINGS, base=simulated.base, terms=[("coulomb", ("base", 0))])
    found = identified(simulated, torque, structure)
    assert (found.vaf() > 98).all()
    found.save(tmp_path / "result.npz")
    loaded = tvident.load(tmp_path / "result.npz")
    assert loaded.constants == found.constants
    with pytest.raises(ValueError, match=r"must be there to (be simulated|simulate dry friction)|recording"):
        loaded.simulate(torque, initial=np.zeros((2, 2)), base=simulated.base)


def test_terms_of_a_chain_say_what_they_must_be() -> None:
    for terms, words in (
        ("coulomb", r"terms of a chain must be a list of pairs; got 'coulomb'; write \[\('coulomb', \(0, 1\)\)\], say"),
        (["coulomb"], r"terms of a chain must be pairs of a name and what it acts between; got 'coulomb'"),
        ([("offset", (0, 1))], r"a term of a chain must be"),
        ([("coulomb", (0, 2))], r"what a term acts between must connect two different masses below 2"),
        ([("coulomb", (0, 1)), ("coulomb", (1, 0))], r"a term must act between two once; got .* twice; leave one out"),
    ):
        with pytest.raises((TypeError, ValueError), match=words):
            Chain(2, SPRINGS, terms=terms)  # type: ignore[arg-type]
    chain_of = Chain(2, SPRINGS, terms=[("coulomb", (0, 1)), ("cubic", ("base", 0))])
    assert chain_of.names[-2:] == ("coulomb_0_1", "cubic_base_0")
