from __future__ import annotations

import pytest

from hostile import attack


@pytest.mark.slow
def test_every_argument_takes_every_odd_value_or_says_what_was_wrong() -> None:
    attack.run("hostile.each_argument", cases=70, share=0.05)
