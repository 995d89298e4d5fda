from __future__ import annotations

from hostile import attack


def test_random_calls_give_a_result_or_a_message() -> None:
    attack.run("hostile.random_calls", cases=300, share=0.3)
