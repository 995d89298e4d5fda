from __future__ import annotations

from hostile import attack


def test_threads_and_forks_do_not_disturb_each_other() -> None:
    attack.run("hostile.threads", cases=3, share=0.05)
