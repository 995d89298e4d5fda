"""Compare what type checkers are told of the compiled module with the module: `make lint-core`.

stubtest looks up the module that a stub is named after, and passes over what one stub takes from another. The parts of the stub, in
``_core_stubs/``, are named after modules that do not exist. So each part is compared with the compiled module as if that had its name.
"""

from __future__ import annotations

import sys
from pathlib import Path

from mypy import stubtest

from tvident import _core

FACE, PARTS = "tvident._core", "tvident._core_stubs"
FOLDER = Path(__file__).parents[1] / "python" / "tvident" / "_core_stubs"


def main() -> int:
    """Return 0 if stub and module agree, 1 otherwise; stubtest says where they do not."""
    parts = [f"{PARTS}.{path.stem}" for path in sorted(FOLDER.glob("*.pyi")) if path.stem != "__init__"]
    sys.modules |= dict.fromkeys(parts, _core)
    # The face must have every name, a part has some.
    face = stubtest.test_stubs(stubtest.parse_options([FACE]))
    return face or stubtest.test_stubs(stubtest.parse_options(["--ignore-missing-stub", *parts]))


if __name__ == "__main__":
    sys.exit(main())
