from __future__ import annotations

import pytest

from hostile import attack
from parameters import long


@pytest.mark.parametrize("cases", [100, *long(300)])
def test_random_calls_give_a_result_or_a_message(cases: int) -> None:
    attack.run("hostile.random_calls", cases=cases, share=0.3)
