"""An offset that is free in every window is advised only where as much of the record can be trusted with it."""

from __future__ import annotations

import numpy as np

import tvident
from tvident._advice import FREE_OFFSET
from tvident._identify.free_offset import without_worse_offset
from tvident._results import Words

RIG = tvident.simulate_torsional_rig(6.0)


def identified(first: int) -> tvident.Identification:
    """Identify the rig without samples before the first."""
    torque = np.where(np.arange(RIG.torque.size) < first, np.nan, RIG.torque)
    return tvident.identify(RIG.angle, torque, sample_rate=1000)


def test_it_is_dropped_where_less_can_be_trusted_with_it() -> None:
    good, worse = identified(0), identified(3000)
    assert 0 < worse.trusted.mean() < 0.8 < good.trusted.mean()
    words = Words((), (f"{FREE_OFFSET}: its error is less", "another"))
    assert without_worse_offset(words, good, lambda: worse).advice == ("another",)
    assert without_worse_offset(words, good, lambda: good) is words
    assert without_worse_offset(words, worse, lambda: good) is words


def test_it_is_dropped_where_nothing_can_be_identified_with_it() -> None:
    def again() -> tvident.Identification:
        return tvident.identify(RIG.angle[:3], RIG.torque[:3], sample_rate=1000)

    words = Words((), (f"{FREE_OFFSET}: its error is less",))
    assert without_worse_offset(words, identified(0), again).advice == ()


def test_nothing_is_tried_where_it_is_not_advised() -> None:
    tried: list[tvident.Identification] = []

    def again() -> tvident.Identification:
        tried.append(identified(0))
        return tried[0]

    words = Words((), ("another",))
    assert without_worse_offset(words, identified(0), again) is words
    assert not tried
