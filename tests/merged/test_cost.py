"""The cost of several masses beside that of one."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time
from typing import Any

import tvident
from merged.simulated import chain, simulated
from merged.test_masses import OPTIONS, changing, constant, springs

identify: Any = tvident.identify
"""Its type is that of a single record."""


def seconds(call: Callable[[], object]) -> float:
    """Give the processor time of a call, of all threads."""
    start = process_time()
    call()
    return process_time() - start


def test_two_masses_cost_at_most_five_times_one() -> None:
    one = simulated(1, 5000, changing, seed=5)
    two = chain([changing, constant(18.0)], 5000, seed=5)

    def of_one() -> object:
        return identify(one.angle[0], one.torque[0], sample_rate=1000)

    def of_two() -> object:
        return identify(two.angle, two.torque, structure=tvident.Chain(2, springs(2)), **OPTIONS)

    # Three of each, in turn.
    times = [(seconds(of_one), seconds(of_two)) for _ in range(3)]
    least_of_one, least_of_two = (min(each) for each in zip(*times, strict=True))
    assert least_of_two < 5 * least_of_one


def test_four_times_as_many_trials_cost_hardly_more_than_four_times_as_much() -> None:
    """What trials differ by was sought among the rows of all: 200 trials took 11 to 15 times as long as 50."""
    trials = simulated(200, 500, changing, seed=5)

    def of(count: int) -> float:
        return seconds(lambda: identify(trials.angle[:count], trials.torque[:count], sample_rate=1000, ensemble_axis=0))

    times = [(of(50), of(200)) for _ in range(3)]
    least_of_few, least_of_many = (min(each) for each in zip(*times, strict=True))
    assert least_of_many < 7 * least_of_few
