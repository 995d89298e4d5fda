from __future__ import annotations

from hostile import attack


def test_what_nobody_can_mean_ends_at_once() -> None:
    attack.run("hostile.hangs", cases=6, share=0.1)


def test_ctrl_c_ends_every_call() -> None:
    attack.run("hostile.interrupts", cases=6, share=0.1)
