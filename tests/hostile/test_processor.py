from __future__ import annotations

import pytest

from hostile import attack, processor


@pytest.mark.slow
@pytest.mark.skipif(not processor.available(), reason="sets the modes of x86 processors")
def test_other_modes_of_the_processor_change_rounding_only() -> None:
    attack.run("hostile.processor", cases=1, share=0.05)
