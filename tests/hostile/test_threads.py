from __future__ import annotations

import pytest

from hostile import attack


@pytest.mark.slow
def test_threads_and_forks_do_not_disturb_each_other() -> None:
    attack.run("hostile.threads", cases=3, share=0.05)
